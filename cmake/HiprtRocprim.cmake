# Finds the architectures of HIPRT_AMD_ARCHS for which the installed rocPRIM compiles. The GPU builders sort with
# rocPRIM on these, and with their own radix sort on the others.
#
# Sets HIPRT_ROCPRIM_ARCHS, and HIPRT_ROCPRIM_FLAGS for the compiler. Debian 12's rocPRIM (5.3) does not
# compile for gfx1100.

set(HIPRT_ROCPRIM "AUTO" CACHE STRING "Sort with rocPRIM on AMD GPUs: AUTO (where it knows the GPU) or OFF")
set_property(CACHE HIPRT_ROCPRIM PROPERTY STRINGS AUTO OFF)
if(NOT HIPRT_ROCPRIM MATCHES "^(AUTO|OFF)$")
  message(FATAL_ERROR "HIPRT_ROCPRIM=${HIPRT_ROCPRIM}: must be AUTO or OFF")
endif()
find_path(HIPRT_ROCPRIM_INCLUDE_DIR rocprim/device/device_radix_sort.hpp HINTS /opt/rocm/include
  DOC "Folder of rocprim/ (Debian: librocprim-dev)")
mark_as_advanced(HIPRT_ROCPRIM_INCLUDE_DIR)

# An explicit /usr/include would come before the compiler's own folders, which must come first.
set(HIPRT_ROCPRIM_FLAGS "")
if(HIPRT_ROCPRIM_INCLUDE_DIR AND NOT HIPRT_ROCPRIM_INCLUDE_DIR STREQUAL "/usr/include")
  set(HIPRT_ROCPRIM_FLAGS -isystem ${HIPRT_ROCPRIM_INCLUDE_DIR})
endif()
# Newer versions of rocPRIM call hipGetStreamDeviceId(), which amdrun lacks.
set(hiprt_rocprim_wanted ${HIPRT_ROCPRIM})
if(HIPRT_BUILD_TESTS AND HIPRT_ROCPRIM_INCLUDE_DIR AND NOT EXISTS /dev/kfd)
  execute_process(COMMAND grep -rlq hipGetStreamDeviceId ${HIPRT_ROCPRIM_INCLUDE_DIR}/rocprim RESULT_VARIABLE status)
  if(status EQUAL 0)
    message(STATUS "hiprt: no rocPRIM: tests run on an emulator that lacks hipGetStreamDeviceId()")
    set(hiprt_rocprim_wanted OFF)
  endif()
endif()
set(known "")
if(hiprt_rocprim_wanted STREQUAL "AUTO" AND HIPRT_ROCPRIM_INCLUDE_DIR)
  set(source ${PROJECT_BINARY_DIR}/rocprim_test.hip)
  file(WRITE ${source} "#include <hip/hip_runtime.h>
#include <rocprim/device/device_radix_sort.hpp>
hipError_t sort(void* temp, std::size_t& bytes, unsigned long* keys, unsigned* values) {
  rocprim::double_buffer<unsigned long> both(keys, keys);
  rocprim::double_buffer<unsigned> others(values, values);
  return rocprim::radix_sort_pairs(temp, bytes, both, others, 1);
}
")
  foreach(arch IN LISTS HIPRT_AMD_ARCHS)
    # The result is kept for this compiler, this rocPRIM and this architecture.
    string(MAKE_C_IDENTIFIER "${HIPRT_HIPCC} ${HIPRT_HIPCC_CLANG} ${HIPRT_ROCPRIM_INCLUDE_DIR} ${arch}" key)
    if(NOT DEFINED HIPRT_ROCPRIM_COMPILES_${key})
      execute_process(COMMAND ${CMAKE_COMMAND} -E env HIP_PLATFORM=amd ${HIPRT_HIPCC} -std=c++20 -O1 -w
        --offload-arch=${arch} --rocm-device-lib-path=${HIPRT_HIP_DEVICE_LIBS} ${HIPRT_ROCPRIM_FLAGS}
        --cuda-device-only -c ${source} -o ${source}.o RESULT_VARIABLE status OUTPUT_QUIET ERROR_QUIET)
      string(COMPARE EQUAL "${status}" 0 compiles)
      set(HIPRT_ROCPRIM_COMPILES_${key} ${compiles} CACHE INTERNAL "Whether rocPRIM compiles for ${arch}")
    endif()
    if(HIPRT_ROCPRIM_COMPILES_${key})
      list(APPEND known ${arch})
    endif()
  endforeach()
endif()
set(HIPRT_ROCPRIM_ARCHS "${known}" CACHE INTERNAL "Architectures whose GPU builders sort with rocPRIM")
list(JOIN known " " text)
if(text)
  message(STATUS "hiprt: GPU builders sort with rocPRIM on ${text}")
endif()
