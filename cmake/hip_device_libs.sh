#!/bin/bash
# hip_device_libs.sh FOLDER: prints a folder for hipcc's --rocm-device-lib-path that knows gfx1100.
#
# Debian 12's device library is older than gfx11 and lacks one file with one constant. Then this script makes that file
# in FOLDER from gfx1030's and links the distribution's other files beside it. Else it prints the distribution's folder.
# Exit status: 0, or 77 with the reason on stdout when there is no device library, or no llvm-dis and llvm-as where they
# are needed.
set -euo pipefail

folder=${1:?usage: hip_device_libs.sh FOLDER}
# Newer versions of hipcc have the library beside clang's own files.
resources=$(HIP_PLATFORM=amd hipcc --offload-arch=gfx1030 -print-resource-dir 2>/dev/null || true)
source_folder=""
for candidate in "$resources"/{lib/,}amdgcn/bitcode /usr/lib/*/amdgcn/bitcode /opt/rocm*/amdgcn/bitcode; do
  if [[ -e $candidate/ocml.bc ]]; then source_folder=$candidate; break; fi
done
if [[ -z $source_folder ]]; then
  echo "no AMD device library found (tools/install-packages gpu)"
  exit 77
fi
name=oclc_isa_version_1100.bc
if [[ -e $source_folder/$name ]]; then
  echo "$source_folder"
  exit 0
fi
suffix=-15
command -v llvm-as-15 >/dev/null || suffix=""
for tool in llvm-dis$suffix llvm-as$suffix; do
  if ! command -v "$tool" >/dev/null; then
    echo "$tool not found (tools/install-packages gpu)"
    exit 77
  fi
done

mkdir -p "$folder"
ln -sf "$source_folder"/*.bc "$folder/"
temporary=$(mktemp "$folder/.XXXXXX")
trap 'rm -f "$temporary"' EXIT
"llvm-dis$suffix" -o - "$source_folder/oclc_isa_version_1030.bc" | sed 's/i32 10300\b/i32 11000/' |
  "llvm-as$suffix" -o "$temporary" -
mv "$temporary" "$folder/$name"
echo "$folder"
