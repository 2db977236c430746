# What the builder library's loops run on: oneTBB, or std::thread where there is no oneTBB.
#
# The interface library hiprt_threads links it and defines HIPRT_STD_THREADS as 0 or 1 (hiprt_build/exec/threads.h).

set(HIPRT_THREADS "tbb" CACHE STRING "Threads of the builder library: tbb (oneTBB) or std (std::thread: slower)")
set_property(CACHE HIPRT_THREADS PROPERTY STRINGS tbb std)
if(NOT HIPRT_THREADS MATCHES "^(tbb|std)$")
  message(FATAL_ERROR "HIPRT_THREADS=${HIPRT_THREADS}: must be tbb or std")
endif()

add_library(hiprt_threads INTERFACE)
if(HIPRT_THREADS STREQUAL "tbb")
  find_package(TBB CONFIG)
  if(NOT TBB_FOUND)
    message(FATAL_ERROR "HIPRT_THREADS=tbb: oneTBB is not installed (Debian: libtbb-dev). HIPRT_THREADS=std needs none")
  endif()
  set(HIPRT_THREAD_LIBRARY TBB::tbb)
  target_compile_definitions(hiprt_threads INTERFACE HIPRT_STD_THREADS=0)
else()
  find_package(Threads REQUIRED)
  set(HIPRT_THREAD_LIBRARY Threads::Threads)
  target_compile_definitions(hiprt_threads INTERFACE HIPRT_STD_THREADS=1)
endif()
target_link_libraries(hiprt_threads INTERFACE ${HIPRT_THREAD_LIBRARY})
