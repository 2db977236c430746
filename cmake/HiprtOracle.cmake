# hiprt_oracle: exact reference results (GMP) and mesh generators of tests/oracle, for tests and benchmarks.

find_path(HIPRT_GMPXX_INCLUDE_DIR gmpxx.h REQUIRED DOC "Folder of gmpxx.h (Debian: libgmp-dev)")
find_library(HIPRT_GMPXX_LIBRARY gmpxx REQUIRED DOC "GMP's C++ library (Debian: libgmp-dev)")
find_library(HIPRT_GMP_LIBRARY gmp REQUIRED DOC "GMP (Debian: libgmp-dev)")
mark_as_advanced(HIPRT_GMPXX_INCLUDE_DIR HIPRT_GMPXX_LIBRARY HIPRT_GMP_LIBRARY)

add_library(hiprt_oracle INTERFACE)
target_include_directories(hiprt_oracle SYSTEM INTERFACE ${HIPRT_GMPXX_INCLUDE_DIR})
target_link_libraries(hiprt_oracle INTERFACE ${HIPRT_GMPXX_LIBRARY} ${HIPRT_GMP_LIBRARY})
