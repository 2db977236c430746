"""Results of bench_variants and of other libraries."""

import math

from .json_file import load
from .ray_cores import without_ray_cores

KINDS = ["primary", "ao", "shadow", "diffuse", "diffuse2"]
ANY_KINDS = {"ao", "shadow"}
# The group of peers that bench_variants measures beside its variants.
VULKAN = "vulkan"
# Behind the kind of rays whose query is for all hits.
ALL_HITS = " all"
ROW_AXES = ["layout", "tests", "stack", "schedule", "order", "features", "blocks", "answers"]
# Of runs that have no such key; names of rows leave it out.
USUAL_ANSWERS = "id"


def geometric_mean(values):
    values = list(values)
    return math.exp(sum(map(math.log, values)) / len(values)) if values else float("nan")


def usual_order(result):
    """The queries of a variant share a row when each has the library's order for it (variant.h: has_usual_order())."""
    any_order = result["query"] == "any" or (result["query"] == "all" and result["features"] == "triangles")
    usual = "stored" if any_order else "sorted"
    return "usual" if result["order"] in (usual, "tested") else result["order"]


def kind_of(result):
    """Queries for all hits use the rays of closest hits."""
    return result["kind"] + (ALL_HITS if result["query"] == "all" else "")


def recorded(provenance, *keys):
    """@return the value, in the provenance of any tool, or an empty text."""
    for key in keys:
        provenance = provenance.get(key, "") if isinstance(provenance, dict) else ""
    return provenance if isinstance(provenance, (str, int, float)) else ""


def read_tree(part):
    tree = {key: part.name(key) for key in ["scene", "tree", "layout"]}
    if "/" in tree["scene"]:
        raise part.member("scene").fault(f"{tree['scene']!r} cannot be part of a file's name")
    builder = recorded(part.member("provenance").value, "builder")
    # The other builders do not split.
    splits = builder in {"sbvh", "hq", "embree-high"}
    budget = recorded(part.value["provenance"], "options", "split_budget") if splits else ""
    return {**tree, "bytes_per_triangle": part.number("bytes_per_triangle"), "builder": builder, "split_budget": budget}


def read_result(part, trees):
    """None if the variant failed or has wrong results: it has no speed."""
    if part.number("repetitions") == 0 or part.text("problem") or part.number("overflowed_rays"):
        return None
    result = {key: part.name(key) for key in ["scene", "tree", "kind", "query", *ROW_AXES[:-1]]}
    result["answers"] = part.name("answers") if "answers" in part.value else USUAL_ANSWERS
    result |= {key: part.number(key) for key in ["registers", "local_bytes", "min_ms", "max_ms"]}
    result |= {key: part.number(key, positive=True) for key in ["mrays_s", "median_ms"]}
    if (result["scene"], result["tree"]) not in trees:
        raise part.fault(f"no entry of 'trees' has the scene {result['scene']!r} and the tree {result['tree']!r}")
    return result


class Row:
    """A variant over trees of one name: speeds by scene and kind."""

    def __init__(self, key):
        self.key = key
        self.axes = dict(zip(["tree"] + ROW_AXES, key))
        self.speeds = {}
        self.registers = {}
        self.local_bytes = {}
        self.bytes_per_triangle = {}

    def name(self):
        """Without the tree's name if it equals the layout."""
        key = self.key[1:] if self.axes["tree"] == self.axes["layout"] else self.key
        return " ".join(key[:-1] if self.axes["answers"] == USUAL_ANSWERS else key)

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
        file = load(path, "hiprt bench_variants 1", "bench_variants")
        for key in ["commit", "date", "command"]:
            file.text(key)
        file.member("device").name("name")
        self.files.append((path, file.value))
        self.faults += [fault.expect("text") for fault in file.members("faults")]
        trees = [read_tree(part) for part in file.members("trees")]
        trees = {(tree["scene"], tree["tree"]): tree for tree in trees}
        self.trees |= trees
        results = file.members("results")
        if not results:
            raise file.member("results").fault("nothing was measured")
        for result in results:
            self.add(read_result(result, trees))

    def add(self, result):
        if result is None:
            return
        values = [usual_order(result) if axis == "order" else result[axis] for axis in ROW_AXES]
        key = (result["tree"], *values)
        row = self.rows.setdefault(key, Row(key))
        cell = (result["scene"], kind_of(result))
        row.speeds[cell] = max(result["mrays_s"], row.speeds.get(cell, 0.0))
        row.registers[result["query"]] = result["registers"]
        row.local_bytes[result["query"]] = result["local_bytes"]
        tree = self.trees[(result["scene"], result["tree"])]
        row.bytes_per_triangle[result["scene"]] = tree["bytes_per_triangle"]
        self.spread.append((result["max_ms"] - result["min_ms"]) / result["median_ms"])

    def cells(self):
        return {cell for row in self.rows.values() for cell in row.speeds}

    def scenes(self):
        return sorted({scene for scene, _ in self.cells()})

    def kinds(self, scene=None):
        """Of one scene, or of all."""
        found = {kind for where, kind in self.cells() if scene in (None, where)}
        return [kind for kind in KINDS if kind in found] + sorted(found - set(KINDS))


class Peers:
    """Speeds of other libraries, by scene and kind."""

    def __init__(self, *paths):
        self.gpus, self.methods, self.peers = [], [], []
        for path in paths:
            self.read(path)
        self.gpu = " and ".join(dict.fromkeys(self.gpus))
        self.method = "\n\n".join(self.methods)
        self.references = {
            "best HIPRT": self.best({"hiprt"}),
            "OptiX": self.best({"optix"}),
            "best peer": self.best({peer["group"] for peer in self.peers}),
        }
        self.references |= self.vulkan()

    def read(self, path):
        file = load(path, "hiprt peers 1", "peers' figures")
        self.gpus.append(file.name("gpu"))
        self.methods.append(file.text("method"))
        for part in file.members("peers"):
            speeds = {(scene, kind): speeds.number(kind, positive=True)
                      for scene, speeds in part.member("mrays_s").items() for kind in speeds.expect("an object")}
            peer = {**{key: part.text(key) for key in ["name", "group", "source"]}, "speeds": speeds}
            if peer["group"] == VULKAN:
                peer["source"] += without_ray_cores(self.gpus[-1])
            self.peers.append(peer)

    def yardstick(self, runs):
        """@return the name of the first library that has a cell of the runs."""
        cells = runs.cells()
        found = [name for name, speeds in self.references.items() if name != "best peer" and cells & speeds.keys()]
        return found[0] if found else next(iter(self.references))

    def vulkan(self):
        """@return the speeds of Vulkan's modes, by name."""
        return {peer["name"]: peer["speeds"] for peer in self.peers if peer["group"] == VULKAN}

    def best(self, groups):
        cells = {}
        for peer in self.peers:
            for cell, speed in peer["speeds"].items() if peer["group"] in groups else ():
                cells[cell] = max(speed, cells.get(cell, 0))
        return cells


def paired_ratios(runs, axis, base, other):
    """Rows that differ in one axis only: (base row, other row, cell -> speed of other relative to base)."""
    place = (["tree"] + ROW_AXES).index(axis)
    for key, row in runs.rows.items():
        partner = runs.rows.get((*key[:place], other, *key[place + 1:]))
        if key[place] != base or partner is None:
            continue
        ratios = partner.ratios(row.speeds)
        if ratios:
            yield row, partner, ratios
