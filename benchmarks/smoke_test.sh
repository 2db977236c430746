#!/bin/bash
# smoke_test.sh SOURCE BUILD: benchmarks/run on a tiny scene. It fails when a program fails, when tracers disagree, or when
# a figure is missing. No time is judged.
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
  {sah,embree-low,embree-medium,embree-high}.sah_cost_ratio rtc_medium_robust.Mtri_s sah.peak_to_output
holds "$work/results/summary.md" '# Benchmarks of' '- command:' '## Tracing' '## Building' '## Validation' '| planes_sah '

expect 1 "" "$source/run" --quick "--build=$build" "--output=$work/results"
expect 2 "" "$source/run" --unknown
for program in bench_trace bench_build; do
  expect 0 "" "$build/benchmarks/$program" --help
  expect 2 "" "$build/benchmarks/$program" --unknown
  expect 2 "" "$build/benchmarks/$program" --rounds=0
  expect 2 "" "$build/benchmarks/$program" --scenes
  expect 2 "" "$build/benchmarks/$program" --scene=procedural, --benchmark_list_tests
  expect 2 "" "$build/benchmarks/$program" "--scenes=$work" --scene=missing
  expect 1 "" "$build/benchmarks/$program" --benchmark_filter=nothing
done
# Files that are there but wrong.
printf 'damaged' >"$work/bad.mesh"
: >"$work/bad.primary.rays"
expect 1 "" "$build/benchmarks/bench_trace" "--scenes=$work" --scene=bad
expect 1 "" "$build/benchmarks/bench_build" "--scenes=$work" --scene=bad --validation-triangles=1000 \
  --scattered-triangles=1000

end
