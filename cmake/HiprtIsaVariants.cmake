# Sources that are compiled once per x86-64 level and chosen among at run time.

if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
  set(hiprt_default_isas "x86-64;x86-64-v3")
else()
  set(hiprt_default_isas "native-default")
endif()
set(HIPRT_TOOLS_ISAS "${hiprt_default_isas}" CACHE STRING
  "Instruction sets that the tools' kernels are compiled for (-march=...); native-default: the compiler's own")

# With it GCC below -O2 also clears the upper halves of AVX registers at the end of functions (vzeroupper). Otherwise
# later code for SSE, which is all code of other sources, can take several times as long.
set(HIPRT_CLEAN_REGISTERS $<$<CXX_COMPILER_ID:GNU>:-fexpensive-optimizations>)

# hiprt_add_isa_variants(<target> <source>...)
# Compiles the sources once per entry of HIPRT_TOOLS_ISAS with -march=<entry> and
#   HIPRT_ISA_NAME=<entry as an identifier>, for example x86_64_v3,
# adds the objects to <target>, and defines on <target> (and on its users) the X-macro list
#   HIPRT_ISA_LIST="HIPRT_ISA(x86_64) HIPRT_ISA(x86_64_v3)", worst first, for the run-time choice.
# The first of several variants is for machines over ten years old. It is compiled without forced inlining, in a quarter
# of the time.
# The object library of one variant is called <target>_<identifier>. All functions in these sources must be in hiprt's
# inline namespace of the ISA or have HIPRT_ISA_NAME in their name. They must emit no inline function of other
# namespaces: the linker keeps one copy of equal names, possibly the one for a newer CPU. tests/isa checks the objects.
function(hiprt_add_isa_variants target)
  set(list "")
  list(LENGTH HIPRT_TOOLS_ISAS count)
  list(GET HIPRT_TOOLS_ISAS 0 oldest)
  foreach(isa IN LISTS HIPRT_TOOLS_ISAS)
    string(MAKE_C_IDENTIFIER "${isa}" name)
    set(variant "${target}_${name}")
    add_library(${variant} OBJECT ${ARGN})
    hiprt_target(${variant})
    target_compile_definitions(${variant} PRIVATE HIPRT_ISA_NAME=${name})
    # Contraction of a * b + c would give each ISA its own last bits. The sources call fma where they need it.
    target_compile_options(${variant} PRIVATE -ffp-contract=off ${HIPRT_CLEAN_REGISTERS})
    if(NOT isa STREQUAL "native-default")
      target_compile_options(${variant} PRIVATE -march=${isa})
    endif()
    if(count GREATER 1 AND isa STREQUAL oldest)
      target_compile_definitions(${variant} PRIVATE HIPRT_LEAVE_INLINING)
      # GCC 12 warns of children that std::countr_zero(0) would be, where no caller passes 0.
      if(NOT HIPRT_PROGRAM_OPTIONS)
        target_compile_options(${variant} PRIVATE $<$<CONFIG:Release>:-O2>)
      endif()
      target_compile_options(${variant} PRIVATE -Wno-array-bounds)
    endif()
    target_link_libraries(${variant} PRIVATE hiprt::device)
    set_target_properties(${variant} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_sources(${target} PRIVATE $<TARGET_OBJECTS:${variant}>)
    string(APPEND list " HIPRT_ISA(${name})")
  endforeach()
  string(STRIP "${list}" list)
  target_compile_definitions(${target} PUBLIC "HIPRT_ISA_LIST=${list}")
endfunction()
