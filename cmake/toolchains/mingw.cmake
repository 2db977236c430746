# Debian's MinGW-w64 compiler for 64-bit Windows, and wine for the programs that a test runs. CMAKE_PREFIX_PATH is a
# folder with the headers and CMake files of GLM, tl::expected and nlohmann_json; HIPRT_XXHASH_INCLUDE_DIR has xxhash.h.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
# Programs then need no DLL of MinGW.
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
find_program(HIPRT_WINE NAMES wine64 wine64-stable wine PATHS /usr/lib/wine)
if(HIPRT_WINE)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${HIPRT_WINE})
endif()
