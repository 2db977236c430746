"""The plots, as SVG."""

import math
import os
import sys

from .json_file import InputError
from .runs import geometric_mean, paired_ratios


def save(figure, folder, name):
    """Writes NAME.svg. The same figures give the same bytes: no date, and no random ids (load_pyplot)."""
    try:
        figure.savefig(os.path.join(folder, f"{name}.svg"), bbox_inches="tight", metadata={"Date": None})
    except ValueError as error:
        raise InputError(f"{name}.svg: cannot be drawn: {error}") from error


def plot_scene(plt, runs, scene, folder, most, lines):
    """Draws bars: Mrays/s by kind of the best variants of a scene. lines: name -> speeds, drawn as dashed lines."""
    kinds = runs.kinds(scene)
    rows = [row for row in runs.rows.values() if any(cell[0] == scene for cell in row.speeds)]
    rows.sort(key=lambda row: -geometric_mean(v for cell, v in row.speeds.items() if cell[0] == scene))
    rows = rows[:most][::-1]
    size = (3 * len(kinds) + 4, 0.28 * len(rows) + 1.5)
    figure, axes = plt.subplots(1, len(kinds), sharey=True, figsize=size, squeeze=False)
    for axis, kind in zip(axes[0], kinds):
        colors = ["tab:blue" if row.axes["tests"] == "accurate" else "tab:orange" for row in rows]
        axis.barh([row.name() for row in rows], [row.speeds.get((scene, kind), 0) for row in rows], color=colors)
        for (name, speeds), colour in zip(lines.items(), ["black", "gray"]):
            if (scene, kind) in speeds:
                axis.axvline(speeds[(scene, kind)], color=colour, linewidth=1, linestyle="--", label=name)
                axis.legend(fontsize=6, loc="lower right")
        axis.set_title(kind)
        axis.set_xlabel("Mrays/s")
        axis.tick_params(axis="y", labelsize=7)
    figure.suptitle(f"{scene} (blue: accurate, orange: fast)")
    save(figure, folder, f"variants_{scene}")
    plt.close(figure)


def plot_accuracy_panel(axis, ratios):
    """Bars from 1, where a ratio was measured."""
    places = [i for i, ratio in enumerate(ratios) if not math.isnan(ratio)]
    changes = [ratios[i] - 1 for i in places]
    axis.barh(places, changes, left=1, color=["tab:orange" if change > 0 else "tab:blue" for change in changes])
    for i in set(range(len(ratios))) - set(places):
        axis.text(1, i, "not measured", fontsize=6, color="gray", ha="center", va="center",
                  bbox={"color": "white", "pad": 0.5})
    axis.axvline(1, color="black", linewidth=0.8)
    axis.grid(axis="x", linewidth=0.4)
    axis.set_axisbelow(True)
    axis.tick_params(axis="both", labelsize=7)


def plot_accuracy(plt, runs, folder):
    """How much faster the fast tests are, by scene."""
    pairs = [(accurate.name(), ratios) for accurate, _, ratios in paired_ratios(runs, "tests", "accurate", "fast")]
    if not pairs:
        return
    panels = [*runs.scenes(), None]
    figure, axes = plt.subplots(1, len(panels), sharex=True, sharey=True, squeeze=False,
                                figsize=(1.9 * len(panels) + 4, 0.2 * len(pairs) + 1.5))
    for axis, scene in zip(axes[0], panels):
        plot_accuracy_panel(axis, [geometric_mean(ratio for cell, ratio in ratios.items() if scene in (None, cell[0]))
                                   for _, ratios in pairs])
        axis.set_title(scene or "all cells", fontsize=9)
    axes[0][0].set_yticks(range(len(pairs)))
    axes[0][0].set_yticklabels([name for name, _ in pairs])
    axes[0][0].set_ylim(len(pairs) - 0.4, -0.6)
    title = "Speed of Fast and Plain relative to Watertight and Conservative (geometric means; orange: they are faster)"
    figure.suptitle(title, fontsize=10)
    figure.tight_layout()
    save(figure, folder, "accuracy_cost")
    plt.close(figure)


def plot_memory(plt, runs, folder):
    """Points: the best accurate variant of each tree, speed over bytes per triangle."""
    scenes = runs.scenes()
    figure, axes = plt.subplots(1, len(scenes), figsize=(4 * len(scenes), 3.5), squeeze=False)
    for axis, scene in zip(axes[0], scenes):
        best = {}
        for row in runs.rows.values():
            for (where, kind), speed in row.speeds.items():
                if where == scene and row.axes["tests"] == "accurate":
                    point = (row.bytes_per_triangle[scene], speed, row.axes["tree"])
                    best[(kind, point[2])] = max(point, best.get((kind, point[2]), point), key=lambda p: p[1])
        for kind in runs.kinds(scene):
            points = sorted(point for (k, _), point in best.items() if k == kind)
            axis.plot([p[0] for p in points], [p[1] for p in points], "o", label=kind)
            for place, speed, tree in points:
                axis.annotate(tree, (place, speed), fontsize=6, xytext=(4, 2), textcoords="offset points")
        axis.margins(x=0.25)
        axis.legend(fontsize=6)
        axis.set_title(scene)
        axis.set_xlabel("bytes per triangle")
        axis.set_ylabel("Mrays/s")
    figure.tight_layout()
    save(figure, folder, "speed_and_memory")
    plt.close(figure)


def load_pyplot(script):
    """Returns pyplot without a screen. Without matplotlib it prints a message and returns None."""
    try:
        import matplotlib
    except ImportError:
        print(f"{script}: no plots: no matplotlib here (tools/install-packages test)", file=sys.stderr)
        return None
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "hiprt"
    # Text as text, not as outlines: small files that can be searched.
    matplotlib.rcParams["svg.fonttype"] = "none"
    # Names hold no formulas. matplotlib before 3.6 takes a name with two dollar signs for one.
    if "text.parse_math" in matplotlib.rcParams:
        matplotlib.rcParams["text.parse_math"] = False
    from matplotlib import pyplot

    return pyplot


def plot_all(runs, folder, most, lines):
    plt = load_pyplot("plot_variants.py")
    if plt is None:
        return
    for scene in runs.scenes():
        plot_scene(plt, runs, scene, folder, most, lines)
    plot_accuracy(plt, runs, folder)
    if runs.scenes():
        plot_memory(plt, runs, folder)
