#!/usr/bin/env python3
"""Plots JSON of bench_tradeoff: speed against each kind of fault. See --help."""

import json
import sys

from variant_report.json_file import InputError, content
from variant_report.plots import load_pyplot, save
from variant_report.runs import geometric_mean
from variant_report.script import Parser, run_script, write_together

DESCRIPTION = """Writes pareto_AXIS.svg from JSON of bench_tradeoff: the speed of every policy set against its leaks,
hits hidden by boxes, self-intersections of spawned rays, wrong surfaces, and errors of t and of the hit point. Policy
sets that another one beats in both are grey. Exit status: 0; 1 when a file cannot be read or written or has another
format (nothing is written then); 2 for a wrong argument."""
FORMAT = "hiprt bench_tradeoff 1"


class Tradeoff:
    def __init__(self, path):
        try:
            self.json = json.loads(content(path).decode("utf-8"))
            if self.json["format"] != FORMAT:
                raise InputError(f"{path}: the format is '{self.json['format']}', '{FORMAT}' expected")
            self.device = self.json["device"]["name"]
            self.speeds = {}
            for row in self.json["speed"]:
                self.speeds.setdefault(row["subject"], []).append(row["relative"])
            self.faults = [(row["subject"], row["question"], row["origin"], row["rays"], row["faults"])
                           for row in self.json["faults"]]
            self.errors = [(row["subject"], row["rays"], row["missed"] + row["wrong_surface"], row["t"]["p999"],
                            row["point"]["p999"]) for row in self.json["errors"]]
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise InputError(f"{path}: not JSON of bench_tradeoff: {error}") from error

    def speed(self, subject):
        return geometric_mean(self.speeds[subject])

    def fault_rate(self, wanted):
        """@return by subject: faults per 10^9 rays of the checks for which wanted(question, origin) is true."""
        sums = {}
        for subject, question, origin, rays, faults in self.faults:
            if wanted(question, origin):
                sum_ = sums.setdefault(subject, [0, 0])
                sum_[0] += rays
                sum_[1] += faults
        return {subject: (1e9 * faults / rays, 1e9 / rays) for subject, (rays, faults) in sums.items() if rays}

    def wrong_rate(self):
        sums = {}
        for subject, rays, wrong, _, _ in self.errors:
            sum_ = sums.setdefault(subject, [0, 0])
            sum_[0] += rays
            sum_[1] += wrong
        return {subject: (1e4 * wrong / rays, 1e4 / rays) for subject, (rays, wrong) in sums.items() if rays}

    def worst(self, column):
        """@return by subject: the largest value of all cases."""
        result = {}
        for row in self.errors:
            result[row[0]] = max(result.get(row[0], (0, 0.1))[0], row[column]), 0.1
        return result


# Name of the file, title of the axis, and by subject: (value, the least value that so many rays can show).
AXES = [
    ("leaks", "leaks per 10⁹ rays aimed at edges and vertices",
     lambda t: t.fault_rate(lambda question, _: question in ("edges", "vertices"))),
    ("random_leaks", "leaks per 10⁹ random rays", lambda t: t.fault_rate(lambda question, _: question == "random")),
    ("boxes", "hits that boxes hide, per 10⁹", lambda t: t.fault_rate(lambda question, _: question == "boxes")),
    ("spawned", "self-intersections of spawned rays per 10⁹ (spawn_origin())",
     lambda t: t.fault_rate(lambda question, origin: question == "spawned" and origin == "spawn_origin")),
    ("wrong", "missed or wrong surfaces of 10,000 hard rays", lambda t: t.wrong_rate()),
    ("t", "error of t, 99.9th percentile of the worst case, in ulps", lambda t: t.worst(3)),
    ("point", "distance from the surface, 99.9th percentile of the worst case, in ulps", lambda t: t.worst(4)),
]


def beaten(point, points):
    """@return whether another point is at least as good in both coordinates and better in one."""
    return any(x >= point[0] and y <= point[1] and (x, y) != point for x, y in points)


def plot(plt, tradeoff, name, title, values, folder):
    subjects = [subject for subject in values if subject in tradeoff.speeds]
    if not subjects:
        return
    least = min(values[subject][1] for subject in subjects) / 2
    points = {subject: (tradeoff.speed(subject), values[subject][0]) for subject in subjects}
    figure, axis = plt.subplots(figsize=(7, 5))
    # Names would overlap, so the points have numbers, and the names are beside the plot.
    for number, (subject, point) in enumerate(points.items(), 1):
        grey = beaten(point, list(points.values()))
        axis.plot(point[0], max(point[1], least), "o", markersize=11, color="lightgrey" if grey else "tab:blue",
                  label=f"{number} {subject}", zorder=2 if grey else 3)
        axis.annotate(str(number), (point[0], max(point[1], least)), fontsize=7, color="black" if grey else "white",
                      ha="center", va="center", zorder=4)
    axis.legend(loc="center left", bbox_to_anchor=(1.02, 0.5), fontsize=8, frameon=False)
    axis.set_yscale("log")
    axis.yaxis.set_major_formatter(lambda value, _: f"{value:.0e}".replace("e+0", "e").replace("e-0", "e-"))
    axis.set_xlabel(f"speed, {next(iter(tradeoff.speeds))} = 1 (geometric mean)")
    axis.set_ylabel(title)
    axis.axhline(least, color="grey", linewidth=0.5)
    axis.text(0.01, least, "none seen", fontsize=7, color="grey", va="bottom", transform=axis.get_yaxis_transform())
    axis.grid(linewidth=0.3)
    axis.set_title(f"{tradeoff.device}: right and down is better; grey: another policy set is better in both",
                   fontsize=9)
    save(figure, folder, f"pareto_{name}")
    plt.close(figure)


def write_plots(tradeoff, folder):
    plt = load_pyplot("plot_tradeoff.py")
    if plt is None:
        return
    for name, title, values in AXES:
        plot(plt, tradeoff, name, title, values(tradeoff), folder)


def main():
    parser = Parser(prog="plot_tradeoff.py", description=DESCRIPTION)
    parser.add_argument("json", help="file of bench_tradeoff --json")
    parser.add_argument("--output", default=".", help="folder for the output (.)")
    arguments = parser.parse_args()

    def work():
        tradeoff = Tradeoff(arguments.json)
        write_together("plot_tradeoff", arguments.output, lambda folder: write_plots(tradeoff, folder))

    return run_script("plot_tradeoff", work)


if __name__ == "__main__":
    sys.exit(main())
