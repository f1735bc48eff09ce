"""Fig. 5, 8 and 9 of the paper, drawn from the logs of binpose-paper."""
import statistics

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  the backend comes first
import numpy as np  # noqa: E402

from tables import measured, scene_kinds, total, wilson  # noqa: E402

COLOURS = {"distinctiveness": "tab:red", "observability": "tab:green", "integration": "tab:blue",
           "unrefined": "tab:orange", "binpose": "black"}
LABELS = {"unrefined": "paper's preset, no ICP", "integration": "paper's preset, ICP", "binpose": "binpose default"}


def save(figure, path, dpi=90):
    figure.tight_layout()
    figure.savefig(path, dpi=dpi)
    plt.close(figure)


def rate_with_bounds(runs):
    """Recognition rate in percent, and how far its 95 % interval reaches down and up."""
    hits, count = total(runs, "best_right"), len(runs)
    low, high = wilson(hits, count)
    middle = hits / max(1, count)
    return 100 * middle, 100 * max(0.0, middle - low), 100 * max(0.0, high - middle)


def errors(log, path):
    """Fig. 5: share of the scenes below an error, for translation and rotation, for each kind of cloud."""
    kinds = scene_kinds(log)
    figure, axes = plt.subplots(len(kinds), 2, figsize=(9, 3 * len(kinds)), sharey=True, squeeze=False)
    for row, (scene, density) in zip(axes, kinds):
        lines = [line["results"] for line in log if line["scene"] == scene]
        for axis, field, unit, bar in ((row[0], "degrees", "degrees", 5), (row[1], "mm", "mm", density)):
            for name, label in LABELS.items():
                values = sorted(line[name][field] if line[name] else np.inf for line in lines)
                axis.step(values, 100 * np.arange(1, len(values) + 1) / len(values), where="post",
                          color=COLOURS[name], label=label)
            axis.axvline(bar, color="grey", linestyle="--", linewidth=1)
            axis.axvline(bar / 10, color="grey", linestyle=":", linewidth=1)
            axis.set(xscale="log", xlim=(0.003, 300), ylim=(0, 101), xlabel=f"error, {unit}",
                     title=f"{'rotation' if field == 'degrees' else 'translation'}, {scene}")
            axis.grid(alpha=0.3)
        row[0].set_ylabel("% of the scenes below")
    axes[0][0].legend(loc="upper left", fontsize=8)
    save(figure, path)


def pair_numbers(log, path):
    """Fig. 8: recognition rate against N_vp."""
    names = sorted({name for line in log for name in line["results"] if name.startswith("pairs ")})
    figure, axis = plt.subplots(figsize=(6, 4))
    for shift, selection in enumerate(("distinctiveness", "observability", "integration")):
        percents = sorted(int(name.split()[2]) for name in names if name.split()[1] == selection)
        points = [rate_with_bounds(measured(log, f"pairs {selection} {percent}")) for percent in percents]
        middle, down, up = np.array(points).T
        axis.errorbar(np.array(percents) * (1 + 0.04 * (shift - 1)), middle, (down, up), color=COLOURS[selection],
                      label=selection, marker="o", markersize=4, capsize=2, linewidth=1.2)
    axis.set(xscale="log", xlabel="vector pairs, % of the model points", ylabel="best pose right, % of the scenes",
             ylim=(0, 102), xticks=percents, xticklabels=percents)
    axis.minorticks_off()
    axis.grid(alpha=0.3)
    axis.legend(loc="lower right")
    save(figure, path)


def weights(log, path):
    """Fig. 9: recognition rate and time when the weights of Eq. 7 vary."""
    names = [name for name in (log[0]["results"] if log else ()) if name.startswith("weights ")]
    places = range(len(names))
    figure, axis = plt.subplots(figsize=(6, 4))
    middle, down, up = np.array([rate_with_bounds(measured(log, name)) for name in names]).T
    axis.errorbar(places, middle, (down, up), color="tab:blue", marker="o", markersize=4, capsize=2)
    axis.set(xticks=places, xticklabels=[name.split()[1] for name in names], ylim=(0, 102),
             xlabel="observability : distinctiveness")
    axis.set_ylabel("best pose right, % of the scenes", color="tab:blue")
    axis.grid(alpha=0.3)
    time = axis.twinx()
    times = [[1000 * run["seconds"] for run in measured(log, name)] for name in names]
    medians = [statistics.median(values) for values in times]
    time.plot(places, medians, color="tab:red", marker="s", markersize=4)
    time.set_ylim(0, 2 * max(medians))  # below the rates
    time.set_ylabel("median ms a scene", color="tab:red")
    save(figure, path)
