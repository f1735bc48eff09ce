"""Writes the paper's tables into PAPER.md and draws its figures. Usage: report.py RESULTS SCENES PAPER.md

RESULTS holds the logs of binpose-paper; SCENES the folders they were measured on. Tables stand between comment lines
<!-- name --> and <!-- /name -->; what is written around them by hand stays. Pictures go to the folder pictures beside PAPER.md.
"""
import json
import platform
import re
import sys
from pathlib import Path

import plots
import scans
import tables


def read_logs(results, experiment):
    """The lines of all processes that took part in an experiment."""
    logs = sorted(results.glob(f"{experiment}*.jsonl"))
    return [json.loads(line) for log in logs for line in log.read_text().splitlines()]


def processor():
    names = [line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line]
    return f"{len(names)} x {names[0]}" if names else platform.processor()


def put(text, name, table):
    """The text with `table` between its marks; a table without marks is an error."""
    marked = re.compile(rf"(<!-- {name} -->\n).*?(<!-- /{name} -->)", re.DOTALL)
    if not marked.search(text):
        raise SystemExit(f"PAPER.md has no place for the table {name}")
    return marked.sub(lambda match: match[1] + table + match[2], text)


def main():
    results, scenes, paper = (Path(argument) for argument in sys.argv[1:])
    table, sweep, accuracy, pictures = (read_logs(results, experiment)
                                        for experiment in ("table", "sweep", "accuracy", "pictures"))
    text = paper.read_text()
    text = put(text, "setting", tables.setting(table, processor()))
    text = put(text, "recognition", tables.recognition(table))
    text = put(text, "instances", tables.instances(table))
    text = put(text, "unrefined", tables.unrefined(sweep))
    text = put(text, "accuracy", tables.accuracy(accuracy))
    paper.write_text(text)

    folder = paper.parent / "pictures"
    folder.mkdir(exist_ok=True)
    plots.errors(accuracy, folder / "fig5_accuracy.png")
    plots.pair_numbers(sweep, folder / "fig8_pair_number.png")
    plots.weights(sweep, folder / "fig9_weights.png")
    scans.observability(pictures, folder / "fig3_observability.png")
    scans.recognised(pictures, scenes, folder / "fig6_recognised.png")
    scans.selected_pairs(pictures, folder / "fig7_vector_pairs.png")


if __name__ == "__main__":
    main()
