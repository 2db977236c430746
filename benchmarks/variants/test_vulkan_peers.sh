#!/bin/bash
# test_vulkan_peers.sh BENCHMARKS PROGRAM SCENES: bench_variants and run_gpu measure Vulkan's ray queries on scenes of
# make_bench_scene. It fails if rays have other hits than the host's. Without a device of Vulkan it skips itself.
set -uo pipefail

# shellcheck source=tests/scripts/expect.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../tests/scripts/expect.sh"

source=$1 program=$2 scenes=$3
small=(--device=cpu --width=64 --height=36 --repetitions=2 --warm-up=1 --tests=accurate)
vulkan=(--vulkan=fast_build,fast_trace --vulkan-calls=query)

expect 2 "'fast' is none of fast_build,fast_trace" "$program" "${small[@]}" "--scenes=$scenes" --vulkan=fast
# On a CPU nothing is measured by default.
expect 0 "Vulkan is not measured: on a CPU --vulkan must name its modes" "$program" "${small[@]}" "--scenes=$scenes" \
  --scene=procedural --layouts=float "--vulkan-json=$work/none.json"
if [[ -e $work/none.json ]]; then fault "a file without figures"; fi
# A device that does not exist is one line. The variants are measured.
expect 0 "bench_variants: Vulkan is not measured: " "$program" "${small[@]}" "--scenes=$scenes" --scene=procedural \
  --layouts=float "${vulkan[@]}" --vulkan-device=none-has-this-name "--vulkan-json=$work/none.json"
if [[ -e $work/none.json || $output != *"procedural.float.bvh, primary: "* ]]; then fault "no device: $output"; fi

# peers FILE SCENE: the figures are complete, and at most a few rays along edges have other hits.
peers() {
  python3 - "$1" "$2" <<'PYTHON' || fault "$1: wrong figures"
import json, sys
data = json.load(open(sys.argv[1]))
assert data["format"] == "hiprt peers 1" and data["gpu"] and data["vulkan"]["calls"] == "query", data
assert [peer["name"] for peer in data["peers"]] == ["Vulkan, fast build", "Vulkan, fast trace"], data["peers"]
for peer in data["peers"]:
    assert list(peer["mrays_s"]) == [sys.argv[2]] and peer["group"] == "vulkan", peer
    speeds, differing = peer["mrays_s"][sys.argv[2]], peer["differing_rays"][sys.argv[2]]
    assert list(speeds) == list(differing) == ["ao", "diffuse", "primary", "shadow"], peer
    assert min(speeds.values()) > 0 and max(differing.values()) <= 4, peer
PYTHON
}

expect 0 "" "$program" "${small[@]}" "--scenes=$scenes" --scene=procedural,procedural_boxes --layouts=float \
  "${vulkan[@]}" "--vulkan-json=$work/flat.json"
if [[ $output == *"Vulkan is not measured: "* ]]; then
  echo "SKIPPED: ${output#*Vulkan is not measured: }" | sed -n 1p
  exit 77
fi
if [[ $output != *"Vulkan, procedural_boxes: not measured: it has custom primitives"* ]]; then fault "$output"; fi
peers "$work/flat.json" procedural
# Instances that are turned, stretched and mirrored.
expect 0 "" "$program" "${small[@]}" "--scenes=$scenes/instances" "${vulkan[@]}" "--vulkan-json=$work/instances.json"
peers "$work/instances.json" turned

expect 0 "Results: " "$source/run_gpu" "--scenes=$scenes" "--program=$program" "--output=$work/results" \
  -- "${small[@]}" "${vulkan[@]}" --scene=procedural --layouts=float
peers "$work/results/vulkan.json" procedural
holds "$work/results/variants.md" '| x Vulkan, fast build | x Vulkan, fast trace |' '- Vulkan, fast trace: '

end
