#!/bin/bash
# test_plot.sh BENCHMARKS: runs plot_variants.py on made-up figures, which are multiples of HIPRT's. Checks what run_gpu
# stores for a program that prints these figures.
set -uo pipefail

# shellcheck source=tests/scripts/expect.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../tests/scripts/expect.sh"

source=$1

plot=$source/plot_variants.py
expect 0 "" python3 -B "$plot" "$source/variants/test_data/made_up.json" --output "$work/out"
holds "$work/out/variants.md" 'Made-up GPU, commit 0000000' '**wrong result**: sponza.planes primary: made up' \
  '| planes accurate private batch16 usual masks 64x14 | 5 | 2.000 |' \
  '| sponza primary | 5926 | 2.00 | 3.80 | 1.31 |' '| **geometric mean of 5 cells** |  | **2.00** |' \
  '| planes accurate private batch16 usual masks 64x14 | 80/80 | 72/72 | 1.250 | 1.250 |' \
  '| accurate variant | registers | of fast | sponza | all cells |' \
  '| planes accurate | 2.000 | 2.000 | 2.000 (sponza primary) |' \
  '| planes fast | 5.239 | 5.239 | 4.748 (sponza primary) |' \
  '| planes | planes | sah |  | 57.0 |' '| quantized | quantized | embree-high | 3.0 | 48.0 |' \
  '| planes | 1.250 | 1.250 | 80/80 | 72/72 |' '| planes filter | 0.950 | 0.950 | 84/84 | 1536/1536 |' \
  '| planes accurate private batch16 usual filter 64x14 | masks | 80/80 | 84/84 | 0.950 |' \
  'median 3.0%' 'HIPRT 3.1 SBVH: ' '| sponza primary all | 1482 |  |  |  |'
# A variant with wrong results has no speed.
if grep -q postponed <(grep '^| planes' "$work/out/variants.md"); then fault "a wrong variant is in a table"; fi

plots=(variants_sponza accuracy_cost speed_and_memory)
for name in "${plots[@]}"; do
  file=$work/out/$name.svg
  if python3 -c 'import matplotlib' 2>/dev/null; then
    if [[ ! -s $file ]]; then fault "no $file"; fi
  elif [[ -e $file || $output != *"no matplotlib here"* ]]; then
    fault "without matplotlib: $output"
  fi
done

# Compressed files are read too.
made_up=$source/variants/test_data/made_up.json
python3 -c 'import lzma, sys; lzma.open(sys.argv[2], "w").write(open(sys.argv[1], "rb").read())' "$made_up" \
  "$work/a.json.xz"
expect 0 "" python3 -B "$plot" "$work/a.json.xz" --output "$work/compressed"
if ! diff <(sed 's/a.json.xz/made_up.json/' "$work/compressed/variants.md") "$work/out/variants.md"; then
  fault "a compressed file gives another summary"
fi
# The same figures give the same pictures.
if ! diff -r -x variants.md "$work/compressed" "$work/out"; then fault "the same figures give other pictures"; fi

# A second file of peers: Vulkan. The variants have twice HIPRT's 2963 Mrays/s of sponza's primary rays.
cat >"$work/vulkan.json" <<'JSON'
{"format": "hiprt peers 1", "gpu": "NVIDIA H100 80GB HBM3", "method": "Vulkan, made up.", "peers": [
  {"name": "Vulkan, fast trace", "group": "vulkan", "source": "made up",
   "mrays_s": {"sponza": {"primary": 1481.5}, "moon": {"ao": 1}}}]}
JSON
expect 0 "" python3 -B "$plot" "$source/variants/test_data/made_up.json" --output "$work/vulkan" \
  --peers "$source/peers/h200.json" "$work/vulkan.json"
holds "$work/vulkan/variants.md" '## Against NVIDIA H200 and NVIDIA H100 80GB HBM3 peers' \
  '| x Vulkan, fast trace |' '| sponza primary | 5926 | 2.00 | 3.80 | 1.31 | 4.00 |' \
  '- Vulkan, fast trace: made up; no RT cores' 'Vulkan, made up.'
if python3 -c 'import matplotlib' 2>/dev/null; then holds "$work/vulkan/variants_sponza.svg" 'Vulkan, fast trace'; fi
# Vulkan alone: variants are compared with it.
expect 0 "" python3 -B "$plot" "$source/variants/test_data/made_up.json" --output "$work/alone" \
  --peers "$work/vulkan.json"
holds "$work/alone/variants.md" '| planes accurate private batch16 usual masks 64x14 | 1 |' \
  '| primary x Vulkan, fast trace |' '| **geometric mean of 1 cells** |'

# says STATUS TEXT ARGUMENT...: expects the exit status and one line with the text, and that nothing is written.
says() {
  local status=$1 text=$2
  shift 2
  expect "$status" "" python3 -B "$plot" --output "$work/none" "$@"
  if [[ $output != "plot_variants.py: "*"$text"* || $output == *$'\n'* ]]; then
    fault "$*: '$output', wanted '$text'"
  fi
  if [[ -e $work/none ]]; then fault "$*: something was written"; fi
}
# holding TEXT MESSAGE: expects the message for a file that contains only this text.
holding() {
  printf '%s' "$1" >"$work/bad.json"
  says 1 "$work/bad.json: $2" "$work/bad.json"
}
# damaged STATEMENT MESSAGE [FILE FLAG]: expects the message for the made-up figures, or for the file of that flag.
# Before, a statement changes its JSON d.
damaged() {
  python3 -c 'import json, sys
d = json.load(open(sys.argv[1]))
exec(sys.argv[2])
json.dump(d, open(sys.argv[3], "w"))' "${3:-$made_up}" "$1" "$work/bad.json"
  if [[ $# -eq 2 ]]; then
    says 1 "$work/bad.json: $2" "$work/bad.json"
  else
    says 1 "$work/bad.json: $2" "$made_up" "$4" "$work/bad.json"
  fi
}

says 1 "$work/missing.json: cannot be read: No such file" "$work/missing.json"
says 1 "$work: cannot be read: Is a directory" "$work"
holding '' 'not JSON: '
holding '{' 'not JSON: '
holding '{"format": NaN}' 'not JSON: NaN is no number'
holding $'\xff' 'not JSON: byte 0 is not UTF-8'
holding "$(printf '[%.0s' {1..100000})" 'not JSON: nested too deeply'
holding '[]' 'not a file of bench_variants: '
holding 'null' 'not a file of bench_variants: '
holding '{}' 'not a file of bench_variants: '
holding '{"format": "hiprt peers 1"}' "not a file of bench_variants: its 'format' should be 'hiprt bench_variants 1'"
holding '{"format": "hiprt bench_variants 1"}' "has no 'commit'"
cp "$made_up" "$work/bad.json.xz"
says 1 "$work/bad.json.xz: cannot be uncompressed: " "$work/bad.json.xz"
head -c 500 "$work/a.json.xz" >"$work/bad.json.xz"
says 1 "$work/bad.json.xz: cannot be uncompressed: " "$work/bad.json.xz"
damaged 'del d["device"]' "has no 'device'"
damaged 'd["device"] = "GPU"' 'device: an object is expected, not text'
damaged 'd["device"]["name"] = "a\nb"' "device.name: 'a\\nb' is no name"
damaged 'd["faults"] = [1]' 'faults[0]: text is expected, not a number'
damaged 'd["results"] = "none"' 'results: a list is expected, not text'
damaged 'd["results"] = []' 'results: nothing was measured'
damaged 'd["results"][1] = 7' 'results[1]: an object is expected, not a number'
damaged 'del d["results"][1]["kind"]' "results[1]: has no 'kind'"
damaged 'd["results"][1]["mrays_s"] = 0' 'results[1].mrays_s: is 0, but must be above 0'
damaged 'd["results"][1]["mrays_s"] = -5' 'results[1].mrays_s: is -5, but must be above 0'
damaged 'd["results"][1]["mrays_s"] = 1e-300' 'results[1].mrays_s: is out of range'
damaged 'd["results"][1]["mrays_s"] = 10**4000' 'results[1].mrays_s: is out of range'
damaged 'd["results"][1]["mrays_s"] = None' 'results[1].mrays_s: a number is expected, not null'
damaged 'd["results"][1]["mrays_s"] = True' 'results[1].mrays_s: a number is expected, not true or false'
damaged 'd["results"][2]["median_ms"] = 0.0' 'results[2].median_ms: is 0, but must be above 0'
damaged 'd["results"][0]["tree"] = "nope"' \
  "results[0]: no entry of 'trees' has the scene 'sponza' and the tree 'nope'"
damaged 'd["trees"] = {}' 'trees: a list is expected, not an object'
damaged 'd["trees"][0]["scene"] = "../sponza"' "trees[0].scene: '../sponza' cannot be part of a file's name"
peers=$source/peers/h200.json
damaged 'd["peers"] = 1' 'peers: a list is expected, not a number' "$peers" --peers
damaged 'd["peers"][2]["mrays_s"]["sponza"]["ao"] = 0' \
  'peers[2].mrays_s.sponza.ao: is 0, but must be above 0' "$peers" --peers
damaged 'd["peers"][2]["mrays_s"]["sponza"] = []' \
  'peers[2].mrays_s.sponza: an object is expected, not a list' "$peers" --peers

# After an error the folder is unchanged.
# keeps TEXT ARGUMENT...: expects this text, and that $work/old is unchanged.
keeps() {
  local text=$1 before
  shift
  before=$(ls -AR "$work/old")
  expect 1 "" python3 -B "$plot" --output "$work/old" "$@"
  output=${output#*no matplotlib here (tools/install-packages test)$'\n'}
  if [[ $output != "plot_variants.py: $text"* || $output == *$'\n'* ]]; then fault "$*: '$output', wanted '$text'"; fi
  if [[ $(ls -AR "$work/old") != "$before" ]]; then fault "$*: half written"; fi
}
mkdir -p "$work/old/variants.md"
keeps "$work/old/variants.md: cannot be written: a folder has that name" "$made_up"
rmdir "$work/old/variants.md"
if python3 -c 'import matplotlib' 2>/dev/null; then
  python3 -c 'import json, sys
d = json.load(open(sys.argv[1]))
for part in d["trees"] + d["results"]: part["scene"] = 250 * "s"
json.dump(d, open(sys.argv[2], "w"))' "$made_up" "$work/long.json"
  keeps "$work/old: cannot be written: File name too long" "$work/long.json"
fi
expect 1 "" python3 -B "$plot" "$made_up" --output "$made_up"
if [[ $output != "plot_variants.py: $made_up: cannot be written: "* || $output == *$'\n'* ]]; then fault "$output"; fi
expect 1 "" python3 -B "$plot" "$made_up" --output /proc/none
if [[ $output != "plot_variants.py: /proc/none: cannot be written: "* || $output == *$'\n'* ]]; then fault "$output"; fi

says 2 'the following arguments are required: json'
for most in -3 0 1.5 many 1000; do
  says 2 "argument --most: '$most' is no number from 1 to 999" "$made_up" "--most=$most"
done
says 2 "argument --most: '-3' is no number" "$made_up" --most -3
says 2 'unrecognized arguments: --unknown' "$made_up" --unknown

# The stored summaries are made from the stored figures. (The plots depend on the version of matplotlib.)
for file in "$source"/results/*/variants.json.xz; do
  if ! python3 -B -c 'import os, sys
sys.path.insert(0, sys.argv[1])
from variant_report import runs, summary
peers = [sys.argv[1] + "/peers/h200.json", os.path.dirname(sys.argv[2]) + "/vulkan.json"]
found = runs.Peers(*filter(os.path.exists, peers))
sys.stdout.write(summary.summary(runs.Runs([sys.argv[2]]), found))' \
    "$source" "$file" | diff - "$(dirname "$file")/variants.md"; then
    fault "$(dirname "$file")/variants.md is not that of variants.json.xz"
  fi
done

# run_gpu stores its files. The summary can be made again from the stored JSON.
cat >"$work/program" <<PROGRAM
#!/bin/bash
for argument in "\$@"; do
  case \$argument in
    --list)
      echo '| registers |'
      exit 0
      ;;
    --json=*) cat "\$MADE_UP" >"\${argument#*=}" ;;
  esac
done
exit "\$STATUS"
PROGRAM
chmod +x "$work/program"
# stored FILE...: expects these files in $work/stored, besides pictures.
stored() {
  local found
  found=$(cd "$work/stored" && find . -type f ! -name '*.svg' | sort | xargs)
  if [[ $found != "$*" ]]; then fault "stored: $found, wanted $*: $output"; fi
}
run=("$source/run_gpu" "--scenes=$work" "--program=$work/program" "--output=$work/stored")
expect 0 "" env STATUS=0 "MADE_UP=$made_up" "${run[@]}"
stored ./kernels.md ./variants.json.xz ./variants.md
expect 0 "" python3 -B "$plot" "$work/stored/variants.json.xz" --output "$work/again"
if ! diff "$work/stored/variants.md" "$work/again/variants.md"; then fault "the summary is another one"; fi
rm -r "$work/stored"
# Files that plot_variants.py rejects and files with wrong results are stored, too.
python3 -c 'import sys; print(open(sys.argv[1]).read().replace("5926", "0"))' "$made_up" >"$work/bad.json"
expect 1 "" env STATUS=0 "MADE_UP=$work/bad.json" "${run[@]}"
if [[ $output != *"variants.json.xz: results[0].mrays_s: is 0, but must be above 0"* ]]; then fault "$output"; fi
stored ./kernels.md ./variants.json.xz
rm -r "$work/stored"
expect 1 "" env STATUS=1 "MADE_UP=$made_up" "${run[@]}"
stored ./kernels.md ./variants.json.xz ./variants.md
rm -r "$work/stored"
# Without python3 the JSON stays as it is.
mkdir "$work/bin"
for name in bash cat chmod cp date dirname env find head mkdir mktemp mv rm sed sort tr xargs; do
  ln -s "$(command -v "$name")" "$work/bin/$name"
done
expect 0 "" env "PATH=$work/bin" STATUS=0 "MADE_UP=$made_up" "${run[@]}"
stored ./kernels.md ./variants.json
if [[ $output != *"no python3 with lzma here: variants.json stays as it is"* ]]; then
  fault "without python3: $output"
fi

end
