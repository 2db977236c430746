#!/bin/bash
# test_plot.sh BENCHMARKS: plot_variants.py on figures that are made up as multiples of HIPRT's.
set -uo pipefail

source=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
faults=0

fault() {
  echo "FAILED: $*"
  faults=$((faults + 1))
}
# expect STATUS COMMAND...: keeps the output in $output.
expect() {
  local status=$1 actual
  shift
  output=$("$@" 2>&1)
  actual=$?
  if [[ $actual -ne $status ]]; then fault "$*: exit status $actual (wanted $status):"$'\n'"$output"; fi
}
# holds TEXT...: in the summary.
holds() {
  local text
  for text in "$@"; do
    if ! grep -qF -- "$text" "$work/out/variants.md"; then fault "variants.md does not hold '$text'"; fi
  done
}

plot=$source/plot_variants.py
expect 0 python3 -B "$plot" "$source/microbench/test_data/made_up.json" --output "$work/out"
holds 'Made-up GPU, commit 0000000' '**wrong result**: sponza.planes primary: made up' \
  '| planes accurate private batch16 usual masks 64x14 | 5 | 2.000 |' \
  '| sponza primary | 5926 | 2.00 | 3.80 | 1.31 |' '| **geometric mean of 5 cells** |  | **2.00** |' \
  '| planes accurate private batch16 usual masks 64x14 | 80/80 | 72/72 | 1.250 |' \
  '| planes accurate private batch16 usual filter 64x14 | masks | 80/80 | 84/84 | 0.950 |' \
  'median 3.0%' 'HIPRT 3.1 SBVH: ' '| sponza primary all | 1482 |  |  |  |'
# A variant that answered otherwise has no speed.
if grep -q postponed <(grep '^| planes' "$work/out/variants.md"); then fault "a wrong variant is in a table"; fi

plots=(variants_sponza accuracy_cost speed_and_memory)
for name in "${plots[@]}"; do
  for extension in png svg; do
    file=$work/out/$name.$extension
    if python3 -c 'import matplotlib' 2>/dev/null; then
      if [[ ! -s $file ]]; then fault "no $file"; fi
    elif [[ -e $file || $output != *"no matplotlib here"* ]]; then
      fault "without matplotlib: $output"
    fi
  done
done

expect 1 python3 -B "$plot" "$work/missing.json"
echo '{}' >"$work/empty.json"
expect 1 python3 -B "$plot" "$work/empty.json"
if [[ $output != *"empty.json: not a file of bench_variants"* ]]; then fault "of an empty object: $output"; fi
expect 2 python3 -B "$plot"

echo "$faults faults"
exit $((faults != 0))
