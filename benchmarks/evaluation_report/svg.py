"""Pictures of lines, bars and words. They have the colours of the page, or of the reader's light or dark mode."""

import html
import math

# Light, dark (charts.COLORS).
SERIES = [("#1f77b4", "#6cb4ee"), ("#d1571b", "#ff9b57"), ("#2a8a3a", "#6fd07d"), ("#8a4fbf", "#c79bf2"),
          ("#b8860b", "#e8c14a"), ("#c2185b", "#ff7aa8"), ("#5f6b76", "#a9b4bf"), ("#3d4852", "#d0d7de"),
          ("#84919d", "#7d8b98"), ("#00897b", "#4dd0c0")]

TITLE_HEIGHT = 28

STYLE = """
text { font: 12px system-ui, -apple-system, "Segoe UI", sans-serif; fill: var(--ink) }
.small { font-size: 11px; fill: var(--soft) }
.head { font-weight: 600 }
.grid { stroke: var(--line); stroke-width: 1 }
.axis { stroke: var(--soft); stroke-width: 1 }
.curve { fill: none; stroke-width: 2; stroke-linejoin: round }
.dashed { stroke-dasharray: 5 4 }
"""


def variables(dark):
    """@return the colours as CSS variables."""
    names = {"paper": ("#ffffff", "#14181d"), "ink": ("#1b2026", "#e7ebef"), "soft": ("#5b6671", "#9fabb7"),
             "line": ("#e1e5e9", "#2d343c"), "shade": ("#f4f6f8", "#1c2229"), "link": ("#0b5cad", "#7db8f5")}
    names |= {f"series{i}": colors for i, colors in enumerate(SERIES)}
    return " ".join(f"--{name}: {colors[dark]};" for name, colors in names.items())


def number(value):
    return f"{value:.2f}".rstrip("0").rstrip(".")


class Picture:
    def __init__(self, width, height, title):
        self.width = width
        self.height = height
        self.title = title
        self.parts = []

    def line(self, x1, y1, x2, y2, kind):
        self.parts.append(f'<line class="{kind}" x1="{number(x1)}" y1="{number(y1)}" '
                          f'x2="{number(x2)}" y2="{number(y2)}"/>')

    def text(self, x, y, words, kind="", anchor="start"):
        self.parts.append(f'<text class="{kind}" x="{number(x)}" y="{number(y)}" text-anchor="{anchor}">'
                          f"{html.escape(words)}</text>")

    def bar(self, x, y, width, height, series, opacity, words):
        self.parts.append(f'<rect x="{number(x)}" y="{number(y)}" width="{number(max(0.5, width))}" '
                          f'height="{number(height)}" fill="var(--series{series})" fill-opacity="{opacity}">'
                          f"<title>{html.escape(words)}</title></rect>")

    def curve(self, points, series, words, dashed=False):
        path = " ".join(f"{number(round(x, 1))},{number(round(y, 1))}" for x, y in points)
        kind = "curve dashed" if dashed else "curve"
        self.parts.append(f'<polyline class="{kind}" stroke="var(--series{series})" points="{path}">'
                          f"<title>{html.escape(words)}</title></polyline>")

    def dot(self, x, y, series, words):
        self.parts.append(f'<circle cx="{number(x)}" cy="{number(y)}" r="4" fill="var(--paper)" stroke-width="2" '
                          f'stroke="var(--series{series})"><title>{html.escape(words)}</title></circle>')

    def inline(self):
        return (f'<svg viewBox="0 0 {number(self.width)} {number(self.height)}" role="img" '
                f'aria-label="{html.escape(self.title)}">{"".join(self.parts)}</svg>')

    def standalone(self):
        """@return the text of an SVG file. Its title stands above the picture."""
        title, height = html.escape(self.title), number(self.height + TITLE_HEIGHT)
        style = (f":root {{ {variables(0)} }} @media (prefers-color-scheme: dark) {{ :root {{ {variables(1)} }} }} "
                 f"{STYLE}")
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 {-TITLE_HEIGHT} {number(self.width)} {height}" '
                f'width="{number(self.width)}" height="{height}"><title>{title}</title>'
                f'<style>{style}</style><rect y="{-TITLE_HEIGHT}" width="100%" height="100%" fill="var(--paper)"/>'
                f'<text class="head" x="8" y="-10">{title}</text>{"".join(self.parts)}</svg>\n')


class Scale:
    """Maps numbers to positions along an axis."""

    def __init__(self, low, high, start, end, logarithmic):
        self.low, self.high, self.start, self.end, self.logarithmic = low, high, start, end, logarithmic

    def place(self, value):
        if self.logarithmic:
            part = math.log(value / self.low) / math.log(self.high / self.low)
        else:
            part = (value - self.low) / (self.high - self.low)
        return self.start + part * (self.end - self.start)

    def ticks(self):
        """@return decades (with steps between them if they are few), or round steps."""
        if self.logarithmic:
            first, last = math.floor(math.log10(self.low)), math.ceil(math.log10(self.high))
            factors = (1,) if last - first > 3 else (1, 2, 5)
            ticks = [factor * 10.0**i for i in range(first, last + 1) for factor in factors]
            return [tick for tick in ticks if 0.999999 * self.low <= tick <= 1.000001 * self.high]
        step = round_step((self.high - self.low) / 5)
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [i * step for i in range(first, last + 1)]


def round_step(value):
    """@return 1, 2 or 5 times a power of ten, at least about `value`."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= 0.999 * value)


def spread(places, gap, low, high):
    """@return the positions, moved apart by at least `gap`, in their order, inside [low, high] if they fit."""
    order = sorted(range(len(places)), key=lambda i: places[i])
    moved = [0.0] * len(places)
    last = low - gap
    for i in order:
        last = moved[i] = max(places[i], last + gap)
    bound = high
    for i in reversed(order):
        moved[i] = min(moved[i], bound)
        bound = moved[i] - gap
    return moved
