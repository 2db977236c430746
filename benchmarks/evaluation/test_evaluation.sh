#!/bin/bash
# test_evaluation.sh BENCHMARKS BUILD RESULTS: runs evaluate on generated scenes. The results stay in RESULTS. It fails
# if a builder, form, wave or figure is missing, or if a ray has another result. Times are not checked.
set -uo pipefail

# shellcheck source=tests/scripts/expect.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../tests/scripts/expect.sh"

source=$1 build=$2 results=$3
program=$build/benchmarks/evaluation/bench_evaluation

rm -rf "$results"
expect 0 "Results: $results" "$source/evaluate" --quick "--build=$build" "--output=$results" --commit=abc
# In a pipe it prints only the folder of the results.
if [[ $output != "Results: $results" ]]; then fault "evaluate says: $output"; fi
python3 - "$results" <<'PYTHON' || fault "evaluation.json is not what it should be"
import json, sys
data = json.load(open(f"{sys.argv[1]}/evaluation.json"))
assert data["format"] == "hiprt bench_evaluation 1" and data["commit"] == "abc" and data["faults"] == [], data["faults"]
assert [scene["name"] for scene in data["scenes"]] == ["procedural", "stadium", "island"]
for scene in data["scenes"]:
    forms = {form["name"]: form for form in scene["forms"]}
    ours = ["lbvh", "ploc", "hploc", "sah", "sbvh", "hq"]
    expected = [(tracer, builder, form) for form in forms
                for tracer, builders in [("hiprt", ours), ("embree", ["default", "high", "robust"])]
                for builder in builders
                if (tracer, form) != ("embree", "deep")]
    assert [(e["tracer"], e["builder"], e["form"]) for e in scene["entries"]] == expected, scene["name"]
    waves = {wave["name"]: wave for wave in scene["waves"]}
    every = ["primary", "shadow 0", "bounce 1", "shadow 1", "bounce 2", "shadow 2"]
    # Under the open sky hardly any ray hits again.
    assert list(waves) == every[:max(4, len(waves))] and (len(waves) == 6 or scene["name"] != "stadium"), list(waves)
    assert waves["primary"]["rays"] == 64 * 36 and waves["primary"]["hits"] == waves["shadow 0"]["rays"] > 500
    assert waves["bounce 1"]["rays"] == waves["shadow 0"]["rays"]
    assert waves["shadow 1"]["rays"] == waves["bounce 1"]["hits"]
    assert (forms["flat"]["levels"], forms["two_level"]["levels"]) == (0, 1)
    for entry in scene["entries"]:
        build = entry["build"]
        assert build["seconds"] > 0 and entry["bytes"] > 0 and len(build["rounds"]) == 1
        assert (build["instance_seconds"] > 0) == (entry["form"] != "flat"), entry["form"]
        assert (entry["sah_cost"] is not None) == (entry["tracer"] == "hiprt" and entry["form"] == "flat")
        for wave in entry["waves"]:
            assert wave["seconds"] > 0 and len(wave["rounds"]) == 2 and wave["inexact_rays"] == 0
            assert wave["differing_rays"] <= 3e-4 * waves[wave["name"]]["rays"] + 2, (entry["builder"], wave)
island = data["scenes"][2]
assert {form["name"]: form["levels"] for form in island["forms"]} == {"flat": 0, "two_level": 1, "deep": 3}
assert [(m["tracer"], m["form"]) for m in island["missing"]] == 3 * [("embree", "deep")], island["missing"]
PYTHON
holds "$results/summary.md" '- commit: abc' '## island' '| embree |  robust |' \
  'Not measured: embree high deep: 3 levels'
holds "$results/report.html" '<title>hiprt: evaluation on' 'Crossover: samples per pixel' \
  'All results of hiprt are right'
expect 1 "exists already" "$source/evaluate" --quick "--build=$build" "--output=$results"
expect 2 "unknown argument '--unknown'" "$source/evaluate" --unknown
expect 2 "expected cpu or gpu" "$source/evaluate" --device=tpu
expect 2 "exclude each other" "$source/evaluate" --build=a --program=b
expect 2 "'octree' is none of" "$source/evaluate" --quick "--build=$build" "--output=$work/none" -- --builders=octree
expect 0 "usage: benchmarks/evaluate" "$source/evaluate" --help

# Ten scenes: those of the folder are used, the others are generated or named.
python3 -c 'import struct, sys
mesh = struct.pack("<2I9f3I", 3, 1, -9, -9, 0, 9, -9, 0, 0, 9, 0, 0, 1, 2)
for name in ["sponza", "bedroom", "town", "orchard"]:
    open(f"{sys.argv[1]}/{name}.mesh", "wb").write(mesh)
    open(f"{sys.argv[1]}/{name}.cam", "w").write("eye 0 0 3 / at 0 0 0 / up 0 1 0 / 40")' "$work"
expect 0 "scenes that are not there: livingroom bistro_ext legofalcon" "$source/evaluate" --ten --quick \
  "--build=$build" "--scenes=$work" "--output=$work/ten" -- --hierarchies=two_level --builders=ploc --peers=none
python3 -c 'import json, sys
names = [scene["name"] for scene in json.load(open(sys.argv[1]))["scenes"]]
assert names == ["procedural", "stadium", "island", "sponza", "bedroom", "town", "orchard"], names' \
  "$work/ten/evaluation.json" || fault "ten scenes"
if [[ ! -s $work/ten/all.normalised.svg || ! -s $work/ten/town.trace_times.svg ]]; then fault "plots of ten scenes"; fi
rm "$work"/{sponza,bedroom,town,orchard}.{mesh,cam}

# A packed program needs no other files, and finds the libraries beside it.
expect 0 "Packed: " "$source/evaluate" "--pack=$work/pack" "--build=$build"
if ! compgen -G "$work/pack/lib/libembree[34].so.[34]" >/dev/null || [[ -e $work/pack/lib/libc.so.6 ]]; then
  fault "packed: $(ls "$work/pack/lib")"
fi
small=(--scene=procedural --triangles=1000 --width=16 --height=9 --rounds=1 --build-rounds=1)
expect 0 "Results: $work/packed" "$source/evaluate" "--program=$work/pack/bench_evaluation" "--output=$work/packed" \
  -- "${small[@]}" --peers=none --builders=ploc --hierarchies=two_level
expect 1 "exists already" "$source/evaluate" "--pack=$work/pack" "--build=$build"

expect 0 "flat: flattened it has [0-9]* triangles, the limit is 2000" "$program" --scene=island --triangles=1000 \
  --instances=8 --width=8 --height=8 --rounds=1 --build-rounds=1 --most-triangles=2000 --builders=lbvh --peers=none
# Messages of the program itself.
expect 0 "usage: bench_evaluation" "$program" --help
expect 2 "unknown argument 'x'" "$program" x
expect 2 "--device=tpu: expected cpu or gpu" "$program" --device=tpu
expect 2 "'robust' is there twice" "$program" --peers=robust,robust
expect 2 "--hierarchies=cubic: 'cubic' is none of flat,two_level,deep" "$program" --hierarchies=cubic
expect 2 "--rounds=0: expected a number from 1 to 1000" "$program" --rounds=0
expect 2 "found neither" "$program" --scene=moon "--scenes=$work"
expect 2 "no NAME.cam with" "$program" "--scenes=$work"
expect 1 "$work/none/x.json" "$program" "${small[@]}" "--json=$work/none/x.json"
# Scenes from files: a mesh with a light, one whose camera is wrong, and one without.
python3 -c 'import struct, sys
sys.stdout.buffer.write(struct.pack("<2I9f3I", 3, 1, -9, -9, 0, 9, -9, 0, 0, 9, 0, 0, 1, 2))' >"$work/seen.mesh"
expect 1 "seen.cam: the scene's camera cannot be read" "$program" --scene=seen "--scenes=$work" --width=16 --height=9
echo 'eye 0 0 3 / at 0 0 0 / up 0 1 0 / 40 / light 0 0' >"$work/seen.cam"
expect 1 "seen.cam: light: expected 3 numbers" "$program" --scene=seen "--scenes=$work" --width=16 --height=9
echo 'eye 0 0 3 / at 0 0 0 / up 0 1 0 / 40 / light 0 0 5' >"$work/seen.cam"
expect 0 "## seen" "$program" "--scenes=$work" --width=16 --height=9 --rounds=1 --build-rounds=1 \
  "--json=$work/seen.json"
holds "$work/seen.json" '"light": "point"' '"source": "seen.mesh"' '"name": "shadow 0"'
if grep -q '"shadow 1"' "$work/seen.json"; then fault "rays that leave a triangle hit it"; fi
printf 'damaged' >"$work/seen.scene"
expect 1 "seen.scene: not a .scene file" "$program" --scene=seen "--scenes=$work"
if ! "$program" --device=gpu "${small[@]}" >/dev/null 2>"$work/gpu"; then holds "$work/gpu" '--device=gpu: '; fi

end
