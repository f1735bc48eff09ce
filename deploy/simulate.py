#!/usr/bin/env python3
"""How long scans take on a cluster of binpose servers: the time to an answer against the load, for 1 to 64 nodes.

A discrete-event simulation with the costs of deploy/README.md, "Planning", which lists what it assumes too. Needs Python
only: simulate.py --help.
"""

import argparse
import bisect
import hashlib
import heapq
import math
import random


def point(text):
    return int.from_bytes(hashlib.sha1(text.encode()).digest()[:8], "big")


def place(cells, models, nodes, bound):
    """A node for each cell's stream: by consistent hash of its model, as long as the node has no more than `bound` times
    the mean of the streams; what deploy/haproxy/haproxy.cfg does."""
    ring = sorted((point(f"{node}/{i}"), node) for node in range(nodes) for i in range(64))
    keys = [key for key, _ in ring]
    streams = [0] * nodes
    chosen = []
    for cell in range(cells):
        limit = math.ceil(bound * (cell + 1) / nodes)
        i = bisect.bisect(keys, point(f"model-{cell % models}"))
        while streams[ring[i % len(ring)][1]] >= limit:
            i += 1
        chosen.append(ring[i % len(ring)][1])
        streams[chosen[-1]] += 1
    return chosen


def simulate(options, nodes, load, rng):
    """Seconds from each scan's arrival to its answer, and the share that was refused."""
    cells = max(1, round(load * nodes * options.threads / (options.rate * options.seconds)))
    node_of = place(cells, options.models or cells, nodes, options.bound)
    free = [[0.0] * options.threads for _ in range(nodes)]  # when each thread is done
    waiting = [[] for _ in range(nodes)]  # starts to come
    sigma = math.sqrt(math.log(1 + options.variation**2))
    mu = math.log(options.seconds) - sigma**2 / 2
    arrivals = [(rng.uniform(0, 1 / options.rate), cell) for cell in range(cells)]
    heapq.heapify(arrivals)
    times, refused = [], 0
    while arrivals[0][0] < options.duration:
        now, cell = arrivals[0]
        # A cell scans at its rate, but no cycle is as long as the next.
        heapq.heapreplace(arrivals, (now + rng.uniform(0.5, 1.5) / options.rate, cell))
        node = node_of[cell]
        while waiting[node] and waiting[node][0] <= now:
            heapq.heappop(waiting[node])
        if len(waiting[node]) >= options.queue:
            refused += 1
            continue
        start = max(now, heapq.heappop(free[node]))
        done = start + rng.lognormvariate(mu, sigma)
        heapq.heappush(free[node], done)
        if start > now:
            heapq.heappush(waiting[node], start)
        times.append(done - now + options.overhead)
    return times, refused / (len(times) + refused)


def percentile(times, share):
    return sorted(times)[min(len(times) - 1, math.ceil(share * len(times)) - 1)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("--seconds", type=float, default=0.1, help="of one core that a scan takes, in the mean")
    parser.add_argument("--variation", type=float, default=0.4, help="of these, standard deviation / mean")
    parser.add_argument("--overhead", type=float, default=0.015, help="seconds of wire, balancer and decoding")
    parser.add_argument("--threads", type=int, default=2, help="of a node, --threads of the server")
    parser.add_argument("--queue", type=int, default=64, help="of a node, --queue of the server")
    parser.add_argument("--rate", type=float, default=0.5, help="scans a second of a cell")
    parser.add_argument("--models", type=int, default=0, help="that the cells share; 0: each has its own")
    parser.add_argument("--bound", type=float, default=1.25, help="hash-balance-factor / 100; large: none")
    parser.add_argument("--duration", type=float, default=600, help="simulated seconds")
    parser.add_argument("--loads", type=float, nargs="+", default=[0.3, 0.5, 0.6, 0.7, 0.8, 0.9])
    parser.add_argument("--nodes", type=int, nargs="+", default=[1, 2, 4, 8, 16, 32, 64])
    options = parser.parse_args()
    print("p99 in seconds (refused), by nodes and by load = cells x rate x seconds / all threads")
    print("nodes  cells at 0.6 " + "".join(f"{load:>14}" for load in options.loads))
    for nodes in options.nodes:
        row = f"{nodes:5}  {0.6 * nodes * options.threads / options.rate / options.seconds:12.0f} "
        for load in options.loads:
            times, refused = simulate(options, nodes, load, random.Random(1))
            row += f"{percentile(times, 0.99):8.2f} ({100 * refused:2.0f}%)"
        print(row)


if __name__ == "__main__":
    main()
