"""Tables with a column per scene. The variants differ in tree, tests and features; all other axes are usual."""

from .markdown import number, per_query, table
from .runs import ALL_HITS, ROW_AXES, geometric_mean

# The value of an axis that a table does not vary (hiprt_default_* of cmake/HiprtBenchVariants.cmake).
USUAL = {"stack": "private", "order": "usual", "blocks": "64x14", "answers": "id"}
# The tables show the first of these that was measured.
USUAL_SCHEDULES = ["batch12", "batch16"]
USUAL_FEATURES = "masks"
TESTS = ["accurate", "fast"]
FEATURES = ["triangles", "splits", "masks", "filter", "custom", "custom-filter"]
MISSING = "Not measured.\n"


def scene_columns(ratios, scenes, cells):
    """@return geometric means over the kinds of rays of each scene, and over all cells; empty unless all are there."""
    columns = []
    for wanted in [[cell for cell in sorted(cells) if cell[0] == scene] for scene in scenes] + [sorted(cells)]:
        complete = all(cell in ratios for cell in wanted)
        columns.append(number(geometric_mean(ratios[cell] for cell in wanted if complete), 3))
    return columns


def usual_row(runs, tree, tests=TESTS[0], features=USUAL_FEATURES):
    """@return None if it was not measured."""
    axes = {**USUAL, "tests": tests, "features": features}
    found = [row for row in runs.rows.values()
             if row.axes["tree"] == tree and all(row.axes[axis] == value for axis, value in axes.items())]
    by_schedule = {row.axes["schedule"]: row for row in found}
    return next((by_schedule[schedule] for schedule in USUAL_SCHEDULES if schedule in by_schedule), None)


def one_hit_cells(runs):
    """@return the cells without queries for all hits, because only few variants are measured with these."""
    return {cell for cell in runs.cells() if not cell[1].endswith(ALL_HITS)}


def tree_names(runs):
    return sorted({row.axes["tree"] for row in runs.rows.values()})


def against_text(runs, name, reference):
    cells = [cell for cell in one_hit_cells(runs) if cell in reference]
    scenes = sorted({scene for scene, _ in cells})
    rows = []
    for tree in tree_names(runs):
        for row in filter(None, (usual_row(runs, tree, tests) for tests in TESTS)):
            ratios = row.ratios(reference)
            if not ratios:
                continue
            (scene, kind), lowest = min(ratios.items(), key=lambda item: item[1])
            name_of_row = f"{tree} {row.axes['tests']}"
            rows.append([name_of_row, *scene_columns(ratios, scenes, cells), f"{lowest:.3f} ({scene} {kind})"])
    return table([f"x {name}", *scenes, "all cells", "lowest cell"], rows) if rows else MISSING


def bytes_text(runs):
    """How each tree was built, and how large it is."""
    scenes = runs.scenes()
    rows = []
    for name in tree_names(runs):
        trees = {scene: tree for (scene, tree_name), tree in runs.trees.items() if tree_name == name}
        facts = ["/".join(sorted({str(tree[key]) for tree in trees.values()}))
                 for key in ["layout", "builder", "split_budget"]]
        sizes = [number(trees[scene]["bytes_per_triangle"], 1) if scene in trees else "" for scene in scenes]
        rows.append([name, *facts, *sizes])
    return table(["bytes per triangle", "layout", "builder", "split budget", *scenes], rows) if rows else MISSING


def fast_text(runs):
    """The cost of the accurate tests."""
    rows = []
    for tree in tree_names(runs):
        accurate, fast = (usual_row(runs, tree, tests) for tests in TESTS)
        if accurate and fast:
            registers = [per_query(accurate.registers), per_query(fast.registers)]
            columns = scene_columns(fast.ratios(accurate.speeds), runs.scenes(), one_hit_cells(runs))
            rows.append([tree, *columns, *registers])
    return table(["fast x accurate", *runs.scenes(), "all cells", "registers", "of fast"], rows) if rows else MISSING


def features_text(runs):
    """The cost of compiled features that a scene does not use."""
    rows = []
    for tree in tree_names(runs):
        base = usual_row(runs, tree)
        for features in FEATURES if base else ():
            row = usual_row(runs, tree, features=features)
            if row:
                columns = scene_columns(row.ratios(base.speeds), runs.scenes(), one_hit_cells(runs))
                rows.append([f"{tree} {features}", *columns, per_query(row.registers), per_query(row.local_bytes)])
    head = [f"features x {USUAL_FEATURES}", *runs.scenes(), "all cells", "registers", "local bytes"]
    return table(head, rows) if rows else MISSING


def by_scene_text(runs, peers):
    tables = [against_text(runs, name, peers.references[name]) for name in peers.references if name != "best peer"]
    tables = [text for text in [*tables, bytes_text(runs), fast_text(runs), features_text(runs)] if text != MISSING]
    measured = {row.axes["schedule"] for row in runs.rows.values()}
    schedule = next((schedule for schedule in USUAL_SCHEDULES if schedule in measured), USUAL_SCHEDULES[0])
    axes = {**USUAL, "schedule": schedule}
    usual = ", ".join(f"{axis} {axes[axis]}" for axis in ROW_AXES if axis in axes and axis != "answers")
    text = f"Features {USUAL_FEATURES}, unless a row says otherwise; {usual}. "
    text += "Relative speeds are geometric means over\n"
    text += "the kinds of rays of a scene, and over all cells; there is none where a cell was not measured.\n\n"
    return text + ("\n".join(tables) or MISSING)
