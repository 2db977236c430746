#!/usr/bin/env python3
"""Turns JSON of bench_variants into a summary in Markdown and plots. See --help."""

import argparse
import json
import math
import os
import sys

KINDS = ["primary", "ao", "shadow", "diffuse", "diffuse2"]
ANY_KINDS = {"ao", "shadow"}
ROW_AXES = ["layout", "tests", "stack", "schedule", "order", "features", "blocks"]


def geometric_mean(values):
    values = list(values)
    return math.exp(sum(map(math.log, values)) / len(values)) if values else float("nan")


def usual_order(result):
    """The queries of a variant share a row when each has the library's order for it (variant.h: has_usual_order())."""
    any_order = result["query"] == "any" or (result["query"] == "all" and result["features"] == "triangles")
    usual = "stored" if any_order else "sorted"
    return "usual" if result["order"] in (usual, "tested") else result["order"]


def kind_of(result):
    """All hits are asked of the rays that closest hits are asked of."""
    return result["kind"] + (" all" if result["query"] == "all" else "")


class Row:
    """A variant over trees of one name: speeds by scene and kind."""

    def __init__(self, key):
        self.key = key
        self.axes = dict(zip(["tree"] + ROW_AXES, key))
        self.speeds = {}
        self.registers = {}
        self.occupancy = {}
        self.bytes_per_triangle = {}

    def name(self):
        """The tree's name is left out where it says no more than the layout."""
        return " ".join(self.key[1:] if self.axes["tree"] == self.axes["layout"] else self.key)

    def ratios(self, reference, kinds=None):
        """(scene, kind) -> times the reference, where both have a figure."""
        return {
            cell: speed / reference[cell]
            for cell, speed in self.speeds.items()
            if cell in reference and (kinds is None or cell[1] in kinds)
        }


class Runs:
    """All results of the given files."""

    def __init__(self, paths):
        self.files = []
        self.rows = {}
        self.trees = {}
        self.spread = []
        self.faults = []
        for path in paths:
            self.read(path)

    def read(self, path):
        with open(path, encoding="utf-8") as file:
            data = json.load(file)
        if data.get("format") != "hiprt bench_variants 1":
            raise ValueError(f"{path}: not a file of bench_variants")
        self.files.append((path, data))
        self.faults += data.get("faults") or []
        for tree in data.get("trees") or []:
            self.trees[(tree["scene"], tree["tree"])] = tree
        for result in data.get("results") or []:
            self.add(result)

    def add(self, result):
        # A variant that failed or answered otherwise has no speed.
        if result["repetitions"] == 0 or result["problem"] or result["overflowed_rays"]:
            return
        values = [usual_order(result) if axis == "order" else result[axis] for axis in ROW_AXES]
        key = (result["tree"], *values)
        row = self.rows.setdefault(key, Row(key))
        cell = (result["scene"], kind_of(result))
        row.speeds[cell] = max(result["mrays_s"], row.speeds.get(cell, 0.0))
        row.registers[result["query"]] = result["registers"]
        row.occupancy[result["query"]] = result["occupancy"]
        tree = self.trees[(result["scene"], result["tree"])]
        row.bytes_per_triangle[result["scene"]] = tree["bytes_per_triangle"]
        self.spread.append((result["max_ms"] - result["min_ms"]) / result["median_ms"])

    def scenes(self):
        return sorted({cell[0] for row in self.rows.values() for cell in row.speeds})

    def kinds(self, scene=None):
        """Of one scene, or of all."""
        cells = {cell for row in self.rows.values() for cell in row.speeds}
        found = {cell[1] for cell in cells if scene in (None, cell[0])}
        return [kind for kind in KINDS if kind in found] + sorted(found - set(KINDS))


class Peers:
    """What other tracers reach, by scene and kind."""

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            self.data = json.load(file)
        self.references = {
            "best HIPRT": self.best({"hiprt"}),
            "OptiX": self.best({"optix"}),
            "best peer": self.best({peer["group"] for peer in self.data["peers"]}),
        }

    def best(self, groups):
        cells = {}
        for peer in self.data["peers"]:
            if peer["group"] not in groups:
                continue
            for scene, speeds in peer["mrays_s"].items():
                for kind, speed in speeds.items():
                    cells[(scene, kind)] = max(speed, cells.get((scene, kind), 0))
        return cells


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "|".join(["---"] + ["---:"] * (len(head) - 1)) + "|"]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows]) + "\n"


def number(value, digits=2):
    return "" if value is None or math.isnan(value) else f"{value:.{digits}f}"


def provenance_text(runs):
    text = ""
    for path, data in runs.files:
        device = data["device"]
        text += f"- `{os.path.basename(path)}`: {device['name']}, commit {data['commit']}, {data['date']}, `{data['command']}`\n"
        for key in ["driver", "runtime_version", "compute_units", "timed"]:
            if device.get(key):
                text += f"  - {key.replace('_', ' ')}: {device[key]}\n"
    if runs.spread:
        spread = sorted(runs.spread)
        text += f"- (slowest - fastest) / median of the repetitions: median {spread[len(spread) // 2]:.1%}, "
        text += f"worst {spread[-1]:.1%}\n"
    return text + "".join(f"- **wrong result**: {fault}\n" for fault in runs.faults)


def ranking_text(runs, peers):
    """Every variant against the peers, best first."""
    ranked = []
    hiprt = peers.references["best HIPRT"]
    kinds = [kind for kind in runs.kinds() if any(cell[1] == kind for cell in hiprt)]
    for row in runs.rows.values():
        means = [geometric_mean(row.ratios(reference).values()) for reference in peers.references.values()]
        if math.isnan(means[0]):
            continue
        by_kind = [geometric_mean(row.ratios(hiprt, {kind}).values()) for kind in kinds]
        ranked.append((len(row.ratios(hiprt)), means, by_kind, row))
    ranked.sort(key=lambda entry: (-entry[0], -entry[1][0]))
    if not ranked:
        return "None of the peers' scenes was measured.\n"
    head = ["variant", "cells"] + [f"x {name}" for name in peers.references]
    head += [f"{kind} x best HIPRT" for kind in kinds]
    rows = [[row.name(), cells] + [number(mean, 3) for mean in means + by_kind] for cells, means, by_kind, row in ranked]
    return table(head, rows)


def best_row(runs, peers, kinds):
    """The accurate variant with the best geometric mean over the cells of these kinds."""
    best, best_key = None, (0, 0.0)
    for row in runs.rows.values():
        ratios = row.ratios(peers.references["best HIPRT"], kinds)
        if row.axes["tests"] != "accurate" or not ratios:
            continue
        key = (len(ratios), geometric_mean(ratios.values()))
        if key > best_key:
            best, best_key = row, key
    return best


def cells_text(runs, peers):
    """Per cell: what one choice per query reaches, and the best variant of all."""
    closest = best_row(runs, peers, set(runs.kinds()) - ANY_KINDS)
    any_hit = best_row(runs, peers, ANY_KINDS)
    chosen, fastest = {}, {}
    for row in runs.rows.values():
        for cell, speed in row.speeds.items():
            if row is (any_hit if cell[1] in ANY_KINDS else closest):
                chosen[cell] = speed
            if row.axes["tests"] == "accurate" and speed > fastest.get(cell, (0, None))[0]:
                fastest[cell] = (speed, row)
    text = f"One accurate variant per query: closest hits `{closest.name() if closest else 'none'}`, "
    text += f"any hits `{any_hit.name() if any_hit else 'none'}`.\n\n"
    text += one_cell_table(runs, peers, chosen) + "\nThe fastest accurate variant of each cell:\n\n"
    return text + one_cell_table(runs, peers, {cell: best[0] for cell, best in fastest.items()})


def one_cell_table(runs, peers, speeds):
    """Speeds and ratios, and the geometric means over all cells that the peers have too."""
    rows = []
    for scene in runs.scenes():
        for kind in runs.kinds():
            if (scene, kind) not in speeds:
                continue
            speed = speeds[(scene, kind)]
            ratios = [speed / ref[(scene, kind)] if (scene, kind) in ref else None for ref in peers.references.values()]
            rows.append([f"{scene} {kind}", number(speed, 0 if speed >= 100 else 2)] + [number(r) for r in ratios])
    means = []
    for reference in peers.references.values():
        means.append(geometric_mean(speed / reference[cell] for cell, speed in speeds.items() if cell in reference))
    shared = sum(cell in peers.references["OptiX"] for cell in speeds)
    if shared:
        rows.append([f"**geometric mean of {shared} cells**", ""] + [f"**{number(mean)}**" for mean in means])
    return table(["cell", "Mrays/s"] + [f"x {name}" for name in peers.references], rows)


def paired_means(runs, axis, base, other):
    """Rows that differ in one axis only: (base row, other row, speed of other relative to base)."""
    place = (["tree"] + ROW_AXES).index(axis)
    for key, row in runs.rows.items():
        partner = runs.rows.get((*key[:place], other, *key[place + 1:]))
        if key[place] != base or partner is None:
            continue
        ratios = [partner.speeds[cell] / row.speeds[cell] for cell in row.speeds if cell in partner.speeds]
        if ratios:
            yield row, partner, geometric_mean(ratios)


def registers_text(row):
    return "/".join(str(row.registers[query]) for query in sorted(row.registers, reverse=True))


def accuracy_text(runs):
    rows = [[accurate.name(), registers_text(accurate), registers_text(fast), number(ratio, 3)]
            for accurate, fast, ratio in paired_means(runs, "tests", "accurate", "fast")]
    return table(["accurate variant", "registers", "of fast", "fast is x"], rows) if rows else "Not measured.\n"


def features_text(runs):
    """Each set of features against the smallest that was measured with the same other choices."""
    order = ["triangles", "splits", "masks", "filter", "custom", "custom-filter"]
    rows, seen = [], set()
    for i, base in enumerate(order):
        for other in order[i + 1:]:
            for row, partner, ratio in paired_means(runs, "features", base, other):
                if partner.key in seen:
                    continue
                seen.add(partner.key)
                rows.append([partner.name(), base, registers_text(row), registers_text(partner), number(ratio, 3)])
    head = ["variant", "against", "registers there", "registers", "speed x"]
    return table(head, rows) if rows else "Not measured.\n"


def summary(runs, peers):
    text = "# Variants of the traversal\n\n" + provenance_text(runs)
    text += f"\n## Against {peers.data['gpu']} peers\n\n{ranking_text(runs, peers)}\n## By cell\n\n{cells_text(runs, peers)}"
    text += f"\n## What accuracy costs\n\n{accuracy_text(runs)}\n## What features cost\n\n{features_text(runs)}"
    text += "\n## Peers\n\n" + peers.data["method"] + "\n\n"
    return text + "".join(f"- {peer['name']}: {peer['source']}\n" for peer in peers.data["peers"])


def save(figure, folder, name):
    for extension in ["png", "svg"]:
        figure.savefig(os.path.join(folder, f"{name}.{extension}"), dpi=120, bbox_inches="tight")


def plot_scene(plt, runs, scene, folder, most):
    """Bars: Mrays/s by kind of the best variants of a scene."""
    kinds = runs.kinds(scene)
    rows = [row for row in runs.rows.values() if any(cell[0] == scene for cell in row.speeds)]
    rows.sort(key=lambda row: -geometric_mean(v for cell, v in row.speeds.items() if cell[0] == scene))
    rows = rows[:most][::-1]
    size = (3 * len(kinds) + 4, 0.28 * len(rows) + 1.5)
    figure, axes = plt.subplots(1, len(kinds), sharey=True, figsize=size, squeeze=False)
    for axis, kind in zip(axes[0], kinds):
        colors = ["tab:blue" if row.axes["tests"] == "accurate" else "tab:orange" for row in rows]
        axis.barh([row.name() for row in rows], [row.speeds.get((scene, kind), 0) for row in rows], color=colors)
        axis.set_title(kind)
        axis.set_xlabel("Mrays/s")
        axis.tick_params(axis="y", labelsize=7)
    figure.suptitle(f"{scene} (blue: accurate, orange: fast)")
    save(figure, folder, f"variants_{scene}")
    plt.close(figure)


def plot_accuracy(plt, runs, folder):
    """Bars: how much faster the fast tests are."""
    pairs = sorted((accurate.name(), ratio) for accurate, _, ratio in paired_means(runs, "tests", "accurate", "fast"))
    if not pairs:
        return
    figure, axis = plt.subplots(figsize=(8, 0.28 * len(pairs) + 1.5))
    axis.barh([name for name, _ in pairs], [ratio for _, ratio in pairs])
    axis.axvline(1.0, color="black", linewidth=0.8)
    axis.set_xlabel("speed of fast tests relative to accurate ones (geometric mean)")
    axis.tick_params(axis="y", labelsize=7)
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


def plot_all(runs, folder, most):
    try:
        import matplotlib
    except ImportError:
        print("plot_variants.py: no plots: no matplotlib here (tools/install-packages test)", file=sys.stderr)
        return
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    for scene in runs.scenes():
        plot_scene(plt, runs, scene, folder, most)
    plot_accuracy(plt, runs, folder)
    if runs.scenes():
        plot_memory(plt, runs, folder)


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    parser = argparse.ArgumentParser(
        description="Writes variants.md (comparison with the peers, cost of accuracy and of features) and plots (PNG and "
        "SVG; left out where matplotlib is missing) from JSON of bench_variants. Exit status 1 if a file cannot be read.")
    parser.add_argument("json", nargs="+", help="files of bench_variants --json")
    parser.add_argument("--output", default=".", help="folder for what is written (.)")
    parser.add_argument("--peers", default=os.path.join(here, "peers", "h200.json"), help="the peers' figures (h200.json)")
    parser.add_argument("--most", type=int, default=30, help="variants in the plot of a scene, the best ones (30)")
    arguments = parser.parse_args()
    try:
        runs, peers = Runs(arguments.json), Peers(arguments.peers)
    except (OSError, ValueError, KeyError) as error:
        print(f"plot_variants.py: {error}", file=sys.stderr)
        return 1
    os.makedirs(arguments.output, exist_ok=True)
    with open(os.path.join(arguments.output, "variants.md"), "w", encoding="utf-8") as file:
        file.write(summary(runs, peers))
    plot_all(runs, arguments.output, arguments.most)
    return 0


if __name__ == "__main__":
    sys.exit(main())
