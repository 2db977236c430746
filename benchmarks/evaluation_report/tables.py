"""The tables of the page."""

import html
import math

from variant_report.runs import geometric_mean

from . import numbers
from .curves import FAST, SLOW, crossovers
from .overview import figures, ratios
from .runs import DISAGREEMENTS, HIERARCHIES, YARDSTICK


class Cell:
    """A cell of a table. strong: the best value of its column. hint: the tooltip."""

    def __init__(self, words, strong=False, hint=""):
        self.words, self.strong, self.hint = words, strong, hint

    def html(self, kind):
        words = html.escape(str(self.words))
        hint = f' title="{html.escape(self.hint)}"' if self.hint else ""
        return f"<{kind}{hint}>{f'<strong>{words}</strong>' if self.strong else words}</{kind}>"


def as_cell(value):
    return value if isinstance(value, Cell) else Cell(value)


def table(caption, head, rows, command=None):
    """rows: lists of words or cells; the first is the row's heading. A row of one cell is a heading of the rows below.
    command: repeats the measurement."""
    text = "<thead><tr>" + "".join(as_cell(cell).html("th") for cell in head) + "</tr></thead><tbody>"
    for row in rows:
        if len(row) == 1:
            text += f'<tr class="part"><th colspan="{len(head)}">{html.escape(str(row[0]))}</th></tr>'
            continue
        text += "<tr>" + as_cell(row[0]).html("th") + "".join(as_cell(cell).html("td") for cell in row[1:]) + "</tr>"
    beside = f'<p class="command"><code>{html.escape(command)}</code></p>' if command else ""
    return (f'<figure class="table"><figcaption>{html.escape(caption)}</figcaption>'
            f'<div class="scroll"><table>{text}</tbody></table></div>{beside}</figure>')


def overview(evaluation):
    """@return geometric means over the scenes; empty without the yardstick."""
    columns = figures(evaluation)
    rows = []
    for hierarchy in evaluation.hierarchies():
        scenes = [scene for scene in evaluation.scenes if scene.entry(hierarchy, YARDSTICK)]
        if not scenes:
            continue
        rows.append([f"{HIERARCHIES[hierarchy]}: {', '.join(scene.name for scene in scenes)}"])
        for key, name in evaluation.names().items():
            if any(scene.entry(hierarchy, key[1], key[0]) for scene in scenes):
                means = [geometric_mean(ratios(evaluation, hierarchy, key, figure)) for _, figure in columns]
                rows.append([name, *(numbers.significant(mean) for mean in means)])
    if not rows:
        return ""
    return table(f"Times, cost and size relative to {YARDSTICK} of the same hierarchy: "
                 f"geometric means over scenes, less is better{evaluation.device_note()}",
                 ["", *(name for name, _ in columns)], rows, evaluation.command)


def best(entries, figure):
    values = [value for value in map(figure, entries) if value is not None]
    return min(values) if values else None


def builders(evaluation, scene):
    kinds = scene.kinds()
    head = ["builder", "build", "of it instances", "SAH cost", "MB",
            *(f"{kind}, ms per wave (Mrays/s)" for kind in kinds), "one sample, ms", "differing rays"]
    rows = []
    for hierarchy in HIERARCHIES:
        entries = scene.of_hierarchy(hierarchy)
        if not entries:
            continue
        facts = scene.hierarchies[hierarchy]
        instances = (f", {numbers.count(facts['instances'])} instance{'s'[:facts['instances'] != 1]}"
                     if facts["instances"] else "")
        rows.append([f"{HIERARCHIES[hierarchy]}: {numbers.count(facts['triangles'])} triangles{instances}"])
        bounds = {figure: best(entries, figure) for figure in
                  [lambda e: e.build_seconds, lambda e: e.sah_cost, lambda e: e.sample_seconds()]}
        rows += [builder_row(scene, entry, kinds, entries, list(bounds.values())) for entry in entries]
    caption = f"Builders: medians; the best of each hierarchy is bold{evaluation.device_note()}"
    return table(caption, head, rows, evaluation.command_of(scene))


def builder_row(scene, entry, kinds, entries, bounds):
    fastest, cheapest, quickest = bounds
    cells = [entry.name(), Cell(numbers.seconds(entry.build_seconds), entry.build_seconds == fastest),
             numbers.seconds(entry.instance_seconds) if entry.instance_seconds else "",
             Cell(numbers.significant(entry.sah_cost), entry.sah_cost is not None and entry.sah_cost == cheapest),
             numbers.megabytes(entry.bytes)]
    for kind in kinds:
        value = scene.wave_seconds(entry, kind)
        words = f"{numbers.significant(1e3 * value)} ({numbers.significant(scene.mrays_s(entry, kind))})"
        cells.append(Cell(words, value == best(entries, lambda e: scene.wave_seconds(e, kind))))
    cells.append(Cell(numbers.significant(1e3 * entry.sample_seconds()), entry.sample_seconds() == quickest))
    cells.append(Cell(str(entry.differing), False, f"of {scene.rays()} rays; to the last bit: {entry.inexact}"))
    return cells


def crossover_table(evaluation, scene):
    modes = list({entry.key(): entry.name() for h in HIERARCHIES for entry in scene.vulkan(h)}.items())
    columns = [("hiprt", fast) for fast in FAST] + [key for key, _ in modes]
    rows, names = [], evaluation.names()
    for hierarchy in HIERARCHIES:
        found = {(slow.builder, fast.key()): crossover for slow, fast, crossover in crossovers(scene, hierarchy)}
        part = [[names[("hiprt", slow)], *(crossover_words(found.get((slow, key))) for key in columns)]
                for slow in SLOW + FAST if any((slow, key) in found for key in columns)]
        if part:
            rows += [[HIERARCHIES[hierarchy]], *part]
    if not rows:
        return ""
    return table("Crossover: samples per pixel from which the builder of the row has the image first "
                 f"(quartiles of the rounds){evaluation.device_note()}",
                 ["against", *FAST, *(name for _, name in modes)], rows, evaluation.command_of(scene))


def crossover_words(found):
    """@return the crossover, with its range if there is one. Empty if it was not measured."""
    if found is None:
        return ""
    samples, least, most = found
    if not math.isfinite(samples) or samples == 0 or not math.isfinite(least):
        return numbers.samples(samples)
    return f"{numbers.samples(samples)} ({numbers.samples(least)} to {numbers.samples(most)})"


def levels_price(evaluation, scene):
    """The cost of levels of instances."""
    kinds, rows = scene.kinds(), []
    for hierarchy in ["two_level", "deep"]:
        pairs = [(entry, scene.entry("flat", entry.builder, entry.tracer)) for entry in scene.of_hierarchy(hierarchy)]
        pairs = [(entry, flat) for entry, flat in pairs if flat]
        if pairs:
            rows.append([HIERARCHIES[hierarchy]])
        for entry, flat in pairs:
            traced = [numbers.significant(scene.seconds(entry, kind) / scene.seconds(flat, kind)) for kind in kinds]
            whole = entry.sample_seconds() / flat.sample_seconds()
            rows.append([entry.name(), numbers.significant(entry.build_seconds / flat.build_seconds),
                         numbers.significant(entry.bytes / flat.bytes) if flat.bytes else "", *traced,
                         numbers.significant(whole)])
    if not rows:
        return ""
    return table("Instances relative to the flat tree of the same builder",
                 ["", "build time", "bytes", *kinds, "one sample"], rows, evaluation.command_of(scene))


def disagreements(evaluation, scene):
    """How Vulkan's hits differ from ours; empty without Vulkan."""
    rows = [[f"{entry.name()}, {HIERARCHIES[entry.hierarchy]}", *(entry.disagreements[kind] for kind in DISAGREEMENTS)]
            for entry in scene.entries if entry.disagreements]
    if not rows:
        return ""
    rays = f"{scene.rays():,}".replace(",", "\u202f")
    return table(f"Hits unlike ours, of {rays} rays: each ray counts once, in the first column that applies",
                 ["", *DISAGREEMENTS.values()], rows, evaluation.command_of(scene))


def waves(evaluation, scene):
    rows = [[name, wave["kind"], f"{wave['rays']:,}".replace(",", "\u202f"), f"{100 * wave['hits'] / wave['rays']:.1f}"]
            for name, wave in scene.waves.items()]
    return table(f"Waves of one sample: rays (light: {scene.light})", ["wave", "kind", "rays", "hits %"], rows,
                 evaluation.command_of(scene))
