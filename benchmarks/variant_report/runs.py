"""What bench_variants and the peers measured."""

import json
import math

KINDS = ["primary", "ao", "shadow", "diffuse", "diffuse2"]
ANY_KINDS = {"ao", "shadow"}
ROW_AXES = ["layout", "tests", "stack", "schedule", "order", "features", "blocks"]


def geometric_mean(values):
    values = list(values)
    return math.exp(sum(map(math.log, values)) / len(values)) if values else float("nan")


def usual_order(result):
    """Closest and any hits of a variant share a row when each has its default order."""
    usual = "stored" if result["query"] == "any" else "sorted"
    return "usual" if result["order"] == usual else result["order"]


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
        cell = (result["scene"], result["kind"])
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
