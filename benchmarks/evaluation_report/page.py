"""The report: one page without external files."""

import html

from . import tables
from .overview import ALL, all_charts
from .runs import HIERARCHIES
from .svg import STYLE, variables

CSS = """
:root { color-scheme: light dark; LIGHT }
@media (prefers-color-scheme: dark) { :root { DARK } }
* { box-sizing: border-box }
body { margin: 0; background: var(--paper); color: var(--ink); \
font: 15px/1.5 system-ui, -apple-system, "Segoe UI", sans-serif }
main, nav { max-width: 1200px; margin: 0 auto; padding: 0 24px }
nav { padding-top: 16px; display: flex; flex-wrap: wrap; gap: 4px 16px; font-size: 14px }
a { color: var(--link) }
h1 { font-size: 28px; line-height: 1.2; margin: 24px 0 8px }
h2 { font-size: 22px; margin: 48px 0 8px; padding-top: 16px; border-top: 2px solid var(--line) }
h3 { font-size: 16px; margin: 28px 0 0 }
p { max-width: 78ch; margin: 8px 0 }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 2px 16px; margin: 12px 0 }
dt { color: var(--soft) }
dd { margin: 0; overflow-wrap: anywhere }
code { font: 12px ui-monospace, "SF Mono", Menlo, monospace; overflow-wrap: anywhere }
figure { margin: 16px 0; min-width: 0 }
figcaption { font-weight: 600; margin-bottom: 6px }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 480px), 1fr)); gap: 0 32px }
.charts .wide { grid-column: 1 / -1 }
svg { display: block; width: 100%; height: auto }
.scroll { overflow-x: auto }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums }
th, td { padding: 4px 10px; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap }
thead th { vertical-align: bottom; white-space: normal; color: var(--soft); font-weight: 600 }
tbody th, thead th:first-child { text-align: left; font-weight: 500 }
.part th { background: var(--shade); font-weight: 600 }
tbody tr:hover td, tbody tr:hover th { background: var(--shade) }
.command { margin: 4px 0 0; color: var(--soft); max-width: none }
.faults { border-left: 4px solid #c62828; padding: 4px 16px }
ul { padding-left: 20px }
@media print { nav { display: none } figure { break-inside: avoid } }
"""

METHOD = """<p>The rays are one sample per pixel of a path tracer, wave by wave: primary rays; \
from every hit a shadow ray to
the scene's light (or into the sky) and a diffuse ray, which is the next bounce (secondary rays). Each wave is traced
separately. <em>flat</em>: all instances transformed, in one BVH. <em>two-level</em>: \
one BVH over instances of objects; a
scene without instances becomes one instance. <em>deep</em>: the scene's nested groups. \
All competitors build and trace in
turn; figures are medians over the rounds.</p>"""
CPU_METHOD = """<p>Times are those of all threads together. \
Both libraries trace ray by ray (rtcIntersect1, rtcOccluded1).
Embree's build time is that of rtcCommitScene. SAH cost: one cost function for all flat BVHs of hiprt (bvhinfo).</p>"""
VULKAN_METHOD = """<p>Vulkan traces the same rays in the same order. Its build time is that of \
vkCmdBuildAccelerationStructuresKHR, without
compaction, from timestamp queries; the rays trace the compacted structures. <em>flat</em> is one instance of one \
object. Vulkan builds
instances on its device. A device without ray tracing cores traces by the driver's own shaders.</p>"""
GPU_METHOD = """<p>Build times are the GPU's, from meshes on the device to a BVH on the device, \
without copies and allocations. They
include BVHs over instances, which the CPU builds. Trace times are the kernels'. \
SAH cost: one cost function for all flat
BVHs.</p>"""
CPU_BUILD_METHOD = """<p><em>(CPU)</em>: the CPU builds the tree by all its threads, from meshes in its memory to a \
file. The build time has no
copy to the GPU.</p>"""


def facts(evaluation):
    entries = [("device", evaluation.device_name + evaluation.device_note())]
    if evaluation.device == "cpu":
        entries.append(("threads", f"{evaluation.threads}, kernels for {evaluation.isa}"))
    else:
        entries.append(("CPU of the machine", evaluation.cpu))
    load = ", ".join(f"{value:g}" for value in evaluation.load)
    entries += [("picture", f"{evaluation.width} x {evaluation.height}"),
                ("rounds", f"{evaluation.build_rounds} builds, {evaluation.trace_rounds} traces"),
                ("system", evaluation.system + (f"; load average at the start {load}" if load else "")),
                ("versions", ", ".join(f"{key} {value}" for key, value in evaluation.versions.items())),
                ("commit", evaluation.commit), ("date", evaluation.date), ("command", evaluation.command)]
    if evaluation.vulkan:
        entries.append(("Vulkan", "{device}; driver {driver}; rays by {calls}".format(**evaluation.vulkan)))
    rows = "".join(f"<dt>{html.escape(name)}</dt><dd>{wrap(name, value)}</dd>" for name, value in entries)
    return f"<dl>{rows}</dl>"


def cpu_build_method(evaluation):
    entries = (entry for scene in evaluation.scenes for entry in scene.entries)
    return CPU_BUILD_METHOD if any(entry.cpu_build for entry in entries) else ""


def busy(evaluation):
    """A warning if other programs ran."""
    if evaluation.device != "cpu" or not evaluation.load or evaluation.load[0] < 0.5 * evaluation.threads:
        return ""
    return ('<div class="faults"><strong>The machine was busy with other work at the start</strong><p>(load average '
            f"{evaluation.load[0]:g} on {evaluation.threads} threads). Times are longer than on an idle machine; "
            "times of the same round can still be compared roughly.</p></div>")


def wrap(name, value):
    words = html.escape(str(value))
    return f"<code>{words}</code>" if name == "command" else words


def missing(scene):
    """@return the list of competitors that were not measured, grouped by reason."""
    reasons = {}
    for entry in scene.missing:
        who = " ".join(part for part in [entry["tracer"], entry["builder"]] if part)
        reasons.setdefault((HIERARCHIES.get(entry["form"], entry["form"]), entry["why"]), []).append(who)
    lines = "".join(f"<li>{html.escape(hierarchy)}"
                    f"{html.escape(': ' + ', '.join(filter(None, names)) if any(names) else '')}: "
                    f"{html.escape(why)}</li>" for (hierarchy, why), names in reasons.items())
    return f"<h3>Not measured</h3><ul>{lines}</ul>" if lines else ""


def chart_figures(name, found):
    """@param name of the scene, or overview.ALL. @param found the charts and their captions."""
    text = ""
    for kind, caption, picture in found:
        wide = ' class="chart wide"' if picture.width > 700 else ' class="chart"'
        text += (f'<figure{wide} id="{name}-{kind}"><figcaption>{html.escape(caption)}</figcaption>'
                 f"{picture.inline()}</figure>")
    return f'<div class="charts">{text}</div>' if text else ""


def scene_section(evaluation, scene, found):
    parts = [tables.builders(evaluation, scene), chart_figures(scene.name, found),
             tables.crossover_table(evaluation, scene), tables.levels_price(evaluation, scene),
             tables.disagreements(evaluation, scene), tables.waves(evaluation, scene), missing(scene)]
    return (f'<section id="{scene.name}"><h2>{html.escape(scene.name)}</h2><p>{html.escape(scene.source)}</p>'
            + "".join(parts) + "</section>")


def fault_list(evaluation):
    if not evaluation.faults:
        return "<p>All results of hiprt are right.</p>"
    lines = "".join(f"<li>{html.escape(fault)}</li>" for fault in evaluation.faults)
    return f'<div class="faults"><strong>Wrong results</strong><ul>{lines}</ul></div>'


def page(evaluation):
    found = all_charts(evaluation)
    css = CSS.replace("LIGHT", variables(0)).replace("DARK", variables(1)) + STYLE
    title = f"hiprt: evaluation on {evaluation.device_name}"
    links = "".join(f'<a href="#{scene.name}">{html.escape(scene.name)}</a>' for scene in evaluation.scenes)
    return (f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
            f'<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">'
            f"<title>{html.escape(title)}</title><style>{css}</style></head><body><nav>{links}</nav><main>"
            f"<h1>{html.escape(title)}</h1>{facts(evaluation)}{METHOD}"
            f"{GPU_METHOD if evaluation.device == 'gpu' else CPU_METHOD}{cpu_build_method(evaluation)}"
            f"{VULKAN_METHOD if evaluation.vulkan else ''}"
            f"{busy(evaluation)}{fault_list(evaluation)}{tables.overview(evaluation)}"
            + chart_figures(ALL, found[ALL])
            + "".join(scene_section(evaluation, scene, found[scene.name]) for scene in evaluation.scenes)
            + "</main></body></html>\n")
