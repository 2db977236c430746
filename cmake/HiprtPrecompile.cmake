# Precompiled headers of the standard library and of other packages, for builds that compile everything once, as
# tools/check does. hiprt's own headers are not among them: a change of one would compile everything again.

option(HIPRT_PRECOMPILE_HEADERS
  "Precompile headers of other packages for tools, tests and benchmarks. ccache then needs pch_defines,time_macros" OFF)
mark_as_advanced(HIPRT_PRECOMPILE_HEADERS)

set(HIPRT_STANDARD_HEADERS
  <algorithm> <array> <atomic> <bit> <chrono> <cmath> <cstdint> <cstring> <filesystem> <fstream> <functional>
  <iostream> <limits> <map> <memory> <numeric> <optional> <random> <set> <span> <sstream> <string>
  <string_view> <thread> <vector>)

# All precompiled headers. hiprt_target() lets every target wait for it.
if(HIPRT_PRECOMPILE_HEADERS)
  add_custom_target(hiprt_precompiled)
endif()

# hiprt_precompile(<name> <variable> [HEADERS <header>...] [LIBS <library>...] [OPTIONS <option>...])
# Precompiles the standard headers and HEADERS, whose folders come from LIBS, with the OPTIONS. <variable> becomes the
# options of the sources that use them, or is empty (HIPRT_PRECOMPILE_HEADERS). These sources must be compiled with the
# same OPTIONS, and with the definitions of the folder of this call, or more.
function(hiprt_precompile name variable)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "HEADERS;LIBS;OPTIONS")
  set(${variable} "" PARENT_SCOPE)
  if(NOT HIPRT_PRECOMPILE_HEADERS)
    return()
  endif()
  set(target hiprt_precompiled_${name})
  # CMake wants a source.
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp CONTENT "// The headers are all.\n")
  add_library(${target} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp)
  target_compile_features(${target} PRIVATE cxx_std_20)
  set_target_properties(${target} PROPERTIES
    CXX_EXTENSIONS OFF CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_compile_options(${target} PRIVATE ${arg_OPTIONS})
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${target} PRIVATE hiprt_warnings hiprt_sanitizers ${arg_LIBS})
  target_precompile_headers(${target} PRIVATE ${HIPRT_STANDARD_HEADERS} ${arg_HEADERS})
  add_dependencies(hiprt_precompiled ${target})
  # GCC and clang find the precompiled form beside the header.
  set(${variable} -Winvalid-pch -include ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${target}.dir/cmake_pch.hxx
    PARENT_SCOPE)
endfunction()
