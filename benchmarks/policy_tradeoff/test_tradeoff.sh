#!/bin/bash
# test_tradeoff.sh SOURCE BUILD: runs benchmarks/tradeoff with few rays, and checks its plots and wrong command lines.
# Times are not checked.
set -uo pipefail

# shellcheck source=tests/scripts/expect.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../tests/scripts/expect.sh"

source=$1
build=$2
program=$build/benchmarks/policy_tradeoff/bench_tradeoff

expect 0 "Results: $work/results" "$source/tradeoff" --quick "--build=$build" "--output=$work/results"
holds "$work/results/tradeoff.json" '"commit"' '"broken_guarantees": []' '"subject": "reference (fast-math)"' \
  '"subject": "Embree robust"' '"question": "boxes"' '"origin": "spawn_origin"' '"case": "needles 6e7"' \
  '"beyond_bound": 0' '"place": "16 levels"' '"subject": "double"'
holds "$work/results/tradeoff.md" '# Speed and accuracy' '## Speed' '| default/quantized ' '## Faults' '## Spawned' \
  '## Errors' '## Instances and motion' '## Builders' '| lbvh30 '
expect 0 "" "$program" --policies=default --questions=edges --aimed=1000 "--markdown=$work/edges.md"
holds "$work/edges.md" '## Faults' '| default '
for title in Speed Spawned Errors Instances; do
  if grep -q "## $title" "$work/edges.md"; then fault "edges.md: '$title' without rows"; fi
done
if python3 -c 'import matplotlib' 2>/dev/null; then
  for name in leaks random_leaks boxes spawned wrong t point; do
    if [[ ! -s $work/results/pareto_$name.svg ]]; then fault "no pareto_$name.svg"; fi
  done
fi
expect 1 "$work/results exists already" "$source/tradeoff" --quick "--build=$build" "--output=$work/results"
expect 2 "--device=tpu: expected cpu or gpu" "$source/tradeoff" --device=tpu
expect 2 "unknown argument 'x'" "$source/tradeoff" x
expect 2 "--build and --program" "$source/tradeoff" --build=a --program=b
expect 0 "usage: benchmarks/tradeoff" "$source/tradeoff" --help
expect 0 "usage: bench_tradeoff" "$program" --help
expect 2 "unknown argument 'x'" "$program" x
expect 2 "--policies: no policy set 'exact'" "$program" --policies=default,exact
expect 2 "--rounds=0: expected a number from 1 to 1000" "$program" --rounds=0
expect 1 "$work/none/x.json" "$program" "--json=$work/none/x.json"
printf '{"format": "another"}' >"$work/other.json"
expect 1 "the format is 'another'" python3 -B "$source/plot_tradeoff.py" "$work/other.json" "--output=$work/plots"
expect 1 "not JSON of bench_tradeoff" python3 -B "$source/plot_tradeoff.py" "$source/tradeoff" "--output=$work/plots"
expect 1 "cannot be read" python3 -B "$source/plot_tradeoff.py" "$work/none.json" "--output=$work/plots"
if [[ -e $work/plots ]]; then fault "plots of nothing"; fi

end
