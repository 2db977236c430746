# Settings of every target of hiprt: language level, warnings, sanitizers. Consumers of the libraries get the language
# level only.

# Warnings for our own sources. Headers of other packages are system headers, which do not warn.
add_library(hiprt_warnings INTERFACE)
target_compile_options(hiprt_warnings INTERFACE
  -Wall -Wextra -Wconversion -Wshadow
  # GCC 12 warns of overlapping copies in std::string's operator+, wrongly (its bug 105651).
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>
  $<$<BOOL:${HIPRT_WARNINGS_AS_ERRORS}>:-Werror>)

add_library(hiprt_sanitizers INTERFACE)
if(HIPRT_SANITIZE)
  list(JOIN HIPRT_SANITIZE "," hiprt_sanitize_list)
  target_compile_options(hiprt_sanitizers INTERFACE
    -fsanitize=${hiprt_sanitize_list} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(hiprt_sanitizers INTERFACE -fsanitize=${hiprt_sanitize_list})
endif()
option(HIPRT_FORCE_INLINING "Inline whole traversals: faster rays, and they compile for three times as long" ON)
if(HIPRT_SANITIZE OR NOT HIPRT_FORCE_INLINING)
  target_compile_definitions(hiprt_warnings INTERFACE HIPRT_LEAVE_INLINING)
  # GCC 12 warns of children that std::countr_zero(0) would be, where no caller passes 0.
  target_compile_options(hiprt_warnings INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>)
endif()
if(HIPRT_SANITIZE STREQUAL "thread" AND UNIX AND HIPRT_THREADS STREQUAL "tbb")
  add_library(hiprt_tsan_tbb OBJECT ${CMAKE_CURRENT_LIST_DIR}/tsan_tbb.cpp)
  target_compile_features(hiprt_tsan_tbb PRIVATE cxx_std_20)
  target_link_libraries(hiprt_tsan_tbb PUBLIC TBB::tbb ${CMAKE_DL_LIBS} PRIVATE hiprt_warnings hiprt_sanitizers)
endif()
if(HIPRT_FUZZERS)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    message(FATAL_ERROR "HIPRT_FUZZERS=ON needs clang (-DCMAKE_CXX_COMPILER=clang++): libFuzzer is a part of it")
  endif()
  # For the libraries whose code the fuzz targets explore. The targets themselves add -fsanitize=fuzzer. Programs
  # without libFuzzer link such objects too: AddressSanitizer has the functions that they call.
  set(HIPRT_FUZZER_COVERAGE -fsanitize=fuzzer-no-link)
endif()

# hiprt_target(<target>...): applies the settings to compiled targets.
function(hiprt_target)
  foreach(target IN LISTS ARGN)
    target_compile_features(${target} PRIVATE cxx_std_20)
    set_target_properties(${target} PROPERTIES
      CXX_EXTENSIONS OFF CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:hiprt_warnings> $<BUILD_INTERFACE:hiprt_sanitizers>)
    if(TARGET hiprt_precompiled)
      add_dependencies(${target} hiprt_precompiled)
    endif()
    get_target_property(type ${target} TYPE)
    if(type STREQUAL "EXECUTABLE" AND TARGET hiprt_tsan_tbb)
      target_link_libraries(${target} PRIVATE hiprt_tsan_tbb)
    endif()
  endforeach()
endfunction()

option(HIPRT_UNITY_BUILD
  "Compile the sources of a folder of the tools as one: less time, but a change of one compiles all of them" OFF)
mark_as_advanced(HIPRT_UNITY_BUILD)

# hiprt_unity(<target>): with HIPRT_UNITY_BUILD compiles the sources of each folder as one. Such sources have no names
# in common in unnamed namespaces. hiprt's own libraries are not among them, because they are linked in part:
# libhiprt0300164.so gets neither Embree nor oneTBB.
function(hiprt_unity target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${HIPRT_UNITY_BUILD} UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  foreach(source IN LISTS sources)
    get_filename_component(folder "${source}" DIRECTORY)
    string(MAKE_C_IDENTIFIER "${target}_${folder}" group)
    set_source_files_properties("${source}" PROPERTIES UNITY_GROUP ${group})
  endforeach()
endfunction()

option(HIPRT_OPTIMIZE_COLD_CODE "Optimise code that takes no time at run time: command lines, importers, light tests"
  ON)
mark_as_advanced(HIPRT_OPTIMIZE_COLD_CODE)

set(HIPRT_PROGRAM_OPTIONS "" CACHE STRING
  "Compiler options of tools and benchmarks, after those of the build type, for example -O1")
mark_as_advanced(HIPRT_PROGRAM_OPTIONS)

# hiprt_cold_flags(<variable>): compiler options for code that takes no time at run time.
function(hiprt_cold_flags variable)
  if(HIPRT_OPTIMIZE_COLD_CODE)
    set(${variable} $<$<CONFIG:Release>:-O1> PARENT_SCOPE)
  else()
    set(${variable} -O0 PARENT_SCOPE)
  endif()
endfunction()
