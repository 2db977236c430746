#!/bin/bash
# smoke_test.sh BENCHMARKS PROGRAM SCENES: runs bench_variants and run_gpu on the CPU, on scenes of make_bench_scene. It
# fails if a variant has other results, if a wrong result is not detected, or if a figure is missing. Times are not
# checked.
set -uo pipefail

# shellcheck source=tests/scripts/expect.sh
source "$(dirname "${BASH_SOURCE[0]}")/../../tests/scripts/expect.sh"

source=$1 program=$2 scenes=$3

small=(--device=cpu --width=64 --height=36 --repetitions=2 --warm-up=1)
expect 0 "usage: bench_variants" "$program" --help
expect 0 "| closest | quantized | " "$program" --device=cpu --list
expect 0 "Results: " "$source/run_gpu" "--scenes=$scenes" "--program=$program" "--output=$work/results" --commit=abc \
  -- "${small[@]}" "--markdown=$work/tables.md"
python3 -c 'import lzma, sys; sys.stdout.buffer.write(lzma.open(sys.argv[1]).read())' "$work/results/variants.json.xz" \
  >"$work/variants.json"
holds "$work/variants.json" '"commit": "abc"' '"scene": "procedural_boxes"' '"kind": "diffuse"' \
  '"instructions"' '"bytes_per_triangle"' '"builder": "sbvh"' '"tests": "fast"' '"wrong_rays": 0' '"faults": []' \
  '"query": "all"' '"other_primitive_rays": 0'
holds "$work/tables.md" '## procedural.half: half' '| quantized accurate private immediate usual masks 1x1' \
  '| primary all |' '## Tests that are not exact' '| other primitives % |'
holds "$work/results/variants.md" '## What accuracy costs' '## What features cost'
holds "$work/results/kernels.md" '| registers |'
expect 1 "exists already" "$source/run_gpu" "--scenes=$scenes" "--program=$program" "--output=$work/results"
expect 2 "unknown argument" "$source/run_gpu" --unknown

# Flags choose variants. Values that do not exist are rejected.
expect 0 "1296 rays, 4 variants" "$program" "--scenes=$scenes" --scene=procedural --layouts=planes --features=masks \
  --kinds=primary --device=cpu --width=48 --height=27 --repetitions=1
expect 0 "1296 rays, 2 variants" "$program" "--scenes=$scenes" --scene=procedural --layouts=planes --features=masks \
  --kinds=primary --queries=all --device=cpu --width=48 --height=27 --repetitions=1
expect 0 "1295 rays, 2 variants" "$program" "--scenes=$scenes" --scene=procedural --layouts=planes --features=masks \
  --kinds=primary,diffuse --tests=accurate --pixels=tiles --device=cpu --width=37 --height=35 --repetitions=1 \
  "--json=$work/tiles.json"
holds "$work/tiles.json" 'in tiles of 8 x 4'
# A file of rays beside a tree, also in the current folder: two rays for closest hits.
cp "$scenes/procedural.float.bvh" "$work/beside.float.bvh"
python3 -c 'import struct, sys
ray = struct.pack("<8f", 0, 0, 0, 0, 0, 0, 1, 1e30)
open(sys.argv[1], "wb").write(struct.pack("<2I", 2, 0) + ray + ray)' "$work/beside.two.rays"
for tree in "$work/beside.float.bvh" beside.float.bvh; do
  expect 0 "beside.float.bvh, two: 2 rays" env -C "$work" "$(realpath "$program")" --device=cpu --repetitions=1 \
    "--bvh=$tree"
done
expect 2 "--pixels=columns: expected rows or tiles" "$program" "${small[@]}" "--scenes=$scenes" --pixels=columns
expect 2 "--layouts=octree: no compiled variant has it" "$program" "${small[@]}" "--scenes=$scenes" --layouts=octree
expect 2 "unknown argument '--unknown'" "$program" --unknown
expect 2 "--device=tpu" "$program" --device=tpu --list
expect 2 "either --scenes or --bvh" "$program" "${small[@]}"
expect 1 "has no nothing.*.bvh" "$program" "${small[@]}" "--scenes=$scenes" --scene=nothing
expect 1 "nothing was measured" "$program" "${small[@]}" "--bvh=$scenes/procedural.float.bvh" --layouts=planes
printf 'damaged' >"$work/bad.float.bvh"
expect 1 "bad.float.bvh" "$program" "${small[@]}" "--bvh=$work/bad.float.bvh"
# A tree of other triangles under the same name gives other results.
cp "$scenes/procedural.float.bvh" "$work/mixed.float.bvh"
cp "$scenes/other/procedural.planes.bvh" "$work/mixed.planes.bvh"
for query in closest all; do
  expect 1 "mixed.planes primary: $query planes accurate private immediate sorted masks 1x1 id: other results than" \
    "$program" "${small[@]}" "--scenes=$work" --scene=mixed --features=masks
done
# Boxes that are not those of the file.
cp "$scenes/procedural_boxes.float.bvh" "$work/boxes.float.bvh"
expect 1 "boxes.boxes" "$program" "${small[@]}" "--bvh=$work/boxes.float.bvh"
cp "$scenes/other/procedural_boxes.boxes" "$work/boxes.boxes"
expect 1 "custom primitives of type 0, but" "$program" "${small[@]}" "--bvh=$work/boxes.float.bvh"

end
