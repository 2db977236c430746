#!/bin/bash
# test_report.sh BENCHMARKS: runs plot_evaluation.py on made-up figures, and on files that are not valid.
set -uo pipefail

# shellcheck source=tests/scripts/expect.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../tests/scripts/expect.sh"

source=$1
plot=$source/plot_evaluation.py
made_up=$source/evaluation/test_data/made_up.json

expect 0 "" python3 -B "$plot" "$made_up" --output "$work/out"
report=$work/out/report.html
for name in trace_times build_times time_to_image_{flat,two_level} time_to_image_relative_{flat,two_level}; do
  if [[ ! -s $work/out/made_up.$name.svg ]]; then fault "no $name.svg"; fi
  python3 -c 'import sys, xml.dom.minidom; xml.dom.minidom.parse(sys.argv[1])' "$work/out/made_up.$name.svg" ||
    fault "$name.svg"
  holds "$report" "id=\"made_up-$name\""
done
# hq builds 2 s longer than ploc and saves 4 ms per sample: 500 samples. Quartiles of the rounds: 4.25 and 3.75 ms.
holds "$report" '<title>hiprt: evaluation on Made-up CPU</title>' '<li>a made-up fault</li>' \
  '<tr><th>hq</th><td>459 (440 to 479)</td><td>500 (471 to 534)</td><td></td></tr>' \
  '<tr><th>sah</th><td>875 (875 to 875)</td><td>never</td><td></td></tr>' \
  '<tr><th>sbvh</th><td>never</td><td>at first only</td><td></td></tr>' \
  'embree default, embree robust: 3 levels &lt;of&gt; instances' 'hq is ahead of ploc from 500 samples on' \
  '<code>bench_evaluation --device=cpu --rounds=3 --scene=made_up</code>' \
  '<tr><th>hq</th><td>3.00</td><td>0.800</td><td>1.00</td><td>0.600</td><td>0.600</td>'\
'<td>0.600</td><td>0.600</td></tr>' \
  '<tr><th>ploc</th><td>0.500</td><td>0.500</td><td>1.50</td><td>1.50</td><td>1.50</td><td>1.50</td></tr>' \
  '<td>4.00 (0.250)</td><td>2.00 (0.500)</td><td>2.00 (0.475)</td>'
if grep -q 'busy with other work' "$report"; then fault "an idle machine is called busy"; fi
# The averages of one scene are its own: hq takes 3 times as long to build as ploc, and costs 0.8 times as much.
if [[ ! -s $work/out/all.normalised.svg ]]; then fault "no all.normalised.svg"; fi
holds "$report" 'id="all-normalised"' '<title>hq, flat, build time: 3.00 x ploc</title>' \
  '<title>hq, flat, SAH cost: 0.800 x ploc</title>' '<title>hq, flat, primary: 0.600 x ploc</title>'
if [[ -e $work/out/made_up.bounces_flat.svg ]] || grep -q 'RT cores' "$report"; then
  fault "bounces of one bounce, or a CPU without RT cores"
fi
# Nothing is loaded from elsewhere.
if grep -oE '(src|href)="[^"#][^"]*"|@import|url\([^)]*\)' "$report" | grep -v '="data:'; then
  fault "the page loads something"
fi
# The tables of all scenes, for pages: nothing is written.
expect 0 "" python3 -B "$plot" "$made_up" --tables --output "$work/none"
printf '%s\n' "$output" >"$work/tables.md"
holds "$work/tables.md" '### flat, 1 scene, relative to ploc' '| hq | 3.00 | 0.800 | 0.600 | 0.600 | 0.600 | 0.600 |' \
  '### flat: milliseconds per sample'
if [[ -e $work/none ]]; then fault "--tables writes a folder"; fi
# The same figures give the same bytes, compressed or not.
python3 -c 'import lzma, sys; lzma.open(sys.argv[2], "w").write(open(sys.argv[1], "rb").read())' "$made_up" \
  "$work/a.json.xz"
expect 0 "" python3 -B "$plot" "$work/a.json.xz" --output "$work/again"
if ! diff -r "$work/out" "$work/again"; then fault "the page differs"; fi
# Each stored page is made from the stored figures. It contains all plots, so the plots' files are not stored.
for file in "$source"/results/*/evaluation.json; do
  if [[ ! -e $file ]]; then continue; fi
  expect 0 "" python3 -B "$plot" "$file" --output "$work/stored"
  if ! cmp -s "$work/stored/report.html" "$(dirname "$file")/report.html"; then
    fault "$(dirname "$file"): report.html differs"
  fi
  rm -r "$work/stored"
done

# The report says how Vulkan's hits differ from ours.
python3 -c 'import copy, json, sys
d = json.load(open(sys.argv[1]))
s = d["scenes"][0]
entry = copy.deepcopy(next(e for e in s["entries"] if e["form"] == "two_level"))
entry |= {"tracer": "vulkan", "builder": "fast_trace", "build": entry["build"] | {"seconds": 0.12}}
for i, wave in enumerate(entry["waves"]):
    wave |= {"seconds": 2 * wave["seconds"], "rounds": [2 * seconds for seconds in wave["rounds"]]}
    wave["disagreements"] = {"found": 1, "distance": 10, "instance": 100 * i, "primitive": 1000}
s["entries"].append(entry)
json.dump(d, open(sys.argv[2], "w"))' "$made_up" "$work/vulkan.json"
expect 0 "" python3 -B "$plot" "$work/vulkan.json" --output "$work/vulkan"
holds "$work/vulkan/report.html" '<th>hit or miss</th><th>other distance</th><th>other instance</th>' \
  '<th>Vulkan, fast trace, two-level</th><td>4</td><td>40</td><td>600</td><td>4000</td>'
# Vulkan builds in 0.12 s and takes 30 ms per sample, ploc 0.5 s and 15 ms, hq 1 s and 9 ms.
holds "$work/vulkan/report.html" '<th>hq</th><td></td><td>84 (84 to 84)</td><td></td><td>42 (42 to 42)</td>' \
  '<th>ploc</th><td></td><td></td><td></td><td>26 (26 to 26)</td>' \
  'ploc is ahead of Vulkan, fast trace from 26 samples on'
if grep -q 'Hits unlike ours' "$report"; then fault "hits of Vulkan without Vulkan"; fi

# Three bounces have a plot. Beside the plots of a GPU without ray tracing cores stands that it has none.
python3 -c 'import copy, json, sys
d = json.load(open(sys.argv[1]))
d["device"] |= {"kind": "gpu", "name": "NVIDIA H100 80GB HBM3, sm_90"}
for part in [d["scenes"][0], *d["scenes"][0]["entries"]]:
    bounce = next(wave for wave in part["waves"] if wave["name"] == "bounce 1")
    part["waves"] += [copy.deepcopy(bounce) | {"name": f"bounce {i}"} for i in (2, 3)]
json.dump(d, open(sys.argv[2], "w"))' "$made_up" "$work/bounces.json"
expect 0 "" python3 -B "$plot" "$work/bounces.json" --output "$work/bounces"
holds "$work/bounces/report.html" 'id="made_up-bounces_flat"' 'id="made_up-bounces_two_level"' \
  'Time per ray of each diffuse bounce, flat. The GPU has no RT cores.' \
  'Build time (logarithmic). The GPU has no RT cores.' 'less is better). The GPU has no RT cores.' \
  'is bold (no RT cores)' 'sm_90 (no RT cores)'
holds "$work/bounces/made_up.bounces_flat.svg" 'time per ray over bounces (no RT cores)</title>'

# The page names a tree that the CPU built for a GPU. Its figures are those of hq.
python3 -c 'import copy, json, sys
d = json.load(open(sys.argv[1]))
d["device"]["kind"] = "gpu"
s = d["scenes"][0]
entry = copy.deepcopy(next(e for e in s["entries"] if (e["builder"], e["form"]) == ("hq", "flat")))
s["entries"].append(entry | {"builder": "embree-high", "build": entry["build"] | {"built_by": "cpu"}})
json.dump(d, open(sys.argv[2], "w"))' "$made_up" "$work/cpu_build.json"
expect 0 "" python3 -B "$plot" "$work/cpu_build.json" --output "$work/cpu_build"
holds "$work/cpu_build/report.html" '<tr><th>embree-high (CPU)</th><td>3.00</td><td>0.800</td>' \
  '<tr><th>embree-high (CPU)</th><td>459 (440 to 479)</td><td>500 (471 to 534)</td>' \
  '<em>(CPU)</em>: the CPU builds the tree'
if grep -q '(CPU)' "$report"; then fault "a CPU that builds for a GPU where there is none"; fi

# The report says if the machine was busy.
sed 's/^   0.25,$/   7.5,/' "$made_up" >"$work/busy.json"
expect 0 "" python3 -B "$plot" "$work/busy.json" --output "$work/busy"
holds "$work/busy/report.html" 'busy with other work at the start' 'load average 7.5 on 2 threads'

# says STATUS TEXT ARGUMENT...: expects the exit status and one line with the text, and that nothing is written.
says() {
  local status=$1 text=$2
  shift 2
  expect "$status" "" python3 -B "$plot" "$@" --output "$work/none"
  if [[ $output != "plot_evaluation.py: $text"* || $output == *$'\n'* ]]; then fault "$*: '$output', wanted '$text'"; fi
  if [[ -e $work/none ]]; then fault "$*: something was written"; fi
}
# damaged STATEMENT TEXT: expects the text for made-up figures that a statement has changed. The statement sees their
# JSON as d and its first scene as s.
damaged() {
  python3 -c 'import json, sys
d = json.load(open(sys.argv[1]))
s = d["scenes"][0]
exec(sys.argv[2])
json.dump(d, open(sys.argv[3], "w"))' "$made_up" "$1" "$work/bad.json"
  says 1 "$work/bad.json: $2" "$work/bad.json"
}
says 1 "$work/missing.json: cannot be read: No such file" "$work/missing.json"
printf '{"format": "hiprt peers 1"}' >"$work/bad.json"
says 1 "$work/bad.json: not a file of bench_evaluation: its 'format' should be 'hiprt bench_evaluation 1'" \
  "$work/bad.json"
damaged 'd["scenes"] = []' 'scenes: nothing was measured'
damaged 'd["scenes"].append(s)' 'scenes: a scene is there twice'
damaged 's["name"] = "../x"' "scenes[0].name: '../x' cannot be part of a file's name"
damaged 's["entries"] = []' 'scenes[0]: nothing was measured'
damaged 's["entries"][1]["build"]["seconds"] = 0' 'scenes[0].entries[1].build.seconds: is 0, but must be above 0'
damaged 's["entries"][1]["form"] = "cubic"' "scenes[0].entries[1].form: the scene has no hierarchy 'cubic'"
damaged 's["entries"][1]["waves"][0]["name"] = "tidal"' \
  "scenes[0].entries[1].waves[0]: no wave of the scene is called 'tidal'"
damaged 's["entries"][1]["waves"][2:3] = []' "scenes[0].entries[1]: has no wave 'bounce 1'"
damaged 's["entries"][1]["waves"][0]["rounds"] = []' 'scenes[0].entries[1].waves[0].rounds: nothing was measured'
damaged 's["entries"][1]["waves"][0]["rounds"][1] = "fast"' \
  'scenes[0].entries[1].waves[0].rounds[1]: a number is expected, not text'
damaged 's["waves"][0]["kind"] = "tertiary"' "scenes[0].waves[0].kind: 'tertiary' is none of primary, secondary, shadow"
damaged 's["waves"][0]["rays"] = 0' 'scenes[0].waves[0].rays: is 0, but must be above 0'
damaged 'del d["device"]["threads"]' "device: has no 'threads'"
says 2 "the following arguments are required: json"

end
