# Debian's cross compiler for 64-bit ARM, and qemu-user for the programs that a build or a test runs.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
find_program(HIPRT_QEMU NAMES qemu-aarch64 qemu-aarch64-static)
if(HIPRT_QEMU)
  # Without -L /usr/aarch64-linux-gnu: its ld.so and the libc of libtbb-dev:arm64 are of different versions, and
  # programs with threads hang.
  set(CMAKE_CROSSCOMPILING_EMULATOR ${HIPRT_QEMU})
endif()
