# Chooses the platform of GPU code and compiles .hip sources to objects of a target. HiprtGpuTests.cmake adds tests.
#
# Sets HIPRT_GPU_PLATFORM to AMD, NVIDIA or OFF, and HIPRT_GPU_REASON to one line that says why. Makes the target
# hiprt::gpu: the include folders and the runtime library for C++ code that includes <hiprt_build/gpu/gpu.h>.
# hiprt_amd_problem and hiprt_nvidia_problem name the missing parts of each platform. Empty: it can compile.
#
# Other projects call hiprt_gpu_objects() too, after add_subdirectory, FetchContent or find_package (component gpu).
# They see cache variables only, so the results of this file are cache variables.

set(HIPRT_GPU "AUTO" CACHE STRING
  "Platform of GPU code: AMD (hipcc), NVIDIA (nvcc), OFF, or AUTO: NVIDIA if nvcc and an NVIDIA GPU are here, else AMD \
if hipcc is, else NVIDIA if nvcc is, else OFF")
set_property(CACHE HIPRT_GPU PROPERTY STRINGS AUTO AMD NVIDIA OFF)
set(HIPRT_AMD_ARCHS "gfx90a;gfx1030;gfx1100" CACHE STRING "AMD architectures that GPU code is compiled for")
set(HIPRT_NVIDIA_ARCHS "90" CACHE STRING "NVIDIA compute capabilities that GPU code is compiled for")
set(HIPRT_GPU_FLAGS "" CACHE STRING "More compiler flags of every .hip source")
set(HIPRT_GPU_OPTIMIZATION "-O3" CACHE STRING
  "Optimisation of .hip sources. -O1: kernels are slower, and compile and emulate in two thirds of the time")
mark_as_advanced(HIPRT_GPU_OPTIMIZATION)

# hiprt_check_archs(<variable> <pattern> <example>): stops at an architecture that does not fit the pattern.
function(hiprt_check_archs variable pattern example)
  foreach(arch IN LISTS ${variable})
    if(NOT arch MATCHES "^${pattern}$")
      message(FATAL_ERROR "${variable}: '${arch}' is no architecture. Write them as ${example}")
    endif()
  endforeach()
endfunction()
hiprt_check_archs(HIPRT_AMD_ARCHS "gfx[0-9a-f]+(:[a-z]+[+-])*" "gfx1030;gfx1100")
hiprt_check_archs(HIPRT_NVIDIA_ARCHS "(sm_)?[1-9][0-9]+[af]?" "80;90")
# sm_90 is another way to write 90.
string(REPLACE "sm_" "" archs "${HIPRT_NVIDIA_ARCHS}")
set_property(CACHE HIPRT_NVIDIA_ARCHS PROPERTY VALUE "${archs}")
unset(archs)

# hiprt_find_amd(<problem>): sets HIPRT_HIPCC, HIPRT_OFFLOAD_BUNDLER, HIPRT_AMDHIP64, HIPRT_HIP_INCLUDE_DIR and
# HIPRT_HIP_DEVICE_LIBS. <problem> names the missing part, or is empty.
function(hiprt_find_amd problem)
  set(rocm /opt/rocm)
  find_program(HIPRT_HIPCC hipcc HINTS ${rocm}/bin DOC "AMD's compiler driver")
  find_library(HIPRT_AMDHIP64 amdhip64 HINTS ${rocm}/lib DOC "AMD's HIP runtime")
  find_path(HIPRT_HIP_INCLUDE_DIR hip/hip_runtime.h HINTS ${rocm}/include DOC "Folder of AMD's hip/hip_runtime.h")
  mark_as_advanced(HIPRT_HIPCC HIPRT_AMDHIP64 HIPRT_HIP_INCLUDE_DIR)
  set(missing "")
  if(NOT HIPRT_HIPCC)
    set(missing "hipcc")
  elseif(NOT HIPRT_AMDHIP64)
    set(missing "libamdhip64")
  elseif(NOT HIPRT_HIP_INCLUDE_DIR)
    set(missing "hip/hip_runtime.h")
  endif()
  if(missing)
    set(${problem} "no ${missing} (tools/install-packages gpu)" PARENT_SCOPE)
    return()
  endif()
  # hipcc's own clang knows where the bundler of its version is.
  execute_process(COMMAND ${CMAKE_COMMAND} -E env HIP_PLATFORM=amd ${HIPRT_HIPCC} --offload-arch=gfx1030
    -print-prog-name=clang-offload-bundler OUTPUT_VARIABLE bundler ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env HIP_PLATFORM=amd ${HIPRT_HIPCC} --version
    OUTPUT_VARIABLE version ERROR_QUIET)
  string(REGEX REPLACE ".*clang version ([0-9]+).*" "\\1" version "${version}")
  set(HIPRT_HIPCC_CLANG "${version}" CACHE INTERNAL "Major version of hipcc's clang")
  execute_process(COMMAND ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/hip_device_libs.sh ${PROJECT_BINARY_DIR}/hip-device-libs
    RESULT_VARIABLE status OUTPUT_VARIABLE libs ERROR_VARIABLE libs_error OUTPUT_STRIP_TRAILING_WHITESPACE)
  set(${problem} "" PARENT_SCOPE)
  if(NOT EXISTS "${bundler}")
    set(${problem} "hipcc has no clang-offload-bundler (tools/install-packages gpu)" PARENT_SCOPE)
  elseif(NOT status EQUAL 0)
    set(${problem} "${libs}${libs_error}" PARENT_SCOPE)
  endif()
  # Newer bundlers want the host's whole triple.
  set(host host-x86_64-unknown-linux)
  execute_process(COMMAND ${bundler} -type=o -targets=${host},hipv4-amdgcn-amd-amdhsa--gfx1030 -input=/dev/null
    -input=/dev/null -output=${PROJECT_BINARY_DIR}/bundle_test RESULT_VARIABLE refused OUTPUT_QUIET ERROR_QUIET)
  if(refused)
    string(APPEND host -gnu)
  endif()
  set(HIPRT_BUNDLER_HOST ${host} CACHE INTERNAL "The host as the bundler wants it")
  set(HIPRT_OFFLOAD_BUNDLER "${bundler}" CACHE INTERNAL "The bundler of hipcc's clang")
  set(HIPRT_HIP_DEVICE_LIBS "${libs}" CACHE INTERNAL "Folder of the device library")
endfunction()

# hiprt_find_nvidia(<problem>): sets HIPRT_NVCC and makes the targets of CMake's FindCUDAToolkit.
macro(hiprt_find_nvidia problem)
  find_package(CUDAToolkit QUIET)
  set(HIPRT_NVCC "${CUDAToolkit_NVCC_EXECUTABLE}" CACHE INTERNAL "NVIDIA's compiler driver")
  set(${problem} "")
  if(NOT CUDAToolkit_FOUND OR NOT HIPRT_NVCC)
    set(${problem} "no nvcc (CUDA toolkit)")
  endif()
endmacro()

# hiprt_choose_gpu(<amd problem> <nvidia problem>): sets HIPRT_GPU_PLATFORM and HIPRT_GPU_REASON.
function(hiprt_choose_gpu amd_problem nvidia_problem)
  set(nvidia_gpu FALSE)
  if(EXISTS /dev/nvidiactl OR EXISTS /proc/driver/nvidia/version)
    set(nvidia_gpu TRUE)
  endif()
  if(HIPRT_GPU STREQUAL "AUTO")
    if(nvidia_gpu AND NOT nvidia_problem)
      set(platform NVIDIA)
      set(reason "nvcc and an NVIDIA GPU are here")
    elseif(NOT amd_problem)
      set(platform AMD)
      set(reason "hipcc is here, nvcc and an NVIDIA GPU together are not")
    elseif(NOT nvidia_problem)
      set(platform NVIDIA)
      set(reason "nvcc is here, AMD: ${amd_problem}")
    else()
      set(platform OFF)
      set(reason "AMD: ${amd_problem}; NVIDIA: ${nvidia_problem}")
    endif()
  else()
    set(platform ${HIPRT_GPU})
    set(reason "HIPRT_GPU=${HIPRT_GPU}")
  endif()
  set(HIPRT_GPU_PLATFORM ${platform} CACHE INTERNAL "AMD, NVIDIA or OFF")
  set(HIPRT_GPU_REASON "${reason}" CACHE INTERNAL "Why HIPRT_GPU_PLATFORM is what it is")
endfunction()

set(hiprt_amd_problem "not asked for")
set(hiprt_nvidia_problem "not asked for")
if(NOT HIPRT_GPU MATCHES "^(AUTO|AMD|NVIDIA|OFF)$")
  message(FATAL_ERROR "HIPRT_GPU=${HIPRT_GPU}: must be AUTO, AMD, NVIDIA or OFF")
endif()
if(NOT HIPRT_GPU STREQUAL "OFF")
  hiprt_find_amd(hiprt_amd_problem)
  hiprt_find_nvidia(hiprt_nvidia_problem)
endif()
hiprt_choose_gpu("${hiprt_amd_problem}" "${hiprt_nvidia_problem}")
if(HIPRT_GPU STREQUAL "AMD" AND hiprt_amd_problem)
  message(FATAL_ERROR "HIPRT_GPU=AMD: ${hiprt_amd_problem}")
elseif(HIPRT_GPU STREQUAL "NVIDIA" AND hiprt_nvidia_problem)
  message(FATAL_ERROR "HIPRT_GPU=NVIDIA: ${hiprt_nvidia_problem}")
endif()

if(HIPRT_GPU_PLATFORM STREQUAL "AMD")
  message(STATUS "hiprt GPU code: AMD ${HIPRT_AMD_ARCHS} (${HIPRT_GPU_REASON})")
  add_library(hiprt_gpu INTERFACE)
  target_compile_definitions(hiprt_gpu INTERFACE __HIP_PLATFORM_AMD__)
  target_include_directories(hiprt_gpu SYSTEM INTERFACE ${HIPRT_HIP_INCLUDE_DIR})
  target_link_libraries(hiprt_gpu INTERFACE ${HIPRT_AMDHIP64})
elseif(HIPRT_GPU_PLATFORM STREQUAL "NVIDIA")
  message(STATUS "hiprt GPU code: NVIDIA ${HIPRT_NVIDIA_ARCHS} (${HIPRT_GPU_REASON})")
  add_library(hiprt_gpu INTERFACE)
  target_include_directories(hiprt_gpu INTERFACE ${CMAKE_CURRENT_LIST_DIR}/hip_nvidia)
  target_include_directories(hiprt_gpu SYSTEM INTERFACE ${CUDAToolkit_INCLUDE_DIRS})
  # By path: imported targets are unknown in the folder of a project that has added this one.
  find_package(Threads REQUIRED)
  target_link_libraries(hiprt_gpu INTERFACE ${CUDA_cudart_static_LIBRARY} ${CMAKE_DL_LIBS} ${CMAKE_THREAD_LIBS_INIT} rt)
else()
  message(STATUS "hiprt GPU code: OFF (${HIPRT_GPU_REASON})")
endif()
if(TARGET hiprt_gpu)
  target_link_libraries(hiprt_gpu INTERFACE hiprt::device)
  add_library(hiprt::gpu ALIAS hiprt_gpu)
endif()

# hiprt_gpu_flags(<target> <variable>): the flags that a .hip source of the target shares with its C++ sources. These
# are the include folders and definitions, also of linked libraries, and the configuration. Compile options are left
# out, because they are for the C++ compiler: see OPTIONS below and HIPRT_GPU_FLAGS. For an interface library: the flags
# of its users.
function(hiprt_gpu_flags target variable)
  set(interface "")
  get_target_property(type ${target} TYPE)
  if(type STREQUAL "INTERFACE_LIBRARY")
    set(interface INTERFACE_)
  endif()
  # Kernels keep forced inlining: they compile as fast with it (gpu_kernels_one_level.hip: 8.5 s, 9.0 s without).
  set(definitions "$<TARGET_PROPERTY:${target},${interface}COMPILE_DEFINITIONS>")
  set(definitions "$<FILTER:${definitions},EXCLUDE,^HIPRT_LEAVE_INLINING$>")
  # An explicit /usr/include would come before the compiler's own folders, which must come first.
  set(folders "$<TARGET_PROPERTY:${target},${interface}INCLUDE_DIRECTORIES>")
  set(folders "$<REMOVE_DUPLICATES:$<FILTER:${folders},EXCLUDE,^/usr/include$>>")
  # The caller's project.
  string(REGEX REPLACE "([][+.*()^$?|\\])" "\\\\\\1" root "${PROJECT_SOURCE_DIR}")
  set(own "$<FILTER:${folders},INCLUDE,^${root}>")
  set(others "$<FILTER:${folders},EXCLUDE,^${root}>")
  separate_arguments(more NATIVE_COMMAND "${HIPRT_GPU_FLAGS}")
  set(${variable}
    -std=c++20 -O3 "$<$<CONFIG:Debug>:-g>" "$<$<NOT:$<CONFIG:Debug>>:-DNDEBUG>"
    "$<$<BOOL:${definitions}>:-D$<JOIN:${definitions},$<SEMICOLON>-D>>"
    "$<$<BOOL:${own}>:-I$<JOIN:${own},$<SEMICOLON>-I>>"
    "$<$<BOOL:${others}>:-isystem$<SEMICOLON>$<JOIN:${others},$<SEMICOLON>-isystem$<SEMICOLON>>>"
    ${more} PARENT_SCOPE)
endfunction()

# hiprt_amd_command(<variable> <arch>): hipcc with the options of every AMD compilation.
function(hiprt_amd_command variable arch)
  set(${variable} ${CMAKE_COMMAND} -E env HIP_PLATFORM=amd ${HIPRT_HIPCC} -Wall -Wextra -Wconversion -Wshadow
    $<$<BOOL:${HIPRT_WARNINGS_AS_ERRORS}>:-Werror> -Wno-unused-command-line-argument
    --offload-arch=${arch} --rocm-device-lib-path=${HIPRT_HIP_DEVICE_LIBS} PARENT_SCOPE)
endfunction()

# hiprt_nvidia_command(<variable> <arch>...): nvcc with the options of every NVIDIA compilation. The host compiler reads
# the output of cudafe++, which adds parentheses.
function(hiprt_nvidia_command variable)
  set(command ${HIPRT_NVCC} -ccbin ${CMAKE_CXX_COMPILER} -x cu --expt-relaxed-constexpr
    -Xcompiler=-Wall,-Wextra,-Wno-parentheses)
  if(HIPRT_WARNINGS_AS_ERRORS)
    list(APPEND command -Werror all-warnings -Xcompiler=-Werror)
  endif()
  foreach(arch IN LISTS ARGN)
    list(APPEND command -gencode arch=compute_${arch},code=sm_${arch})
  endforeach()
  set(${variable} ${command} --threads 0 PARENT_SCOPE)
endfunction()

# hiprt_amd_dependencies(<variable> <output>): options by which hipcc writes the names of the files that it reads to
# <output>.d. clang 21 ignores -MF when it compiles for the device alone.
function(hiprt_amd_dependencies variable output)
  set(options "")
  foreach(option IN ITEMS -dependency-file ${output}.d -MT ${output} -sys-header-deps)
    list(APPEND options -Xclang ${option})
  endforeach()
  set(${variable} ${options} PARENT_SCOPE)
endfunction()

# hiprt_amd_object(<source> <stem> <flag>...): makes <stem>.o from one code object per architecture. Each has a command
# of its own, so that they compile in parallel. The source's property HIPRT_FLAGS_<arch> has more flags of one of them,
# HIPRT_FLAGS_HOST those of the host's code.
function(hiprt_amd_object source stem)
  set(inputs -input=/dev/null)
  set(targets ${HIPRT_BUNDLER_HOST})
  set(images "")
  foreach(arch IN LISTS HIPRT_AMD_ARCHS)
    hiprt_amd_command(command ${arch})
    set(image ${stem}.${arch}.co)
    hiprt_amd_dependencies(dependencies ${image})
    get_source_file_property(more ${source} HIPRT_FLAGS_${arch})
    if(NOT more)
      set(more "")
    endif()
    add_custom_command(OUTPUT ${image}
      COMMAND ${command} --cuda-device-only --no-gpu-bundle-output ${ARGN} ${more}
        -c ${source} -o ${image} ${dependencies}
      DEPENDS ${source} DEPFILE ${image}.d COMMAND_EXPAND_LISTS VERBATIM
      COMMENT "Compiling ${source} for ${arch}")
    list(APPEND images ${image})
    list(APPEND inputs -input=${image})
    list(APPEND targets hipv4-amdgcn-amd-amdhsa--${arch})
  endforeach()
  list(JOIN targets "," targets)
  list(GET HIPRT_AMD_ARCHS 0 first)
  hiprt_amd_command(command ${first})
  get_source_file_property(more ${source} HIPRT_FLAGS_HOST)
  if(NOT more)
    set(more "")
  endif()
  add_custom_command(OUTPUT ${stem}.o
    COMMAND ${HIPRT_OFFLOAD_BUNDLER} -type=o -bundle-align=4096 -targets=${targets} ${inputs} -output=${stem}.hipfb
    COMMAND ${command} --cuda-host-only -Xclang -fcuda-include-gpubinary -Xclang ${stem}.hipfb -fPIC ${ARGN} ${more}
      -c ${source} -o ${stem}.o -MD -MT ${stem}.o -MF ${stem}.o.d
    DEPENDS ${source} ${images} BYPRODUCTS ${stem}.hipfb DEPFILE ${stem}.o.d COMMAND_EXPAND_LISTS VERBATIM
    COMMENT "Compiling ${source} for the host")
endfunction()

function(hiprt_nvidia_object source stem)
  hiprt_nvidia_command(command ${HIPRT_NVIDIA_ARCHS})
  add_custom_command(OUTPUT ${stem}.o
    COMMAND ${command} -Xcompiler=-fPIC ${ARGN} -c ${source} -o ${stem}.o -MD -MT ${stem}.o -MF ${stem}.o.d
    DEPENDS ${source} DEPFILE ${stem}.o.d COMMAND_EXPAND_LISTS VERBATIM
    COMMENT "Compiling ${source} for sm_${HIPRT_NVIDIA_ARCHS} and the host")
endfunction()

# hiprt_gpu_objects(<target> <source.hip>... [OPTIONS <option>...])
# Compiles the sources with the platform's GPU compiler, adds the objects to <target> and links hiprt::gpu to it.
# Include folders and definitions are the target's, set before or after this call; OPTIONS go to hipcc or nvcc. Call it
# in the folder that makes the target. Without a platform (HIPRT_GPU_PLATFORM is OFF) it is an error.
function(hiprt_gpu_objects target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "OPTIONS")
  hiprt_gpu_flags(${target} flags)
  # CMake knows no language for a target of objects alone.
  get_target_property(sources ${target} SOURCES)
  get_target_property(language ${target} LINKER_LANGUAGE)
  if(NOT sources AND NOT language)
    set_target_properties(${target} PROPERTIES LINKER_LANGUAGE CXX)
  endif()
  set(optimization ${HIPRT_GPU_OPTIMIZATION})
  # At -O1 the back end of clang 21 gives "S_OR_B32" two literals, which its own check refuses.
  if(HIPRT_GPU_PLATFORM STREQUAL "AMD" AND optimization STREQUAL "-O1" AND HIPRT_HIPCC_CLANG VERSION_GREATER_EQUAL 21)
    set(optimization -O2)
  endif()
  list(APPEND flags ${optimization})
  foreach(source IN LISTS arg_UNPARSED_ARGUMENTS)
    cmake_path(ABSOLUTE_PATH source NORMALIZE)
    cmake_path(RELATIVE_PATH source BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} OUTPUT_VARIABLE stem)
    string(REPLACE "../" "up/" stem "${stem}")
    set(stem ${CMAKE_CURRENT_BINARY_DIR}/${target}.gpu/${stem})
    cmake_path(GET stem PARENT_PATH folder)
    file(MAKE_DIRECTORY ${folder})
    if(HIPRT_GPU_PLATFORM STREQUAL "AMD")
      hiprt_amd_object(${source} ${stem} ${flags} ${arg_OPTIONS})
    elseif(HIPRT_GPU_PLATFORM STREQUAL "NVIDIA")
      hiprt_nvidia_object(${source} ${stem} ${flags} ${arg_OPTIONS})
    else()
      message(FATAL_ERROR "${source}: no compiler for GPU code: ${HIPRT_GPU_REASON}")
    endif()
    target_sources(${target} PRIVATE ${stem}.o)
    set_source_files_properties(${stem}.o PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
  endforeach()
  # An installed target does not need it.
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:hiprt::gpu>)
endfunction()
