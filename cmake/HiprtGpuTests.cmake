# Tests of GPU code, on a machine with a GPU or without one.

# amdrun stands for the runtime of HIP 5.
set(hip_version 5)
if(EXISTS "${HIPRT_HIP_INCLUDE_DIR}/hip/hip_version.h")
  file(STRINGS "${HIPRT_HIP_INCLUDE_DIR}/hip/hip_version.h" hip_version REGEX "define HIP_VERSION_MAJOR")
  string(REGEX REPLACE ".* " "" hip_version "${hip_version}")
endif()
if(EXISTS ${PROJECT_SOURCE_DIR}/../shared/amdrun/amdrun AND NOT hip_version GREATER 5)
  cmake_path(SET hiprt_amdrun_default NORMALIZE ${PROJECT_SOURCE_DIR}/../shared/amdrun/amdrun)
else()
  set(hiprt_amdrun_default "")
endif()
set(HIPRT_AMDRUN "${hiprt_amdrun_default}" CACHE FILEPATH
  "amdrun, which runs programs for AMD GPUs on the CPU; empty: such tests need a GPU")

# hiprt_skip_gpu_test(<name> <reason>): a ctest entry that is skipped and says why.
function(hiprt_skip_gpu_test name reason)
  add_test(NAME ${name} COMMAND ${CMAKE_COMMAND} -E env bash -c "echo 'SKIPPED: ${reason}'; exit 77")
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 LABELS gpu)
endfunction()

# hiprt_add_gpu_entry(<name> <mode> <arch> <program> <argument>...): one ctest entry; see run_gpu_test.sh.
function(hiprt_add_gpu_entry name mode arch program)
  add_test(NAME ${name} COMMAND ${PROJECT_SOURCE_DIR}/cmake/run_gpu_test.sh ${mode} ${arch} "${HIPRT_AMDRUN}"
    $<TARGET_FILE:${program}> ${ARGN})
  if(HIPRT_TEST_SET STREQUAL "quick")
    set_tests_properties(${name} PROPERTIES ENVIRONMENT HIPRT_EMULATED_CASES=left)
  endif()
  # amdrun spends most of its time on one processor: it translates each kernel at its first launch. Long tests start
  # first.
  set_tests_properties(${name} PROPERTIES COST 100 TIMEOUT 1800 SKIP_RETURN_CODE 77 LABELS gpu
    FIXTURES_REQUIRED hiprt_amdrun)
endfunction()

# Builds amdrun's own runtime once, before the tests that need it.
if(HIPRT_GPU_PLATFORM STREQUAL "AMD")
  add_test(NAME gpu_amdrun COMMAND ${PROJECT_SOURCE_DIR}/cmake/run_gpu_test.sh prepare - "${HIPRT_AMDRUN}")
  set_tests_properties(gpu_amdrun PROPERTIES FIXTURES_SETUP hiprt_amdrun TIMEOUT 300 LABELS gpu)
endif()

# hiprt_add_gpu_program(<target> <source>... [LIBS <library>...] [OPTIONS <option>...])
# A program from .hip sources (hiprt_gpu_objects()) and C++ sources, with hiprt::gpu and hiprt::build_static. At run
# time it needs only the shared libraries that it uses.
function(hiprt_add_gpu_program target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "LIBS;OPTIONS")
  set(kernels ${arg_UNPARSED_ARGUMENTS})
  list(FILTER kernels INCLUDE REGEX "\\.hip$")
  set(sources ${arg_UNPARSED_ARGUMENTS})
  list(FILTER sources EXCLUDE REGEX "\\.hip$")
  add_executable(${target} ${sources})
  hiprt_target(${target})
  set_target_properties(${target} PROPERTIES LINKER_LANGUAGE CXX)
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_options(${target} PRIVATE LINKER:--as-needed)
  hiprt_gpu_objects(${target} ${kernels} OPTIONS ${arg_OPTIONS})
  target_link_libraries(${target} PRIVATE hiprt::build_static ${arg_LIBS})
endfunction()

# hiprt_add_gpu_test(<name> <source>... [LIBS <library>...] [OPTIONS <option>...] [ARGS <argument>...]
#                    [FIXTURES <fixture>...] [EXPECT <regular expression>] [ASAN_ALL])
# Makes the program test_<name> (hiprt_add_gpu_program()) and ctest entries with the label gpu, run with ARGS: on AMD
# <name>_<arch> for each of HIPRT_AMD_ARCHS, and <name>_asan_<arch> for the last of them (with ASAN_ALL: for each),
# which accesses out of bounds end; on NVIDIA <name>_sm_<arch>. With EXPECT the output must match, and the exit status
# does not count. An entry that cannot run on this machine is skipped (exit status 77) and prints the reason.
function(hiprt_add_gpu_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "ASAN_ALL" "EXPECT" "LIBS;OPTIONS;ARGS;FIXTURES")
  if(HIPRT_GPU_PLATFORM STREQUAL "OFF")
    hiprt_skip_gpu_test(${name} "GPU code is off (${HIPRT_GPU_REASON})")
    return()
  endif()
  hiprt_add_gpu_program(test_${name} ${arg_UNPARSED_ARGUMENTS} LIBS ${arg_LIBS} OPTIONS ${arg_OPTIONS})
  set(entries "")
  if(HIPRT_GPU_PLATFORM STREQUAL "AMD")
    foreach(arch IN LISTS HIPRT_AMD_ARCHS)
      hiprt_add_gpu_entry(${name}_${arch} amd ${arch} test_${name} ${arg_ARGS})
      list(APPEND entries ${name}_${arch})
    endforeach()
    set(asan_archs ${HIPRT_AMD_ARCHS})
    if(NOT arg_ASAN_ALL)
      list(GET HIPRT_AMD_ARCHS -1 asan_archs)
    endif()
    foreach(arch IN LISTS asan_archs)
      hiprt_add_gpu_entry(${name}_asan_${arch} amd-asan ${arch} test_${name} ${arg_ARGS})
      list(APPEND entries ${name}_asan_${arch})
    endforeach()
  else()
    foreach(arch IN LISTS HIPRT_NVIDIA_ARCHS)
      hiprt_add_gpu_entry(${name}_sm_${arch} nvidia sm_${arch} test_${name} ${arg_ARGS})
      list(APPEND entries ${name}_sm_${arch})
    endforeach()
  endif()
  if(arg_FIXTURES)
    set_property(TEST ${entries} APPEND PROPERTY FIXTURES_REQUIRED ${arg_FIXTURES})
  endif()
  if(arg_EXPECT)
    set_tests_properties(${entries} PROPERTIES PASS_REGULAR_EXPRESSION "${arg_EXPECT}")
  endif()
endfunction()

# hiprt_emulated_cases(<entry> <cases>): on a machine without a GPU the ctest entry, if it exists, runs only these cases
# (a test specification of Catch2). "none": it runs nothing, because other entries run its cases. amdrun takes seconds
# to translate a kernel, and three times as long with its check of accesses. <name>_asan stands for the entry with that
# check. hiprt_quick_cases(): the same for the quick set (HIPRT_TEST_SET), where an entry without this call does not
# run. "whole": all cases, also for programs that do not use Catch2.
function(hiprt_emulated_cases entry cases)
  if(HIPRT_TEST_SET STREQUAL "all")
    hiprt_set_emulated_cases(${entry} "${cases}")
  endif()
endfunction()

function(hiprt_quick_cases entry cases)
  if(HIPRT_TEST_SET STREQUAL "quick")
    hiprt_set_emulated_cases(${entry} "${cases}")
  endif()
endfunction()

function(hiprt_set_emulated_cases entry cases)
  if(entry MATCHES "_asan$" AND HIPRT_AMD_ARCHS)
    list(GET HIPRT_AMD_ARCHS -1 arch)
    string(APPEND entry _${arch})
  endif()
  if(cases STREQUAL "whole")
    set(cases "")
  endif()
  if(TEST ${entry})
    set_tests_properties(${entry} PROPERTIES ENVIRONMENT "HIPRT_EMULATED_CASES=${cases}")
  endif()
endfunction()

# Registers depend on the compiler: the table calls the numbers of clang 15 gfx1030, others gfx1030.clang17.
set(hiprt_amd_compiler "")
if(NOT HIPRT_HIPCC_CLANG STREQUAL "15")
  set(hiprt_amd_compiler ".clang${HIPRT_HIPCC_CLANG}")
endif()

# hiprt_gpu_listings(<target> <source> <stem> <variable>): compiles the source, with the flags of the interface library
# <target>, to listings: <stem>.<arch>.s by hipcc and <stem>.sm_<arch>.txt by nvcc, if installed. <variable> becomes a
# list of arch=listing. The target <target>_listings builds them.
function(hiprt_gpu_listings target source stem variable)
  hiprt_gpu_flags(${target} flags)
  set(listings "")
  if(NOT hiprt_amd_problem)
    foreach(arch IN LISTS HIPRT_AMD_ARCHS)
      hiprt_amd_command(command ${arch})
      set(listing ${stem}.${arch}.s)
      hiprt_amd_dependencies(dependencies ${listing})
      add_custom_command(OUTPUT ${listing}
        COMMAND ${command} --cuda-device-only ${flags} -S ${source} -o ${listing} ${dependencies}
        DEPENDS ${source} DEPFILE ${listing}.d COMMAND_EXPAND_LISTS VERBATIM COMMENT "Listing ${source} for ${arch}")
      list(APPEND listings ${arch}${hiprt_amd_compiler}=${listing})
    endforeach()
  endif()
  if(NOT hiprt_nvidia_problem)
    foreach(arch IN LISTS HIPRT_NVIDIA_ARCHS)
      hiprt_nvidia_command(command ${arch})
      set(listing ${stem}.sm_${arch}.txt)
      # ptxas reports on standard error, as it does its errors.
      add_custom_command(OUTPUT ${listing}
        COMMAND bash -c [["${@:2}" 2>"$1" || (cat "$1" >&2 && false)]] listing ${listing}
          ${command} -I${PROJECT_SOURCE_DIR}/cmake/hip_nvidia ${flags} -Xptxas -v -cubin ${source} -o ${listing}.cubin
          -MD -MT ${listing} -MF ${listing}.d
        DEPENDS ${source} BYPRODUCTS ${listing}.cubin DEPFILE ${listing}.d COMMAND_EXPAND_LISTS VERBATIM
        COMMENT "Listing ${source} for sm_${arch}")
      list(APPEND listings sm_${arch}=${listing})
    endforeach()
  endif()
  set(files "${listings}")
  list(TRANSFORM files REPLACE "^[^=]*=" "")
  add_custom_target(${target}_listings ALL DEPENDS ${files})
  set(${variable} "${listings}" PARENT_SCOPE)
endfunction()

# hiprt_add_gpu_resource_test(<name> <source.hip> [LIBS <library>...])
# The ctest entry <name> compares registers, scratch and instructions of the source's kernels with
# tests/gpu/resources.json: for HIPRT_AMD_ARCHS if hipcc is installed, for HIPRT_NVIDIA_ARCHS if nvcc is, with any
# HIPRT_GPU_PLATFORM. <name> is also an interface library, for definitions. To accept new numbers, run the command that
# `ctest -R <name> -V` prints with --write.
function(hiprt_add_gpu_resource_test name source)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "LIBS")
  if(HIPRT_GPU_PLATFORM STREQUAL "OFF")
    hiprt_skip_gpu_test(${name} "GPU code is off (${HIPRT_GPU_REASON})")
    return()
  endif()
  add_library(${name} INTERFACE)
  target_link_libraries(${name} INTERFACE hiprt::device ${arg_LIBS})
  cmake_path(ABSOLUTE_PATH source NORMALIZE)
  cmake_path(RELATIVE_PATH source BASE_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE key)
  hiprt_gpu_listings(${name} ${source} ${CMAKE_CURRENT_BINARY_DIR}/${name} listings)
  add_test(NAME ${name} COMMAND ${Python3_EXECUTABLE} -B ${PROJECT_SOURCE_DIR}/tests/gpu/resources.py
    ${PROJECT_SOURCE_DIR}/tests/gpu/resources.json ${key} ${listings})
  set_tests_properties(${name} PROPERTIES TIMEOUT 60 LABELS gpu)
  set(${name}_listings "${listings}" PARENT_SCOPE)
endfunction()
