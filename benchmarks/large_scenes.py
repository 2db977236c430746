#!/usr/bin/env python3
"""Builds, validates and renders large scenes with the tools, and tabulates time and memory. See --help."""

import datetime
import json
import os
import platform
import subprocess
import sys
import tempfile
import time

from variant_report.json_file import InputError
from variant_report.markdown import number, table
from variant_report.script import Parser, run_script, write_together

DESCRIPTION = """Builds (bvhbuild), validates (bvhinfo --validate) and renders (bvhrender, ambient occlusion) every
NAME.scene, NAME.json, NAME.hair or NAME.mesh of a folder that has a NAME.cam. make_scene generates such scenes: island,
stadium, swarm, hair. Writes large_scenes.json and large_scenes.md to a folder: unique and instantiated triangles and
segments, bytes of the file, peak memory and seconds of each program, and rays per second. The CPU builds scenes that
the GPU does not support (curves and spheres); the table says so. Exit status: 0; 1 when something fails or is
interrupted (finished scenes are written); 2 for a wrong argument."""

ENDINGS = (".scene", ".json", ".hair", ".mesh")
MIB = 1 << 20


def run_tool(tools, name, *arguments):
    """@return standard output, seconds, peak memory in bytes."""
    command = [os.path.join(tools, name), *arguments]
    start = time.monotonic()
    with tempfile.TemporaryFile() as errors:
        try:
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors)
        except OSError as error:
            raise InputError(f"{command[0]}: cannot be started: {error.strerror}") from error
        printed = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.monotonic() - start
        if process.returncode != 0:
            errors.seek(0)
            raise InputError(f"{' '.join(command)}: exit status {process.returncode}: "
                             f"{errors.read().decode(errors='replace').strip()}")
    return printed.decode(), seconds, usage.ru_maxrss * 1024


def run_on(device, tools, name, *arguments):
    """As run_tool(), but on the CPU if the device does not support the scene."""
    try:
        return run_tool(tools, name, *arguments, "--device", device)
    except InputError:
        if device == "cpu":
            raise
        return run_tool(tools, name, *arguments, "--device", "cpu")


def find_scenes(folder, only):
    try:
        names = sorted(os.listdir(folder))
    except OSError as error:
        raise InputError(f"{folder}: cannot be read: {error.strerror}") from error
    scenes = {}
    for ending in ENDINGS:
        for name in names:
            stem = name[:-len(ending)]
            if name.endswith(ending) and stem + ".cam" in names and (not only or stem in only):
                scenes.setdefault(stem, os.path.join(folder, name))
    for name in only:
        if name not in scenes:
            raise InputError(f"{folder}: no scene '{name}' with a camera")
    if not scenes:
        raise InputError(f"{folder}: no scene with a camera")
    return scenes


def counts_of(info):
    """@return unique primitives, instantiated primitives, levels of instances."""
    scene = info.get("scene")
    if scene is None:
        once = info["triangles"] + info["customs"]
        return once, once, 0
    once = scene["triangles"]["unique"] + scene["customs"]["unique"]
    often = scene["triangles"]["instantiated"] + scene["customs"]["instantiated"]
    return once, often, len(scene["levels"])


def measure(arguments, name, source, work):
    file = os.path.join(work, name + ".bvh")
    camera = os.path.splitext(source)[0] + ".cam"
    options = ["--builder", arguments.builder] if arguments.builder else []
    options += arguments.build_option
    built, build_seconds, build_memory = run_on(arguments.device, arguments.tools, "bvhbuild", source, "-o", file,
                                                "--json", *options)
    built = json.loads(built)
    info, check_seconds, check_memory = run_tool(arguments.tools, "bvhinfo", "--validate", "--json", file)
    once, often, levels = counts_of(json.loads(info))
    rendered, render_seconds, render_memory = run_on(
        arguments.device, arguments.tools, "bvhrender", file, "-o", os.path.join(work, name + ".png"), "--json",
        "--camera", camera, "--size", arguments.size, "--spp", str(arguments.spp))
    rendered = json.loads(rendered)
    bytes_of_file = os.path.getsize(file)
    os.remove(file)
    return {"scene": name, "builder": built["builder"], "built_by": built["device"], "primitives": once,
            "instantiated": often, "levels": levels, "bytes": bytes_of_file,
            "build": {"seconds": build_seconds, "peak_bytes": build_memory},
            "validate": {"seconds": check_seconds, "peak_bytes": check_memory},
            "render": {"device": rendered["device"], "device_name": rendered["device_name"],
                       "seconds": rendered["seconds"], "seconds_of_program": render_seconds,
                       "peak_bytes": render_memory, "mrays_per_second": rendered["mrays_per_second"]}}


def markdown_of(record):
    head = ["scene", "levels", "primitives", "in instances", "file MiB", "built by", "build s", "build MiB",
            "validate s", "validate MiB", "rendered by", "render s", "Mrays/s", "render MiB"]
    rows = []
    for row in record["scenes"]:
        build, check, render = row["build"], row["validate"], row["render"]
        rows.append([row["scene"], row["levels"], row["primitives"], f"{row['instantiated']:.4g}",
                     number(row["bytes"] / MIB, 1), f"{row['builder']}, {row['built_by']}", number(build["seconds"]),
                     number(build["peak_bytes"] / MIB, 0), number(check["seconds"]),
                     number(check["peak_bytes"] / MIB, 0), render["device"], number(render["seconds"]),
                     number(render["mrays_per_second"], 1), number(render["peak_bytes"] / MIB, 0)])
    return (f"# Large scenes, {record['date']}\n\n- machine: {record['machine']}, {record['threads']} threads\n"
            f"- commit: {record['commit']}\n- command: `{record['command']}`\n\n"
            "Seconds are those of whole programs, with reading and writing; for rendering, those of the picture. MiB: "
            "the largest resident memory of the program (of the host).\n\n" + table(head, rows))


def main():
    parser = Parser(prog="large_scenes.py", description=DESCRIPTION)
    parser.add_argument("scenes", help="folder of scenes")
    parser.add_argument("--tools", required=True, help="folder of bvhbuild, bvhinfo and bvhrender")
    parser.add_argument("--output", required=True, help="folder for the results")
    parser.add_argument("--scene", default="", help="scenes of that folder: NAME,... (all)")
    parser.add_argument("--device", choices=["cpu", "gpu"], default="cpu", help="device that builds and renders (cpu)")
    parser.add_argument("--size", default="1920x1080", help="size of the pictures (1920x1080)")
    parser.add_argument("--spp", type=int, default=16, help="samples per pixel (16)")
    parser.add_argument("--builder", default="", help="builder of bvhbuild (its default)")
    parser.add_argument("--build-option", action="append", default=[], metavar="OPTION",
                        help="option of bvhbuild, such as --build-option=--levels=1; may be repeated")
    parser.add_argument("--commit", default="", help="commit of the tools (git describe)")
    arguments = parser.parse_args()

    def commit():
        if arguments.commit:
            return arguments.commit
        told = subprocess.run(["git", "describe", "--always", "--dirty"],
                              cwd=os.path.dirname(os.path.abspath(__file__)), capture_output=True, text=True,
                              check=False)
        return told.stdout.strip() or "unknown"

    def work():
        scenes = find_scenes(arguments.scenes, [name for name in arguments.scene.split(",") if name])
        record = {"date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"),
                  "machine": platform.machine(), "threads": len(os.sched_getaffinity(0)), "commit": commit(),
                  "command": " ".join(["large_scenes.py", *sys.argv[1:]]), "scenes": []}
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
        if names:
            record["machine"] = names[0]
        faults = []
        with tempfile.TemporaryDirectory(prefix="large_scenes-") as folder:
            for name, source in scenes.items():
                if sys.stderr.isatty():
                    print(f"large_scenes: {name}", file=sys.stderr)
                try:
                    record["scenes"].append(measure(arguments, name, source, folder))
                except InputError as error:
                    faults.append(f"{name}: {error}")
                except KeyboardInterrupt:
                    faults.append(f"interrupted at {name}")
                    break

        def write(folder):
            for file, text in [("large_scenes.json", json.dumps(record, indent=1) + "\n"),
                               ("large_scenes.md", markdown_of(record))]:
                with open(os.path.join(folder, file), "w", encoding="utf-8") as out:
                    out.write(text)

        if record["scenes"]:
            write_together("large_scenes", arguments.output, write)
        if faults:
            raise InputError("; ".join(faults))

    return run_script("large_scenes", work)


if __name__ == "__main__":
    sys.exit(main())
