# Finds Embree, whose builders and rays hiprt can use: version 3.13 or 4.
#
# HIPRT_EMBREE_VERSION becomes its version, or 0 without Embree. The interface library hiprt_embree links it and defines
# HIPRT_EMBREE_MAJOR as 3, 4 or 0. Without Embree it links nothing.

set(HIPRT_EMBREE "AUTO" CACHE STRING
  "Embree's builders, and the tests and benchmarks that compare with it: ON, OFF, or AUTO: if Embree is installed")
set_property(CACHE HIPRT_EMBREE PROPERTY STRINGS AUTO ON OFF)
if(NOT HIPRT_EMBREE MATCHES "^(AUTO|ON|OFF)$")
  message(FATAL_ERROR "HIPRT_EMBREE=${HIPRT_EMBREE}: must be AUTO, ON or OFF")
endif()

set(HIPRT_EMBREE_VERSION 0)
if(NOT HIPRT_EMBREE STREQUAL "OFF")
  foreach(wanted IN ITEMS 4 3.13)
    if(NOT embree_FOUND)
      find_package(embree ${wanted} CONFIG QUIET)
    endif()
  endforeach()
  if(embree_FOUND)
    set(HIPRT_EMBREE_VERSION ${embree_VERSION})
  elseif(HIPRT_EMBREE STREQUAL "ON")
    message(FATAL_ERROR "HIPRT_EMBREE=ON: neither Embree 4 nor Embree 3.13 is installed (Debian: libembree-dev)")
  endif()
endif()
if(HIPRT_EMBREE_VERSION)
  message(STATUS "hiprt: Embree ${HIPRT_EMBREE_VERSION}")
else()
  message(STATUS "hiprt: no Embree; its builders refuse, and nothing is compared with it")
endif()

add_library(hiprt_embree INTERFACE)
string(REGEX MATCH "^[0-9]+" hiprt_embree_major "${HIPRT_EMBREE_VERSION}")
target_compile_definitions(hiprt_embree INTERFACE HIPRT_EMBREE_MAJOR=${hiprt_embree_major})
if(HIPRT_EMBREE_VERSION)
  target_link_libraries(hiprt_embree INTERFACE embree)
endif()
