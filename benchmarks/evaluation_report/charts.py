"""The charts of a scene."""

from . import numbers
from .curves import crossovers, sample_counts
from .runs import HIERARCHIES, YARDSTICK
from .svg import Picture, Scale, spread

OPACITY = {"flat": 1, "two_level": 0.6, "deep": 0.3}


# A builder has the same colour on every page: its index in svg.SERIES. Builders that are not listed share the last one.
COLORS = [("hiprt", "lbvh"), ("hiprt", "ploc"), ("hiprt", "hploc"), ("hiprt", "sah"), ("hiprt", "sbvh"),
          ("hiprt", "hq"), ("embree", "default"), ("embree", "high"), ("embree", "robust")]


# Colours of Vulkan's modes. The first one is shared with Embree, which is not measured on GPUs.
VULKAN_COLORS = {"fast_build": 6, "fast_trace": 9}


def series(entry):
    if entry.tracer == "vulkan":
        return VULKAN_COLORS.get(entry.builder, len(COLORS))
    if entry.key() == ("hiprt", "embree-high"):  # Embree's tree has one colour, whoever traces it.
        return COLORS.index(("embree", "high"))
    return COLORS.index(entry.key()) if entry.key() in COLORS else len(COLORS)


def time_label(value):
    for unit, name in [(1, "s"), (1e-3, "ms"), (1e-6, "µs")]:
        if value >= 0.999 * unit:
            return f"{value / unit:,.0f} {name}".replace(",", "\u202f")
    return f"{value * 1e6:g} µs"


def sample_label(value):
    for unit, name in [(1e6, " M"), (1e3, " k"), (1, "")]:
        if value >= unit:
            return f"{value / unit:g}{name}"
    return f"{value:g}"


def frame(picture, across, up, x_label, y_label, label_y):
    """Draws axes, grid and their labels."""
    for value in up.ticks():
        y = up.place(value)
        picture.line(across.start, y, across.end, y, "grid")
        picture.text(across.start - 6, y + 4, label_y(value), "small", "end")
    for value in across.ticks():
        x = across.place(value)
        picture.line(x, up.start, x, up.end, "grid")
        picture.text(x, up.start + 16, sample_label(value), "small", "middle")
    picture.line(across.start, up.start, across.end, up.start, "axis")
    picture.text((across.start + across.end) / 2, up.start + 34, x_label, "small", "middle")
    picture.text(8, 16, y_label, "head")


def end_labels(picture, places, entries, across, up):
    """Draws names behind the ends of the curves, moved apart."""
    for entry, place, moved in zip(entries, places, spread(places, 14, up.end + 4, up.start)):
        picture.parts.append(f'<line x1="{across.end:.1f}" y1="{place:.1f}" '
                             f'x2="{across.end + 10:.1f}" y2="{moved:.1f}" '
                             f'stroke="var(--series{series(entry)})"/>')
        picture.text(across.end + 13, moved + 4, entry.name())


def time_to_image(scene, hierarchy):
    """Plots build time + samples * time per sample, log-log."""
    entries, counts = scene.of_hierarchy(hierarchy), sample_counts(scene, hierarchy)
    picture = Picture(560, 360, f"{scene.name}, {HIERARCHIES[hierarchy]}: time to image over samples per pixel")
    times = [entry.image_seconds(n) for entry in entries for n in (counts[0], counts[-1])]
    across = Scale(counts[0], counts[-1], 60, 440, True)
    up = Scale(min(times) / 1.2, max(times) * 1.2, 310, 34, True)
    frame(picture, across, up, "samples per pixel", "time to image", time_label)
    for entry in entries:
        points = [(across.place(n), up.place(entry.image_seconds(n))) for n in counts]
        words = (f"{entry.name()}: build {numbers.seconds(entry.build_seconds)}, "
                 f"then {numbers.seconds(entry.sample_seconds())} per sample")
        picture.curve(points, series(entry), words, entry.tracer != "hiprt")
    end_labels(picture, [up.place(entry.image_seconds(counts[-1])) for entry in entries], entries, across, up)
    return picture


def relative_time_to_image(scene, hierarchy):
    """Plots the same relative to PLOC. A crossover is where a curve passes 1. @return None if PLOC was not measured."""
    yardstick = scene.entry(hierarchy, YARDSTICK)
    if yardstick is None:
        return None
    entries, counts = scene.of_hierarchy(hierarchy), sample_counts(scene, hierarchy)
    counts = [counts[0] * (counts[-1] / counts[0]) ** (i / 80) for i in range(81)]
    ratio = lambda entry, n: entry.image_seconds(n) / yardstick.image_seconds(n)  # noqa: E731
    ends = [ratio(entry, counts[-1]) for entry in entries]
    low = min(0.5, 0.95 * min(ratio(entry, n) for entry in entries for n in counts))
    top = max(2.0, 1.1 * max(ends))
    picture = Picture(560, 360, f"{scene.name}, {HIERARCHIES[hierarchy]}: time to image relative to {YARDSTICK}")
    across, up = Scale(counts[0], counts[-1], 60, 440, True), Scale(low, top, 310, 34, False)
    frame(picture, across, up, "samples per pixel", f"relative to {YARDSTICK}", lambda value: f"{value:g}")
    for entry in entries:
        points = [(across.place(n), up.place(ratio(entry, n))) for n in counts if ratio(entry, n) <= top]
        picture.curve(points, series(entry), entry.name(), entry.tracer != "hiprt")
    for slow, fast, (samples, _, _) in crossovers(scene, hierarchy):
        if yardstick in (slow, fast) and counts[0] <= samples <= counts[-1]:
            words = f"{slow.name()} is ahead of {fast.name()} from {numbers.samples(samples)} samples on"
            picture.dot(across.place(samples), up.place(1), series(slow if fast is yardstick else fast), words)
    end_labels(picture, [up.place(end) for end in ends], entries, across, up)
    return picture


def trace_bars(scene):
    """Draws the average time of a wave by kind: a row per builder, a bar per hierarchy."""
    hierarchies = [hierarchy for hierarchy in HIERARCHIES if scene.of_hierarchy(hierarchy)]
    rows = list({entry.key(): entry for entry in scene.entries}.values())
    kinds = scene.kinds()
    bar, left, panel = 12, 120, 300
    row = bar * len(hierarchies) + 8
    picture = Picture(left + panel * len(kinds), 52 + row * len(rows) + 8, f"{scene.name}: average time per wave")
    draw_hierarchy_legend(picture, hierarchies)
    for i, entry in enumerate(rows):
        picture.text(left - 8, 52 + row * i + (row - 8) / 2 + 4, entry.name(), "", "end")
    for k, kind in enumerate(kinds):
        largest = max(scene.wave_seconds(entry, kind) for entry in scene.entries)
        scale = Scale(0, largest, left + panel * k, left + panel * (k + 1) - 78, False)
        waves = len(scene.wave_names(kind))
        picture.text(scale.start, 42, f"{kind}, mean of {waves} waves" if waves > 1 else kind, "head")
        for i, key in enumerate(entry.key() for entry in rows):
            for f, hierarchy in enumerate(hierarchies):
                entry = scene.entry(hierarchy, key[1], key[0])
                if entry is None:
                    continue
                value = scene.wave_seconds(entry, kind)
                y = 52 + row * i + bar * f
                words = f"{entry.name()}, {HIERARCHIES[hierarchy]}, {kind}: {numbers.seconds(value)} per wave"
                picture.bar(scale.start, y, scale.place(value) - scale.start, bar - 2, series(entry),
                            OPACITY[hierarchy], words)
                picture.text(scale.place(value) + 5, y + bar - 3, numbers.seconds(value), "small")
    return picture


def bounce_curves(scene, hierarchy):
    """Plots the time per ray of each diffuse bounce. @return None with fewer than three bounces."""
    names = scene.wave_names("secondary")
    if len(names) < 3:
        return None
    entries = scene.of_hierarchy(hierarchy)
    nanoseconds = lambda entry, name: 1e9 * entry.waves[name] / scene.waves[name]["rays"]  # noqa: E731
    picture = Picture(560, 360, f"{scene.name}, {HIERARCHIES[hierarchy]}: time per ray over bounces")
    most = max(nanoseconds(entry, name) for entry in entries for name in names)
    across, up = Scale(1, len(names), 60, 440, False), Scale(0, 1.05 * most, 310, 34, False)
    frame(picture, across, up, "bounce", "ns per ray", lambda value: f"{value:g}")
    for entry in entries:
        points = [(across.place(i + 1), up.place(nanoseconds(entry, name))) for i, name in enumerate(names)]
        picture.curve(points, series(entry), entry.name(), entry.tracer != "hiprt")
    end_labels(picture, [up.place(nanoseconds(entry, names[-1])) for entry in entries], entries, across, up)
    return picture


def draw_hierarchy_legend(picture, hierarchies):
    x = 8
    for hierarchy in hierarchies:
        picture.bar(x, 8, 14, 11, 6, OPACITY[hierarchy], HIERARCHIES[hierarchy])
        picture.text(x + 19, 18, HIERARCHIES[hierarchy], "small")
        x += 30 + 7 * len(HIERARCHIES[hierarchy])


def build_bars(scene):
    """Draws build times, logarithmic: a row per builder, a bar per hierarchy."""
    hierarchies = [hierarchy for hierarchy in HIERARCHIES if scene.of_hierarchy(hierarchy)]
    rows = list({entry.key(): entry for entry in scene.entries}.values())
    times = [entry.build_seconds for entry in scene.entries]
    bar, left = 12, 120
    row = bar * len(hierarchies) + 8
    bottom = 52 + row * len(rows)
    picture = Picture(left + 900, bottom + 24, f"{scene.name}: build time")
    draw_hierarchy_legend(picture, hierarchies)
    scale = Scale(min(times) / 3, 1.2 * max(times), left, left + 820, True)
    for value in scale.ticks():
        picture.line(scale.place(value), 40, scale.place(value), bottom, "grid")
        picture.text(scale.place(value), bottom + 16, time_label(value), "small", "middle")
    for i, key in enumerate(entry.key() for entry in rows):
        for f, hierarchy in enumerate(hierarchies):
            entry = scene.entry(hierarchy, key[1], key[0])
            if entry is None:
                continue
            y = 52 + row * i + bar * f
            words = f"{entry.name()}, {HIERARCHIES[hierarchy]}: {numbers.seconds(entry.build_seconds)}"
            picture.bar(scale.start, y, scale.place(entry.build_seconds) - scale.start, bar - 2, series(entry),
                        OPACITY[hierarchy], words)
            picture.text(scale.place(entry.build_seconds) + 5, y + bar - 3, numbers.seconds(entry.build_seconds),
                         "small")
        picture.text(left - 8, 52 + row * i + (row - 8) / 2 + 4, rows[i].name(), "", "end")
    return picture


def charts(scene):
    """@return a list of (name of the file, caption, picture) for a scene."""
    found = [("trace_times", "Average time per wave, by kind of rays.", trace_bars(scene)),
             ("build_times", "Build time (logarithmic).", build_bars(scene))]
    for hierarchy in HIERARCHIES:
        if not scene.of_hierarchy(hierarchy):
            continue
        found.append((f"time_to_image_{hierarchy}",
                      f"Time to image, {HIERARCHIES[hierarchy]}: build, then all waves of each sample.",
                      time_to_image(scene, hierarchy)))
        relative = relative_time_to_image(scene, hierarchy)
        if relative:
            found.append((f"time_to_image_relative_{hierarchy}",
                          f"The same, {HIERARCHIES[hierarchy]}, relative to {YARDSTICK}'s; rings are crossovers.",
                          relative))
        bounces = bounce_curves(scene, hierarchy)
        if bounces:
            found.append((f"bounces_{hierarchy}", f"Time per ray of each diffuse bounce, {HIERARCHIES[hierarchy]}.",
                          bounces))
    return found
