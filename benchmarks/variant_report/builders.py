"""Results of bench_builders and their bar charts."""

from .json_file import parse
from .plots import save
from .runs import geometric_mean

# Google Benchmark's name of a scene's figures: builders/SCENE/iterations:1
PREFIX = "builders/"
KINDS = ["primary", "ao", "diffuse"]
GENERATED = ["procedural", "opera_house"]
# By build time, imported BVHs of Embree last. Unknown builders follow.
ORDER = ["lbvh30", "lbvh", "ploc", "hploc", "sah", "sbvh", "hq", "embree-low", "embree-medium", "embree-high"]


def scene_of(part):
    """@return None for other benchmarks."""
    name = part.text("name")
    return name[len(PREFIX):].split("/")[0] if name.startswith(PREFIX) else None


class BuilderRuns:
    """Figures by scene, builder and counter."""

    def __init__(self, path):
        self.cells = {}
        self.builders = []
        file = parse(path)
        for part in file.members("benchmarks"):
            scene = scene_of(part)
            if scene is None:
                continue
            builders = [key[:-len(".seconds_ratio")] for key in part.value if key.endswith(".seconds_ratio")]
            if not builders:
                raise part.fault("has no figures: did the benchmark fail?")
            self.builders += [name for name in builders if name not in self.builders]
            self.cells[scene] = part
        self.builders.sort(key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER))
        if not self.cells:
            raise file.member("benchmarks").fault("no benchmark is of bench_builders")

    def figure(self, scene, builder, counter):
        return self.cells[scene].number(f"{builder}.{counter}", positive=True)

    def averaged_scenes(self):
        """@return the scenes from files. Without such scenes: procedural if it was measured, else all."""
        for scenes in [[s for s in self.cells if s not in GENERATED], [s for s in self.cells if s == "procedural"]]:
            if scenes:
                return scenes
        return list(self.cells)

    def kinds(self):
        """@return the kinds of rays that every scene has."""
        builder = self.builders[0]
        return [kind for kind in KINDS
                if all(f"{builder}.{kind}.time_ratio" in part.value for part in self.cells.values())]

    def mean(self, builder, counter):
        return geometric_mean(self.figure(scene, builder, counter) for scene in self.averaged_scenes())


def place_bars(axis, runs, series):
    """Draws groups of bars, one group per builder. series: (label, numbers in the order of the builders)."""
    width = 0.8 / len(series)
    for i, (label, numbers) in enumerate(series):
        axis.bar([at + (i - (len(series) - 1) / 2) * width for at in range(len(runs.builders))], numbers, width,
                 label=label)
    axis.set_xticks(range(len(runs.builders)))
    axis.set_xticklabels(runs.builders, rotation=45, ha="right")
    axis.grid(axis="y", linewidth=0.4)
    axis.set_axisbelow(True)


def mark_yardstick(axis):
    axis.axhline(1, color="black", linewidth=0.8)


def make_logarithmic(axis):
    axis.set_yscale("log")
    axis.yaxis.set_major_formatter(lambda value, _: f"{value:g}")


def plot_trace_times(plt, runs, folder):
    series = [(kind, [runs.mean(name, f"{kind}.time_ratio") for name in runs.builders]) for kind in runs.kinds()]
    series.append(("all", [runs.mean(name, "trace_time_ratio") for name in runs.builders]))
    figure, axis = plt.subplots(figsize=(10, 4))
    place_bars(axis, runs, series)
    mark_yardstick(axis)
    axis.set_ylabel("time relative to PLOC")
    axis.set_title(f"Averaged normalised trace times ({', '.join(runs.averaged_scenes())})", fontsize=10)
    axis.legend(fontsize=8, loc="lower right", framealpha=1)
    save(figure, folder, "builders_trace_times")
    plt.close(figure)


def plot_builds(plt, runs, folder):
    figure, (times, costs) = plt.subplots(1, 2, figsize=(12, 4))
    place_bars(times, runs, [("build", [runs.mean(name, "seconds_ratio") for name in runs.builders])])
    make_logarithmic(times)
    mark_yardstick(times)
    times.set_ylabel("build time relative to PLOC")
    place_bars(costs, runs, [("cost", [runs.mean(name, "sah_cost_ratio") for name in runs.builders])])
    mark_yardstick(costs)
    costs.set_ylabel("SAH cost relative to PLOC")
    figure.suptitle(f"Build times and SAH cost ({', '.join(runs.averaged_scenes())})", fontsize=10)
    figure.tight_layout()
    save(figure, folder, "builders_build_times_and_cost")
    plt.close(figure)


def plot_opera_house(plt, runs, folder):
    if "opera_house" not in runs.cells:
        return
    figure, axis = plt.subplots(figsize=(10, 4))
    place_bars(axis, runs, [(kind, [runs.figure("opera_house", name, f"{kind}.box_tests") for name in runs.builders])
                            for kind in runs.kinds()])
    make_logarithmic(axis)
    axis.set_ylabel("four-box tests per ray")
    axis.set_title("opera_house: rays at fine detail in a large hall", fontsize=10)
    axis.legend(fontsize=8, loc="lower right", framealpha=1)
    save(figure, folder, "builders_opera_house")
    plt.close(figure)


def plot_builders(plt, runs, folder):
    plot_trace_times(plt, runs, folder)
    plot_builds(plt, runs, folder)
    plot_opera_house(plt, runs, folder)
