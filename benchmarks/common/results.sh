# Functions for scripts that measure and store results. Source this file. $script is the script's name, for messages.

fail() {
  echo "benchmarks/$script: $1" >&2
  exit "${2:-1}"
}

# pack_program PROGRAM FOLDER: copies the program and its shared libraries, except the C library and the drivers, which
# belong to the machine. Vulkan's loader, which programs open while they run, is copied if it is here.
pack_program() {
  mkdir -p "$2/lib"
  cp "$1" "$2/"
  ldd "$1" | awk '$2 == "=>" && $3 ~ /^\// { print $3 }' |
    { grep -vE '/(ld-linux|libc|libm|libdl|librt|libpthread|libcuda|libamdhip64)[-.]' || true; } |
    xargs -r cp -L -t "$2/lib"
  { ldconfig -p 2>/dev/null || /sbin/ldconfig -p; } | awk '$1 == "libvulkan.so.1" && !found { print $NF; found = 1 }' |
    xargs -r cp -L -t "$2/lib"
  echo "Packed: $2 ($(du -sm "$2" | cut -f 1) MB)" >&2
}

# use_packed_libraries PROGRAM: uses the libraries that pack_program() put beside the program.
use_packed_libraries() {
  local libraries
  libraries=$(dirname "$1")/lib
  if [[ -d $libraries ]]; then export LD_LIBRARY_PATH=$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}; fi
}

# json_text FILE KEY: the value of the first "KEY": "TEXT" line.
json_text() {
  sed -n "s/^ *\"$2\": \"\(.*\)\",\{0,1\}$/\1/p" "$1" | sed -n 1p
}

# json_device FILE: the device's name.
json_device() {
  sed -n '/^ "device": {/,/^ }/s/^  "name": "\(.*\)",\{0,1\}$/\1/p' "$1" | sed -n 1p
}

# as_file_name TEXT
as_file_name() {
  tr '[:upper:]' '[:lower:]' <<<"${1:-unknown}" | tr -cs '[:alnum:]' '-' | sed 's/^-*//; s/-*$//'
}

# store_results WORK FOLDER: copies WORK to FOLDER, which must not exist. After a failure there is no FOLDER.
store_results() {
  if [[ -e $2 ]]; then fail "$2 exists already"; fi
  mkdir -p "$(dirname "$2")"
  rm -rf "$2.unfinished"
  cp -r "$1" "$2.unfinished"
  chmod 755 "$2.unfinished"
  mv "$2.unfinished" "$2"
  echo "Results: $2" >&2
}
