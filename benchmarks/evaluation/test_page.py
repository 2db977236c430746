#!/usr/bin/env python3
"""test_page.py REPORT CHROMIUM WORK PLOT...: checks how a browser shows report.html.

It uses the widths of a desktop and of a small screen, light and dark. The console stays empty, and the page is no wider
than the screen. Every table and plot is there and has a size, and all words of a plot are inside it. Screenshots stay
in WORK.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

# Runs at the end of a copy of the page, and writes its findings into the page.
PROBE = """<script>
const box = element => { const r = element.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; };
const outside = svg => { const [l, t, r, b] = box(svg);
  return [...svg.querySelectorAll("text, rect, circle")].filter(part => {
    const [pl, pt, pr, pb] = box(part); return pl < l - 1 || pt < t - 1 || pr > r + 1 || pb > b + 1; })
    .map(part => part.textContent); };
const found = { errors: window.faults, width: innerWidth, wide: document.documentElement.scrollWidth,
  paper: getComputedStyle(document.body).backgroundColor, ink: getComputedStyle(document.body).color,
  tables: [...document.querySelectorAll("figure.table")].map(f => ({ caption: f.querySelector("figcaption").textContent,
    rows: f.querySelectorAll("tbody tr").length, size: box(f.querySelector("table")) })),
  plots: [...document.querySelectorAll("figure.chart")].map(f => ({ id: f.id, size: box(f.querySelector("svg")),
    marks: f.querySelectorAll("polyline, rect").length, outside: outside(f.querySelector("svg")),
    colour: getComputedStyle(f.querySelector("text")).fill })),
  loaded: performance.getEntriesByType("resource").map(entry => entry.name).filter(name => !name.startsWith("data:")) };
const pre = document.createElement("pre"); pre.id = "found"; pre.textContent = JSON.stringify(found);
document.body.append(pre);
</script>"""
CATCH = "<script>window.faults = []; window.addEventListener('error', e => faults.push(e.message), true);</script>"

faults = []


def fault(words):
    print(f"FAILED: {words}")
    faults.append(words)


def browse(chromium, page, width, dark, *arguments):
    command = [chromium, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--enable-logging=stderr",
               "--disable-dev-shm-usage", f"--window-size={width},900", *arguments, page.as_uri()]
    if dark:
        command.insert(1, "--blink-settings=preferredColorScheme=0")
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    for line in done.stderr.splitlines():
        if "CONSOLE" in line:
            fault(f"{width} pixels: on the console: {line}")
    return done.stdout


def check_plot(plot, place):
    left, top, right, bottom = plot["size"]
    if right - left < 100 or bottom - top < 50:
        fault(f"{place}: plot {plot['id']} has the size {right - left} x {bottom - top}")
    if plot["marks"] == 0:
        fault(f"{place}: plot {plot['id']} shows nothing")
    if plot["outside"]:
        fault(f"{place}: plot {plot['id']}: outside of it: {plot['outside']}")


def check(found, expected, place):
    if found["errors"] or found["loaded"]:
        fault(f"{place}: errors {found['errors']}, loaded {found['loaded']}")
    if found["wide"] > found["width"]:
        fault(f"{place}: the page is {found['wide']} pixels wide")
    plots = sorted(plot["id"] for plot in found["plots"])
    if plots != sorted(expected["plots"]):
        fault(f"{place}: plots {plots}, wanted {expected['plots']}")
    if len(found["tables"]) != expected["tables"]:
        fault(f"{place}: {len(found['tables'])} tables, wanted {expected['tables']}")
    for table in found["tables"]:
        left, top, right, bottom = table["size"]
        if table["rows"] == 0 or right - left < 50 or bottom - top < 20:
            fault(f"{place}: table '{table['caption']}' has {table['rows']} rows, size {right - left} x {bottom - top}")
    for plot in found["plots"]:
        check_plot(plot, place)
        if plot["colour"] == found["paper"]:
            fault(f"{place}: plot {plot['id']}: words have the colour of the paper")


def main():
    report, chromium, work = Path(sys.argv[1]).resolve(), sys.argv[2], Path(sys.argv[3]).resolve()
    text = report.read_text(encoding="utf-8")
    expected = {"plots": [f"{scene}-{plot}" for scene, plot in
                          (name[:-4].split(".", 1) for name in sys.argv[4:])], "tables": text.count('class="table"')}
    probed = work / "probed.html"
    probed.write_text(text.replace("<head>", "<head>" + CATCH).replace("</body>", PROBE + "</body>"), encoding="utf-8")
    papers = set()
    for width, dark in [(1280, False), (600, True)]:
        place = f"{width} pixels, {'dark' if dark else 'light'}"
        dom = browse(chromium, probed, width, dark, "--dump-dom")
        match = re.search(r'<pre id="found">(.*?)</pre>', dom, re.DOTALL)
        if not match:
            fault(f"{place}: the page was not drawn: {dom[-300:]}")
            continue
        found = json.loads(match[1].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))
        check(found, expected, place)
        papers.add(found["paper"])
        shot = work / f"report-{width}.png"
        browse(chromium, report, width, dark, f"--screenshot={shot}")
        if not shot.exists() or shot.stat().st_size < 10000:
            fault(f"{place}: the screenshot is empty")
    if len(papers) != 2:
        fault(f"light and dark have the paper {papers}")
    print(f"{len(expected['plots'])} plots, {expected['tables']} tables, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
