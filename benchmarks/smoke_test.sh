#!/bin/bash
# smoke_test.sh SOURCE BUILD: runs benchmarks/run on a tiny scene. It fails if a program fails, if tracers disagree, or
# if a figure is missing. Times are not checked.
set -uo pipefail

# shellcheck source=tests/scripts/expect.sh
source "$(dirname "${BASH_SOURCE[0]}")/../tests/scripts/expect.sh"

source=$1
build=$2

expect 0 "" "$source/run" --quick "--build=$build" "--output=$work/results"
holds "$work/results/trace.json" side_by_side/procedural/{primary,ao,diffuse} geometric_mean/{procedural,scenes} \
  {embree_robust,embree_default,planes_sah,planes_high_fast,planes_sah_array,float_sah}.ratio planes_sah.box_tests \
  '"commit"' '"planes_sah.disagreements": 0.0'
holds "$work/results/build.json" build/procedural/threads_1 build/scattered/threads_1 validate/height_field \
  growth/{soup,concentric,cables,fan} hq.{growth,to_scattered} \
  {sah,embree-low,embree-medium,embree-high}.sah_cost_ratio rtc_medium_robust.Mtri_s sah.peak_to_output
holds "$work/results/builders.json" builders/procedural builders/opera_house '"commit"' \
  {sah,lbvh,lbvh30,ploc,hploc,sbvh,hq}.{seconds_ratio,sah_cost,nodes,trace_time_ratio} \
  embree-{low,medium,high}.{seconds_ratio,sah_cost,nodes,trace_time_ratio} \
  lbvh30.object_cost ploc.{primary,ao,diffuse}.Mrays_s hq.scratch_bytes_per_triangle '"build_threads"'
for name in trace_times build_times_and_cost opera_house; do
  file=$work/results/builders_$name.svg
  if python3 -c 'import matplotlib' 2>/dev/null && [[ ! -s $file ]]; then fault "no $file"; fi
done
holds "$work/results/summary.md" '## Builders' '| cost of the object |' '# Benchmarks of' '- command:' '## Tracing' \
  '## Building' '## Validation' '## Growth' '| planes_sah '

# The generated large scenes have the sizes that make_scene prints, and are valid.
for name in island stadium swarm; do
  expect 0 "" "$build/benchmarks/make_scene" "$name" "$work/scenes"
done
expect 2 "usage: make_scene" "$build/benchmarks/make_scene" moon "$work/scenes"
expect 0 "" "$build/benchmarks/make_scene" hair "$work/scenes" --strands 300
expect 2 "usage: make_scene" "$build/benchmarks/make_scene" hair "$work/scenes" --strands 0
expect 2 "usage: make_scene" "$build/benchmarks/make_scene" island "$work/scenes" --strands 5
expect 0 "" "$build/benchmarks/make_scene" swarm "$work/scenes/slow" --motion 10
expect 2 "usage: make_scene" "$build/benchmarks/make_scene" swarm "$work/scenes/slow" --motion 1001
expect 0 "" "$build/tools/bvhbuild" "$work/scenes/hair.hair" "$work/scenes/head.mesh" -o "$work/scenes/hair.bvh"
expect 0 "300 strands" "$build/benchmarks/bench_hair" --strands=300 --batch_strands=100
expect 0 "| procedural | around |" "$build/benchmarks/bench_points" --triangles=2000 --points=50 --rounds=1 \
  --scene=procedural
expect 2 "" "$build/benchmarks/bench_points" --rounds=0
expect 2 "no builder 'fast'" "$build/benchmarks/bench_hair" --builders=fast
expect 0 "" "$build/tools/bvhbuild" "$work/scenes/head.mesh" -o "$work/scenes/head.bvh"
expect 0 "| 32    |" "$build/benchmarks/ranks/bench_ranks" "--bvh=$work/scenes/head.bvh" --ranks=1,32 --samples=16 \
  --width=320 --height=180 "--json=$work/ranks.json"
expect 2 "--ranks=0: expected numbers" "$build/benchmarks/ranks/bench_ranks" "--bvh=$work/scenes/head.bvh" --ranks=0
expect 2 "--bvh=FILE is missing" "$build/benchmarks/ranks/bench_ranks"
expect 1 "none.bvh" "$build/benchmarks/ranks/bench_ranks" "--bvh=$work/none.bvh"
expect 1 "none.cam: cannot be read" "$build/benchmarks/ranks/bench_ranks" "--bvh=$work/scenes/head.bvh" \
  "--camera=$work/none.cam"
for name in island.scene stadium.mesh swarm.json swarm_still.json; do
  expect 0 "" "$build/tools/bvhbuild" "$work/scenes/$name" -o "$work/scenes/${name%.*}.bvh"
  expect 0 "" "$build/tools/bvhinfo" --validate "$work/scenes/${name%.*}.bvh"
  "$build/tools/bvhinfo" --json "$work/scenes/${name%.*}.bvh" >"$work/scenes/${name%.*}.info"
done
expect 0 "2100 segments of curves of type 1, 2400 points, 0 dropped" "$build/tools/bvhinfo" --validate \
  "$work/scenes/hair.bvh"
python3 - "$work/scenes" <<'PYTHON' || fault "a large scene is not what it should be"
import json, sys
scene = lambda name: json.load(open(f"{sys.argv[1]}/{name}.info"))["scene"]
island, swarm, still = scene("island"), scene("swarm"), scene("swarm_still")
assert island["triangles"]["unique"] >= 1_000_000 and island["triangles"]["instantiated"] >= 30_000_000_000, island
assert len(island["levels"]) == 3, island["levels"]
assert swarm["instances"]["moving"] == 10_000 and still["instances"]["moving"] == 0, (swarm, still)
PYTHON

part_ranks=$build/benchmarks/ranks/bench_part_ranks
mkdir "$work/parts"
expect 0 "" "$build/tools/bvhbuild" "$work/scenes/swarm_still.json" --parts 2 -o "$work/parts/swarm.json"
expect 0 "| 64 " "$part_ranks" "--bvhrender=$work/parts/swarm.json --integrator path --size 32x32 --spp 4" --steps=1 \
  --ranks=2,64 "--json=$work/part_ranks.json"
expect 2 "--bvhrender=WORDS is missing" "$part_ranks"
expect 2 "--ranks=10001: expected numbers from 1 to 10000" "$part_ranks" --bvhrender=none.json --ranks=10001
expect 1 "cannot open '$work/none.json'" "$part_ranks" "--bvhrender=$work/none.json --integrator path"
large=$source/large_scenes.py
expect 0 "" python3 -B "$large" "$work/scenes" --tools "$build/tools" --output "$work/large" --scene hair,swarm \
  --size 32x18 --spp 1
holds "$work/large/large_scenes.md" '| hair | 0 | 2100 | 2100 |' '| swarm | 1 | 6144 | 6.144e+07 |' '- commit: '
holds "$work/large/large_scenes.json" '"peak_bytes"' '"mrays_per_second"'
expect 1 "no scene 'moon' with a camera" python3 -B "$large" "$work/scenes" --tools "$build/tools" \
  --output "$work/large" --scene moon
expect 1 "cannot be started" python3 -B "$large" "$work/scenes" --tools "$work" --output "$work/large" --scene swarm
expect 2 "see --help" python3 -B "$large" "$work/scenes"
cp "$work/scenes/swarm.cam" "$work/scenes/broken.cam"
echo '{' >"$work/scenes/broken.json"
expect 1 "broken: $build/tools/bvhbuild" python3 -B "$large" "$work/scenes" --tools "$build/tools" \
  --output "$work/other" --scene broken,hair --size 8x8 --spp 1
holds "$work/other/large_scenes.md" '| hair | 0 | 2100 | 2100 |'
rm "$work/scenes/broken".*

expect 1 "" "$source/run" --quick "--build=$build" "--output=$work/results"
expect 2 "" "$source/run" --unknown
expect 2 "'nothing': expected trace, build or builders" "$source/run" --only=trace,nothing
plot=$source/plot_builders.py
expect 1 "no benchmark is of bench_builders" python3 -B "$plot" "$work/results/build.json" --output "$work/none"
expect 1 "cannot be read" python3 -B "$plot" "$work/missing.json" --output "$work/none"
printf '{"benchmarks": [{"name": "builders/x"}]}' >"$work/failed.json"
expect 1 "has no figures" python3 -B "$plot" "$work/failed.json" --output "$work/none"
expect 2 "see --help" python3 -B "$plot"
if [[ -e $work/none ]]; then fault "a refused file left something"; fi
for program in bench_trace bench_build bench_builders; do
  expect 0 "" "$build/benchmarks/$program" --help
  expect 2 "" "$build/benchmarks/$program" --unknown
  expect 2 "" "$build/benchmarks/$program" --rounds=0
  expect 2 "" "$build/benchmarks/$program" --scenes
  expect 2 "" "$build/benchmarks/$program" --scene=procedural, --benchmark_list_tests
  expect 2 "" "$build/benchmarks/$program" "--scenes=$work" --scene=missing
  expect 1 "" "$build/benchmarks/$program" --benchmark_filter=nothing
done
# If a scene has no ray files, its rays come from its camera.
python3 -c 'import struct, sys
sys.stdout.buffer.write(struct.pack("<2I9f3I", 3, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 2))' >"$work/seen.mesh"
expect 1 "no rays" "$build/benchmarks/bench_builders" "--scenes=$work" --scene=seen --rounds=1
echo 'eye 0.3 0.3 3 / at 0.3 0.3 0 / up 0 1 0 / 40' >"$work/seen.cam"
expect 0 "### seen, 1 triangles" "$build/benchmarks/bench_builders" "--scenes=$work" --scene=seen --rounds=1 --rays=100
echo 'eye 0.3' >"$work/seen.cam"
expect 1 "seen.cam: " "$build/benchmarks/bench_builders" "--scenes=$work" --scene=seen --rounds=1
# Files that exist but are damaged.
printf 'damaged' >"$work/bad.mesh"
: >"$work/bad.primary.rays"
expect 1 "" "$build/benchmarks/bench_trace" "--scenes=$work" --scene=bad
expect 1 "" "$build/benchmarks/bench_build" "--scenes=$work" --scene=bad --validation-triangles=1000 \
  --scattered-triangles=1000 --growth-triangles=400

end
