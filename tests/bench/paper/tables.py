"""The tables of PAPER.md from the logs of binpose-paper."""
import statistics
from math import sqrt

PARTS = {"bearing_support": "A", "gear_housing": "B", "lock_plate": "C", "spindle": "D"}
METHODS = {
    "shot": "SHOT + correspondence grouping",
    "fpfh": "FPFH + RANSAC",
    "distinctiveness": "vector pairs, distinctiveness",
    "observability": "vector pairs, observability",
    "integration": "vector pairs, integration",
    "binpose": "**binpose, default**",
}
# Table I of the paper: success in percent and seconds, parts A to D.
PAPER = {
    "shot": ((51.3, 77.9, 33.6, 20.3), (27.78, 19.46, 33.69, 22.48)),
    "fpfh": ((54.9, 11.5, 73.5, 31.0), (0.67, 3.97, 1.07, 0.91)),
    "distinctiveness": ((40.7, 31.0, 47.8, 33.6), (0.27, 1.41, 0.39, 0.72)),
    "observability": ((97.3, 100.0, 94.7, 85.0), (0.47, 1.76, 1.76, 1.99)),
    "integration": ((99.1, 95.6, 92.0, 85.8), (0.44, 1.76, 1.42, 1.81)),
}


def wilson(hits, trials):
    """Bounds of the 95 % Wilson score interval of a rate, in [0, 1]."""
    if trials == 0:
        return 0.0, 1.0
    z = 1.959964
    rate = hits / trials
    middle = (rate + z * z / (2 * trials)) / (1 + z * z / trials)
    reach = z / (1 + z * z / trials) * sqrt(rate * (1 - rate) / trials + z * z / (4 * trials * trials))
    return max(0.0, middle - reach), min(1.0, middle + reach)


def rate(hits, trials):
    """"7/8, 53-98 %": the counts and the interval."""
    if trials == 0:
        return "-"
    low, high = wilson(hits, trials)
    return f"{hits}/{trials}, {100 * low:.0f}-{100 * high:.0f} %"


def seconds(values):
    """Median and the middle half, "0.11 (0.10-0.13)"."""
    if not values:
        return "-"
    low, middle, high = statistics.quantiles(values, n=4) if len(values) > 1 else values * 3
    digits = 2 if middle < 10 else 1
    return f"{middle:.{digits}f} ({low:.{digits}f}-{high:.{digits}f})"


def measured(log, name, part=None):
    """What `name` gave on the scenes of one part, or of all."""
    return [line["results"][name] for line in log if part in (None, line["part"]) and name in line["results"]]


def total(runs, field):
    return sum(run[field] for run in runs)


def rows(head, body):
    lines = [head, ["---"] * len(head), *body]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def setting(log, processor):
    counts = ", ".join(f"{letter} {len(measured(log, 'binpose', part))}" for part, letter in PARTS.items())
    return f"Scenes: {counts}; seeds from 1001 on. Machine: {processor}, one thread.\n"


def recognition(log):
    body = []
    for name, title in METHODS.items():
        for field, paper in (("success", 0), ("seconds", 1)):
            line = [title if field == "success" else "", field]
            for column, part in enumerate(PARTS):
                runs = measured(log, name, part)
                text = rate(total(runs, "best_right"), len(runs)) if field == "success" else \
                    seconds([run["seconds"] for run in runs])
                line.append(text + (f" *[{PAPER[name][paper][column]}]*" if name in PAPER else ""))
            runs = measured(log, name)
            line.append(rate(total(runs, "best_right"), len(runs)) if field == "success" else "")
            if field == "success" and name in PAPER:
                line[-1] += f" *[{sum(PAPER[name][0]) / 4:.1f}]*"
            body.append(line)
    return rows(["method", "", *PARTS.values(), "all"], body)


def instances(log):
    body = []
    for name, title in METHODS.items():
        runs = measured(log, name)
        hits, wrong, count = (total(runs, field) for field in ("hits", "wrong", "instances"))
        parts = [f"{total(measured(log, name, part), 'hits')}/{total(measured(log, name, part), 'instances')}"
                 for part in PARTS]
        body.append([title, *parts, rate(hits, count), rate(hits, hits + wrong)])
    return rows(["method", *(f"found of {letter}" for letter in PARTS.values()), "recall", "precision"], body)


def unrefined(log):
    body = []
    for name in ("distinctiveness", "observability", "integration"):
        line = [METHODS[name]]
        for part in (*PARTS, None):
            runs = measured(log, f"unrefined {name}", part)
            line.append(rate(total(runs, "best_right"), len(runs)))
        body.append(line)
    return rows(["as the paper has it: no ICP", *PARTS.values(), "all"], body)


def scene_kinds(log):
    """How Fig. 5's clouds are made, and their density in mm, in the order of the log."""
    return list(dict.fromkeys((line["scene"], line["density_mm"]) for line in log))


def accuracy(log):
    names = {"unrefined": "the paper's preset, no ICP", "integration": "the paper's preset and ICP",
             "binpose": METHODS["binpose"]}
    body = []
    for scene, density in scene_kinds(log):
        lines = [line["results"] for line in log if line["scene"] == scene]
        for name, title in names.items():
            found = [line[name] for line in lines if line[name]]
            share = [rate(sum(error["mm"] <= limit_mm and error["degrees"] <= limit for error in found), len(lines))
                     for limit_mm, limit in ((density, 5), (density / 10, 0.5))]
            medians = [f"{statistics.median(error[field] for error in found):.3f}" if found else "-"
                       for field in ("mm", "degrees")]
            body.append([scene, title, *share, *medians])
    return rows(["scene", "method", "within the density and 5 degrees", "within a tenth of both", "median mm",
                 "median degrees"], body)
