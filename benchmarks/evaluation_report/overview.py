"""The chart of all scenes: averaged figures relative to one builder."""

from variant_report.runs import geometric_mean

from . import numbers
from .charts import OPACITY, charts, draw_hierarchy_legend, series
from .runs import HIERARCHIES, YARDSTICK
from .svg import Picture, Scale

# The name of its files, where those of scenes have the scene's name.
ALL = "all"
LEFT, PANEL, BAR, TOP = 120, 190, 12, 52


def figures(evaluation):
    """@return (name, figure of a scene's entry) of all figures that are averaged."""
    found = [("build time", lambda scene, e: e.build_seconds), ("SAH cost", lambda scene, e: e.sah_cost),
             ("bytes", lambda scene, e: e.bytes or None)]
    for kind in evaluation.scenes[0].kinds():
        found.append((kind, lambda scene, e, kind=kind: scene.seconds(e, kind) if kind in scene.kinds() else None))
    return [*found, ("one sample", lambda scene, e: e.sample_seconds())]


def ratios(evaluation, hierarchy, key, figure):
    """@return a builder's figure relative to the yardstick's, for each scene where both were measured."""
    found = []
    for scene in evaluation.scenes:
        entry, base = scene.entry(hierarchy, key[1], key[0]), scene.entry(hierarchy, YARDSTICK)
        values = [figure(scene, e) if e else None for e in (entry, base)]
        if None not in values:
            found.append(values[0] / values[1])
    return found


def averages(evaluation, figure):
    """@return (hierarchy, key) -> the geometric mean over the scenes."""
    found = {}
    for hierarchy in evaluation.hierarchies():
        for key in evaluation.names():
            values = ratios(evaluation, hierarchy, key, figure)
            if values:
                found[(hierarchy, key)] = geometric_mean(values)
    return found


def normalised_bars(evaluation):
    """Draws a panel per figure, a row per builder and a bar per hierarchy. @return None without the yardstick."""
    panels = [(name, averages(evaluation, figure)) for name, figure in figures(evaluation) if name != "bytes"]
    panels = [(name, values) for name, values in panels if values]
    if not panels:
        return None
    shown = {place for _, values in panels for place in values}
    hierarchies = [hierarchy for hierarchy in HIERARCHIES if any(place[0] == hierarchy for place in shown)]
    entries = {entry.key(): entry for scene in evaluation.scenes for entry in scene.entries}
    rows = [entries[key] for key in evaluation.names() if any(place[1] == key for place in shown)]
    row = BAR * len(hierarchies) + 8
    picture = Picture(LEFT + PANEL * len(panels), TOP + row * len(rows) + 8,
                      f"Averages over the scenes, relative to {YARDSTICK}")
    draw_hierarchy_legend(picture, hierarchies)
    for i, entry in enumerate(rows):
        picture.text(LEFT - 8, TOP + row * i + (row - 8) / 2 + 4, entry.name(), "", "end")
    for p, (name, values) in enumerate(panels):
        scale = Scale(0, max(values.values()), LEFT + PANEL * p, LEFT + PANEL * (p + 1) - 50, False)
        picture.text(scale.start, 42, name, "head")
        for (hierarchy, key), value in values.items():
            entry = entries[key]
            y = TOP + row * rows.index(entry) + BAR * hierarchies.index(hierarchy)
            words = f"{entry.name()}, {HIERARCHIES[hierarchy]}, {name}: {numbers.significant(value)} x {YARDSTICK}"
            picture.bar(scale.start, y, scale.place(value) - scale.start, BAR - 2, series(entry), OPACITY[hierarchy],
                        words)
            picture.text(scale.place(value) + 5, y + BAR - 3, numbers.significant(value), "small")
    return picture


def all_charts(evaluation):
    """@return the charts of all scenes together (ALL) and of each scene, by name: lists of (name of the file, caption,
    picture)."""
    found = {ALL: []}
    picture = normalised_bars(evaluation)
    if picture:
        found[ALL].append(("normalised", f"All scenes: relative to {YARDSTICK} of the same hierarchy (geometric means, "
                                         "less is better).", picture))
    for scene in evaluation.scenes:
        found[scene.name] = charts(scene)
    note = evaluation.device_note()
    for pictures in found.values():
        for i, (name, caption, picture) in enumerate(pictures):
            picture.title += note
            pictures[i] = (name, caption + (" The GPU has no RT cores." if note else ""), picture)
    return found
