#!/usr/bin/env python3
"""make_charts.py [FOLDER]: draws the charts of README.md from figures.json, beside this file or in FOLDER.

Each chart is a list of horizontal bars in an SVG that follows the reader's colour scheme, light or dark.
"""

import json
import math
import sys
from pathlib import Path
from xml.sax.saxutils import escape

HERE = Path(__file__).parent
WIDTH, LEFT, RIGHT, TOP, ROW, BAR = 720, 290, 80, 64, 32, 20
STYLE = """
    text { font: 14px sans-serif; fill: #1f2328; }
    .title { font-weight: bold; font-size: 16px; }
    .note { font-size: 11px; fill: #59636e; }
    .bar { fill: #8c959f; }
    .strong { fill: #0969da; }
    .line { stroke: #59636e; stroke-dasharray: 4 3; }
    @media (prefers-color-scheme: dark) {
      text { fill: #f0f6fc; }
      .note { fill: #9198a1; }
      .bar { fill: #656c76; }
      .strong { fill: #4493f8; }
      .line { stroke: #9198a1; }
    }
"""


def text(x: float, y: float, content: str, anchor: str = "start", kind: str = "") -> str:
    return f'  <text x="{x:g}" y="{y:g}" text-anchor="{anchor}" class="{kind}">{escape(content)}</text>'


def number(value: float, chart: dict) -> str:
    if chart.get("logarithmic"):
        if value == 0:
            return "0"
        exponent = math.floor(math.log10(value))
        digits = str(exponent).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))
        return f"{value / 10 ** exponent:.1f} · 10{digits}"
    return f"{value:.2f}{chart.get('unit', '')}"


def length(value: float, chart: dict) -> float:
    room = WIDTH - LEFT - RIGHT
    most = max(bar["value"] for bar in chart["bars"])
    if chart.get("logarithmic"):
        return room * (math.log10(value) / math.log10(most) if value > 1 else 0)
    return room * value / most


def draw(chart: dict) -> str:
    height = TOP + ROW * len(chart["bars"]) + 12
    label = f"{chart['title']}. " + ", ".join(f"{b['label']}: {number(b['value'], chart)}" for b in chart["bars"])
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" '
             f'height="{height}" role="img" aria-label="{escape(label)}">', f"  <style>{STYLE}  </style>",
             text(12, 24, chart["title"], kind="title"), text(12, 44, chart["note"], kind="note")]
    for i, bar in enumerate(chart["bars"]):
        y = TOP + ROW * i
        size = max(length(bar["value"], chart), 2)
        kind = "bar strong" if bar.get("strong") else "bar"
        lines += [text(LEFT - 10, y + 15, bar["label"], "end"),
                  f'  <rect x="{LEFT}" y="{y}" width="{size:.1f}" height="{BAR}" rx="3" class="{kind}"/>',
                  text(LEFT + size + 8, y + 15, number(bar["value"], chart))]
    if "reference" in chart:
        x = LEFT + length(chart["reference"]["value"], chart)
        lines.append(f'  <line x1="{x:.1f}" y1="{TOP - 8}" x2="{x:.1f}" y2="{height - 14}" class="line"/>')
        lines.append(text(x, height - 2, chart["reference"]["label"], "middle", "note"))
    return "\n".join(lines + ["</svg>"]) + "\n"


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    for name, chart in json.loads((HERE / "figures.json").read_text(encoding="utf-8")).items():
        (folder / f"{name}.svg").write_text(draw(chart), encoding="utf-8")


main()
