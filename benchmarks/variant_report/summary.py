"""The summary in Markdown."""

import os

from .by_scene import FEATURES, MISSING, by_scene_text, scene_columns
from .markdown import number, per_query, table
from .runs import ANY_KINDS, geometric_mean, paired_ratios


def provenance_text(runs):
    text = ""
    for path, data in runs.files:
        device = data["device"]
        text += (f"- `{os.path.basename(path)}`: {device['name']}, commit {data['commit']}, {data['date']}, "
                 f"`{data['command']}`\n")
        for key in ["driver", "runtime_version", "compute_units", "timed"]:
            if device.get(key):
                text += f"  - {key.replace('_', ' ')}: {device[key]}\n"
    if runs.spread:
        spread = sorted(runs.spread)
        text += f"- (slowest - fastest) / median of the repetitions: median {spread[len(spread) // 2]:.1%}, "
        text += f"worst {spread[-1]:.1%}\n"
    return text + "".join(f"- **wrong result**: {fault}\n" for fault in runs.faults)


def ranking_text(runs, peers):
    """Compares every variant with the peers, the best first."""
    ranked = []
    yardstick = peers.yardstick(runs)
    speeds = peers.references[yardstick]
    kinds = [kind for kind in runs.kinds() if any(cell[1] == kind for cell in speeds)]
    for row in runs.rows.values():
        ratios = row.ratios(speeds)
        if not ratios:
            continue
        means = [geometric_mean(row.ratios(reference).values()) for reference in peers.references.values()]
        by_kind = [geometric_mean(row.ratios(speeds, {kind}).values()) for kind in kinds]
        ranked.append((len(ratios), geometric_mean(ratios.values()), means, by_kind, row))
    ranked.sort(key=lambda entry: (-entry[0], -entry[1]))
    if not ranked:
        return "None of the peers' scenes was measured.\n"
    head = ["variant", "cells"] + [f"x {name}" for name in peers.references]
    head += [f"{kind} x {yardstick}" for kind in kinds]
    rows = [[row.name(), cells] + [number(mean, 3) for mean in means + by_kind]
            for cells, _, means, by_kind, row in ranked]
    return table(head, rows)


def best_row(runs, peers, kinds):
    """The accurate variant with the best geometric mean over the cells of these kinds."""
    best, best_key = None, (0, 0.0)
    for row in runs.rows.values():
        ratios = row.ratios(peers.references[peers.yardstick(runs)], kinds)
        if row.axes["tests"] != "accurate" or not ratios:
            continue
        key = (len(ratios), geometric_mean(ratios.values()))
        if key > best_key:
            best, best_key = row, key
    return best


def cells_text(runs, peers):
    """Per cell: the speed of one choice per query, and the best variant."""
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
    """Speeds and ratios, and the geometric means over all cells that the peers have, too."""
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
    shared = sum(cell in peers.references["best peer"] for cell in speeds)
    if shared:
        rows.append([f"**geometric mean of {shared} cells**", ""] + [f"**{number(mean)}**" for mean in means])
    return table(["cell", "Mrays/s"] + [f"x {name}" for name in peers.references], rows)


def accuracy_text(runs):
    text = "The speed of `Fast` and `Plain` relative to `Watertight` and `Conservative`, all else the same: above 1, "
    text += "accuracy\n"
    text += "costs. Geometric means over the kinds of rays of a scene, and over all cells that were measured.\n\n"
    rows = [[accurate.name(), per_query(accurate.registers), per_query(fast.registers),
             *scene_columns(ratios, runs.scenes(), ratios)]
            for accurate, fast, ratios in paired_ratios(runs, "tests", "accurate", "fast")]
    head = ["accurate variant", "registers", "of fast", *runs.scenes(), "all cells"]
    return text + table(head, rows) if rows else MISSING


def features_text(runs):
    """Compares each set of features with the smallest one that was measured with the same other choices."""
    rows, seen = [], set()
    for i, base in enumerate(FEATURES):
        for other in FEATURES[i + 1:]:
            for row, partner, ratios in paired_ratios(runs, "features", base, other):
                if partner.key in seen:
                    continue
                seen.add(partner.key)
                mean = number(geometric_mean(ratios.values()), 3)
                rows.append([partner.name(), base, per_query(row.registers), per_query(partner.registers), mean])
    head = ["variant", "against", "registers there", "registers", "speed x"]
    return table(head, rows) if rows else MISSING


def answers_text(runs):
    text = "The speed of kernels that read `Ray` and write `Hit`, relative to 32 bytes per ray and 8 per result.\n\n"
    rows = [[by_id.name(), per_query(by_id.registers), per_query(whole.registers),
             *scene_columns(ratios, runs.scenes(), ratios)]
            for by_id, whole, ratios in paired_ratios(runs, "answers", "id", "hit")]
    head = ["variant", "registers", "of whole hits", *runs.scenes(), "all cells"]
    return f"\n## What whole hits cost\n\n{text}{table(head, rows)}" if rows else ""


def summary(runs, peers):
    text = "# Variants of the traversal\n\n" + provenance_text(runs)
    text += f"\n## By scene\n\n{by_scene_text(runs, peers)}"
    text += f"\n## Against {peers.gpu} peers\n\n{ranking_text(runs, peers)}\n## By cell\n\n{cells_text(runs, peers)}"
    text += f"\n## What accuracy costs\n\n{accuracy_text(runs)}\n## What features cost\n\n{features_text(runs)}"
    text += answers_text(runs)
    text += "\n## Peers\n\n" + peers.method + "\n\n"
    return text + "".join(f"- {peer['name']}: {peer['source']}\n" for peer in peers.peers)
