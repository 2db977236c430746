#!/bin/bash
# shared_library.sh LIBRARY SONAME: the library's SONAME, and that it exports hiprt::build and the functions of
# hiprt::format, and nothing else.
set -euo pipefail

library=$1 wanted=$2
soname=$(readelf -d "$library" | sed -n 's/.*(SONAME).*\[\(.*\)\]/\1/p')
status=0
if [[ $soname != "$wanted" ]]; then
  echo "SONAME is '$soname', not '$wanted'"
  status=1
fi
symbols=$(nm -D --defined-only "$library" | awk '{ print $NF }' | c++filt)
if ! grep -q '^hiprt::build::build(' <<<"$symbols"; then
  echo "hiprt::build::build is not exported"
  status=1
fi
names=(open_scene open_buffer file_checksum make_scene_view name validate to_string closest_hits any_hits)
format="hiprt::($(IFS='|' && echo "${names[*]}"))(\[abi:cxx11\])?\("
for name in "${names[@]}"; do
  if ! grep -qE "^hiprt::$name(\[abi:cxx11\])?\(" <<<"$symbols"; then
    echo "hiprt::$name is not exported"
    status=1
  fi
done
types='((vtable|typeinfo|typeinfo name) for )?hiprt::build::|hiprt::HostPart::'
if stray=$(grep -vE "^($types|$format)" <<<"$symbols"); then
  printf 'exported by mistake:\n%s\n' "$stray"
  status=1
fi
echo "$soname exports $(wc -l <<<"$symbols") symbols"
exit $status
