"""Results of bench_evaluation."""

import shlex
import statistics

from variant_report.json_file import load
from variant_report.ray_cores import without_ray_cores

FORMAT = "hiprt bench_evaluation 1"
KINDS = ["primary", "secondary", "shadow"]
HIERARCHIES = {"flat": "flat", "two_level": "two-level", "deep": "deep"}
# How a peer's hit differs from ours: the key in JSON and the words.
DISAGREEMENTS = {"found": "hit or miss", "distance": "other distance", "instance": "other instance",
                 "primitive": "other triangle"}
# The builder that others are compared with.
YARDSTICK = "ploc"
# Flags that do not affect the measurements.
OUTPUTS = ("--json=", "--markdown=")


def tracer_name(tracer, builder):
    """@return "ploc", "Embree robust" or "Vulkan, fast trace"."""
    if tracer == "vulkan":
        return f"Vulkan, {builder.replace('_', ' ')}"
    return builder if tracer == "hiprt" else f"Embree {builder}"


class Entry:
    """One builder's BVHs of one hierarchy, and the rays through them."""

    def __init__(self, part, waves):
        self.tracer = part.name("tracer")
        self.builder = part.name("builder")
        self.hierarchy = part.name("form")
        build = part.member("build")
        self.build_seconds = build.number("seconds", positive=True)
        self.object_seconds = build.number("object_seconds")
        self.instance_seconds = build.number("instance_seconds")
        # Whether the CPU built the tree that a GPU traces.
        self.cpu_build = "built_by" in build.value and build.name("built_by") == "cpu"
        self.bytes = part.number("bytes")
        self.sah_cost = None if part.member("sah_cost").value is None else part.number("sah_cost", positive=True)
        self.waves = {}
        self.rounds = {}
        self.differing = self.inexact = 0
        self.disagreements = {}  # Of Vulkan's modes.
        for wave in part.members("waves"):
            name = wave.name("name")
            if name not in waves:
                raise wave.fault(f"no wave of the scene is called {name!r}")
            self.waves[name] = wave.number("seconds", positive=True)
            self.rounds[name] = [round_.expect("a number") for round_ in wave.members("rounds")]
            if not self.rounds[name]:
                raise wave.member("rounds").fault("nothing was measured")
            self.differing += wave.number("differing_rays")
            self.inexact += wave.number("inexact_rays")
            for kind in DISAGREEMENTS if "disagreements" in wave.value else ():
                count = wave.member("disagreements").number(kind)
                self.disagreements[kind] = self.disagreements.get(kind, 0) + count
        for name in waves:
            if name not in self.waves:
                raise part.fault(f"has no wave {name!r}")

    def name(self):
        return tracer_name(self.tracer, self.builder) + (" (CPU)" if self.cpu_build else "")

    def key(self):
        return (self.tracer, self.builder)

    def sample_seconds(self):
        """@return the time of all waves of one sample per pixel."""
        return sum(self.waves.values())

    def round_seconds(self):
        """@return the same for each round."""
        return [sum(rounds) for rounds in zip(*self.rounds.values())]

    def image_seconds(self, samples):
        return self.build_seconds + samples * self.sample_seconds()


class Scene:
    def __init__(self, part):
        self.name = part.name("name")
        if not self.name.replace("_", "").replace("-", "").replace(".", "").isalnum():
            raise part.member("name").fault(f"{self.name!r} cannot be part of a file's name")
        self.source = part.name("source")
        self.light = part.name("light")
        self.hierarchies = {
            hierarchy.name("name"): {key: hierarchy.number(key) for key in ["levels", "triangles", "instances"]}
            for hierarchy in part.members("forms")}
        self.waves = {}
        for wave in part.members("waves"):
            kind = wave.name("kind")
            if kind not in KINDS:
                raise wave.member("kind").fault(f"{kind!r} is none of {', '.join(KINDS)}")
            self.waves[wave.name("name")] = {"kind": kind, "rays": wave.number("rays", positive=True),
                                             "hits": wave.number("hits")}
        self.entries = [Entry(entry, self.waves) for entry in part.members("entries")]
        for entry, place in zip(self.entries, part.members("entries")):
            if entry.hierarchy not in self.hierarchies:
                raise place.member("form").fault(f"the scene has no hierarchy {entry.hierarchy!r}")
        self.missing = [{key: missing.text(key) for key in ["tracer", "builder", "form", "why"]}
                        for missing in part.members("missing")]
        if not self.entries or not self.waves:
            raise part.fault("nothing was measured")

    def of_hierarchy(self, hierarchy):
        return [entry for entry in self.entries if entry.hierarchy == hierarchy]

    def entry(self, hierarchy, builder, tracer="hiprt"):
        """@return None if it was not measured."""
        return next((e for e in self.of_hierarchy(hierarchy) if e.key() == (tracer, builder)), None)

    def vulkan(self, hierarchy):
        return [entry for entry in self.of_hierarchy(hierarchy) if entry.tracer == "vulkan"]

    def kinds(self):
        return [kind for kind in KINDS if any(wave["kind"] == kind for wave in self.waves.values())]

    def wave_names(self, kind):
        return [name for name, wave in self.waves.items() if wave["kind"] == kind]

    def rays(self, kind=None):
        return sum(wave["rays"] for wave in self.waves.values() if kind in (None, wave["kind"]))

    def seconds(self, entry, kind):
        """@return the seconds of all waves of a kind."""
        return sum(entry.waves[name] for name in self.wave_names(kind))

    def wave_seconds(self, entry, kind):
        """@return the average seconds of a wave of a kind."""
        return self.seconds(entry, kind) / len(self.wave_names(kind))

    def mrays_s(self, entry, kind):
        return 1e-6 * self.rays(kind) / self.seconds(entry, kind)


class Evaluation:
    """A file of bench_evaluation."""

    def __init__(self, path):
        file = load(path, FORMAT, "bench_evaluation")
        self.path = path
        self.commit, self.date = file.name("commit"), file.name("date")
        self.command = " ".join(word for word in file.name("command").split() if not word.startswith(OUTPUTS))
        machine, device, versions = (file.member(key) for key in ["machine", "device", "versions"])
        self.cpu, self.system = machine.name("cpu"), machine.name("system")
        load_average = machine.member("load_average").value
        self.load = [round(value, 2) for value in load_average] if isinstance(load_average, list) else []
        self.device, self.device_name = device.name("kind"), device.name("name")
        self.threads, self.isa = device.number("threads"), device.name("instruction_set")
        self.versions = {key: versions.name(key) for key in ["compiler", "hiprt", "embree"]}
        picture, rounds = file.member("picture"), file.member("rounds")
        self.width, self.height = picture.number("width", positive=True), picture.number("height", positive=True)
        self.build_rounds, self.trace_rounds = rounds.number("build"), rounds.number("trace")
        self.vulkan = None
        if "vulkan" in file.value:
            vulkan = file.member("vulkan")
            self.vulkan = {key: vulkan.name(key) for key in ["device", "driver", "calls"]}
        self.scenes = [Scene(part) for part in file.members("scenes")]
        self.faults = [fault.expect("text") for fault in file.members("faults")]
        names = [scene.name for scene in self.scenes]
        if not names:
            raise file.member("scenes").fault("nothing was measured")
        if len(set(names)) != len(names):
            raise file.member("scenes").fault("a scene is there twice")

    def device_note(self):
        """@return what stands beside every figure: " (no RT cores)" for a GPU without them, else nothing."""
        return " (no RT cores)" if self.device == "gpu" and without_ray_cores(self.device_name) else ""

    def hierarchies(self):
        return [hierarchy for hierarchy in HIERARCHIES if any(scene.of_hierarchy(hierarchy) for scene in self.scenes)]

    def names(self):
        """@return (tracer, builder) and its name, in the order of the command line."""
        found = {entry.key(): entry.name() for scene in self.scenes for entry in scene.entries}
        return dict(sorted(found.items(), key=lambda item: item[0][0] != "hiprt"))

    def command_of(self, scene):
        """@return the command that measures one scene."""
        words = [word for word in self.command.split() if not word.startswith("--scene=")]
        return " ".join([*words, f"--scene={shlex.quote(scene.name)}"])


def quartiles(values):
    """@return the lower and the upper quartile."""
    if len(values) < 2:
        return values[0], values[0]
    first, _, third = statistics.quantiles(values, n=4, method="inclusive")
    return first, third
