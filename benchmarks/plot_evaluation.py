#!/usr/bin/env python3
"""Turns JSON of bench_evaluation into one page and its plots. See --help."""

import os
import sys

from evaluation_report.markdown import markdown
from evaluation_report.overview import all_charts
from evaluation_report.page import page
from evaluation_report.runs import Evaluation
from variant_report.script import Parser, run_script, write_together

DESCRIPTION = """Writes report.html (one page with all tables and plots) and every plot as SCENE.PLOT.svg from JSON of
bench_evaluation. --tables prints the tables of all scenes as Markdown instead. Needs only Python's standard library.
Exit status: 0; 1 when a file cannot be read or written or has another format (nothing is written then); 2 for a wrong
argument."""


def write_report(evaluation, folder):
    def write(name, text):
        # Text of the JSON, such as a command, may hold what has no encoding.
        with open(os.path.join(folder, name), "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(text)

    write("report.html", page(evaluation))
    for scene, pictures in all_charts(evaluation).items():
        for name, _, picture in pictures:
            write(f"{scene}.{name}.svg", picture.standalone())


def main():
    parser = Parser(prog="plot_evaluation.py", description=DESCRIPTION)
    parser.add_argument("json", help="file of bench_evaluation --json; compressed ones end in .xz")
    parser.add_argument("--output", default=".", help="folder for the output (.)")
    parser.add_argument("--tables", action="store_true", help="print Markdown and write nothing")
    arguments = parser.parse_args()

    def work():
        evaluation = Evaluation(arguments.json)
        if arguments.tables:
            print(markdown(evaluation), end="")
            return
        write_together("plot_evaluation", arguments.output, lambda folder: write_report(evaluation, folder))

    return run_script("plot_evaluation", work)


if __name__ == "__main__":
    sys.exit(main())
