"""The tables of all scenes as Markdown, for pages."""

import math

from variant_report.runs import geometric_mean

from . import numbers
from .curves import crossovers
from .overview import figures, ratios
from .runs import DISAGREEMENTS, HIERARCHIES, YARDSTICK

# The builders of the tables that compare a fast and a good tree of ours with Vulkan.
FAST, GOOD = "hploc", "hq"
# More waves than this follow paths over bounces. Then each wave is a row.
MOST_WAVES = 8


def table(title, head, rows):
    """The first column is words, the others are numbers. @return nothing without rows."""
    if not rows:
        return ""
    lines = [f"| {' | '.join(head)} |", "|---|" + "---:|" * (len(head) - 1)]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join([f"### {title}", "", *lines, ""])


def plain(value, digits=3):
    """As in pages: thousands have a comma."""
    words = numbers.significant(value, digits).replace("\u202f", ",")
    return words[:-1] if words == "1." + digits * "0" else words  # 0.9996 is 1.00, not 1.000.


def titled(evaluation, words):
    return words + evaluation.device_note()


def averages(evaluation, hierarchy):
    columns = [(name, figure) for name, figure in figures(evaluation) if name != "bytes"]
    scenes = [scene for scene in evaluation.scenes if scene.entry(hierarchy, YARDSTICK)]
    rows = []
    for key, name in evaluation.names().items():
        if any(scene.entry(hierarchy, key[1], key[0]) for scene in scenes):
            values = [ratios(evaluation, hierarchy, key, figure) for _, figure in columns]
            rows.append([name, *(plain(geometric_mean(found)) if found else "" for found in values)])
    count = f"{len(scenes)} scene{'s'[:len(scenes) != 1]}"
    return table(titled(evaluation, f"{HIERARCHIES[hierarchy]}, {count}, relative to {YARDSTICK}"),
                 ["", *(name for name, _ in columns)], rows)


def samples(evaluation, hierarchy):
    """Milliseconds of one sample. The last columns: the slower tracers' times relative to the good tree's."""
    names, rows, products = evaluation.names(), [], {}
    for scene in evaluation.scenes:
        if not scene.of_hierarchy(hierarchy):
            continue
        entries = {key: scene.entry(hierarchy, key[1], key[0]) for key in names}
        row = [scene.name, *(plain(1e3 * entry.sample_seconds()) if entry else "" for entry in entries.values())]
        good = scene.entry(hierarchy, GOOD)
        for entry in scene.vulkan(hierarchy) if good else []:
            ratio = entry.sample_seconds() / good.sample_seconds()
            products.setdefault(entry.key(), []).append(ratio)
            row.append(plain(ratio))
        rows.append(row)
    ends = [f"{names[key]} / {GOOD}" for key in products]
    if products:
        rows.append(["geometric mean", *[""] * len(names), *(plain(geometric_mean(v)) for v in products.values())])
    return table(titled(evaluation, f"{HIERARCHIES[hierarchy]}: milliseconds per sample"),
                 ["", *names.values(), *ends], rows)


def builds(evaluation, hierarchy):
    """Milliseconds of a build; of it the tree over instances."""
    names, rows = evaluation.names(), []
    for scene in evaluation.scenes:
        if not scene.of_hierarchy(hierarchy):
            continue
        row = [f"{scene.name}: {scene.hierarchies.get(hierarchy, {}).get('instances', 0)} instances"]
        for key in names:
            entry = scene.entry(hierarchy, key[1], key[0])
            words = ""
            if entry:
                words = plain(1e3 * entry.build_seconds)
                if entry.instance_seconds:
                    words += f" ({plain(1e3 * entry.instance_seconds)})"
            row.append(words)
        rows.append(row)
    return table(titled(evaluation, f"{HIERARCHIES[hierarchy]}: milliseconds of a build (of it, instances)"),
                 ["", *names.values()], rows)


def crossover_words(value):
    if math.isnan(value):
        return "at first only"
    if math.isinf(value):
        return "never"
    return "start" if value == 0 else str(math.ceil(value))


def first_images(evaluation, hierarchy):
    columns = [(builder, mode) for builder in (FAST, GOOD) for mode in evaluation.names() if mode[0] == "vulkan"]
    rows = []
    for scene in evaluation.scenes:
        found = {(slow.key(), fast.key()): value[0] for slow, fast, value in crossovers(scene, hierarchy)}
        keys = [(("hiprt", builder), mode) for builder, mode in columns]
        if any(key in found for key in keys):
            rows.append([scene.name, *(crossover_words(found[key]) if key in found else "" for key in keys)])
    return table(titled(evaluation, f"{HIERARCHIES[hierarchy]}: samples per pixel until our image is there first"),
                 ["", *(f"{builder}, {evaluation.names()[mode]}" for builder, mode in columns)], rows)


def bounces(evaluation):
    parts = []
    for scene in evaluation.scenes:
        if len(scene.waves) <= MOST_WAVES:
            continue
        for hierarchy in evaluation.hierarchies():
            entries = scene.of_hierarchy(hierarchy)
            rows = [[name, *(plain(1e9 * entry.waves[name] / wave["rays"]) for entry in entries)]
                    for name, wave in scene.waves.items()]
            parts.append(table(titled(evaluation, f"{scene.name}, {HIERARCHIES[hierarchy]}: nanoseconds per ray"),
                               ["", *(entry.name() for entry in entries)], rows))
    return "\n".join(parts)


def disagreements(evaluation):
    rows = []
    for hierarchy in evaluation.hierarchies():
        for key, name in evaluation.names().items():
            pairs = [(scene, scene.entry(hierarchy, key[1], key[0])) for scene in evaluation.scenes]
            pairs = [(scene, entry) for scene, entry in pairs if entry and entry.disagreements]
            if pairs:
                rays = sum(scene.rays() for scene, _ in pairs)
                counts = [sum(entry.disagreements[kind] for _, entry in pairs) for kind in DISAGREEMENTS]
                rows.append([f"{name}, {HIERARCHIES[hierarchy]}", f"{1e-6 * rays:.1f}", *counts])
    return table(titled(evaluation, "Hits unlike ours"), ["", "10⁶ rays", *DISAGREEMENTS.values()], rows)


def markdown(evaluation):
    """@return all tables."""
    parts = [f"{evaluation.device_name}, {evaluation.date}, {evaluation.commit}\n\n    {evaluation.command}\n"]
    for hierarchy in evaluation.hierarchies():
        parts += [part(evaluation, hierarchy) for part in (averages, samples, builds, first_images)]
    parts += [bounces(evaluation), disagreements(evaluation)]
    return "\n".join(part for part in parts if part)
