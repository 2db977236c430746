# Packages of CPack: for Debian libhiprt-build2 (the shared library), libhiprt-dev (headers, static libraries, CMake
# and pkg-config files), hiprt-tools (programs, manual pages, completions) and libhiprt0300164 (takes libhiprt's place);
# for other systems one archive (TGZ).
# tools/package makes and checks them.
#
# Equal sources give equal packages: with SOURCE_DATE_EPOCH in the environment, also in other folders.

set(HIPRT_PACKAGE_CONTACT "hiprt contributors <hiprt@packages.invalid>" CACHE STRING "Maintainer of the packages")
mark_as_advanced(HIPRT_PACKAGE_CONTACT)
set(hiprt_packages ${PROJECT_SOURCE_DIR}/cmake/packages)
set(hiprt_package_files ${PROJECT_BINARY_DIR}/packages)

# pkg-config. Relocatable: the folder of the file is known to pkg-config.
file(RELATIVE_PATH pc_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
string(REGEX REPLACE "/$" "" pc_prefix "\${pcfiledir}/${pc_prefix}")
set(pc_includedir "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
set(pc_libdir "\${prefix}/${CMAKE_INSTALL_LIBDIR}")
set(hiprt_pkgconfig device)
if(HIPRT_BUILD_FORMAT)
  list(APPEND hiprt_pkgconfig format)
endif()
if(HIPRT_BUILD_LIBRARY)
  list(APPEND hiprt_pkgconfig build)
endif()
foreach(part IN LISTS hiprt_pkgconfig)
  configure_file(${hiprt_packages}/hiprt-${part}.pc.in ${hiprt_package_files}/hiprt-${part}.pc @ONLY)
  install(FILES ${hiprt_package_files}/hiprt-${part}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT ${part})
endforeach()

# Manual pages and completions: the tools print them. A cross build needs an emulator for that.
if(HIPRT_BUILD_TOOLS AND (NOT CMAKE_CROSSCOMPILING OR CMAKE_CROSSCOMPILING_EMULATOR))
  # Debian wants manual pages compressed. gzip -n writes no time.
  find_program(HIPRT_GZIP gzip REQUIRED)
  mark_as_advanced(HIPRT_GZIP)
  set(manuals "")
  foreach(tool IN ITEMS bvhbuild bvhinfo bvhquery bvhrender bvhtrace)
    set(page ${hiprt_package_files}/man/${tool}.1.gz)
    set(bash ${hiprt_package_files}/bash/${tool})
    set(zsh ${hiprt_package_files}/zsh/_${tool})
    set(fish ${hiprt_package_files}/fish/${tool}.fish)
    add_custom_command(OUTPUT ${page} ${bash} ${zsh} ${fish}
      COMMAND ${tool} --man > ${hiprt_package_files}/man/${tool}.1
      COMMAND ${HIPRT_GZIP} -9nf ${hiprt_package_files}/man/${tool}.1
      COMMAND ${tool} --completion bash > ${bash}
      COMMAND ${tool} --completion zsh > ${zsh}
      COMMAND ${tool} --completion fish > ${fish}
      DEPENDS ${tool} VERBATIM COMMENT "Writing the manual page and completions of ${tool}")
    list(APPEND manuals ${page})
    install(FILES ${page} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT tools)
    install(FILES ${bash} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT tools)
    install(FILES ${zsh} DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT tools)
    install(FILES ${fish} DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT tools)
  endforeach()
  file(MAKE_DIRECTORY ${hiprt_package_files}/man ${hiprt_package_files}/bash ${hiprt_package_files}/zsh
    ${hiprt_package_files}/fish)
  add_custom_target(hiprt_manuals ALL DEPENDS ${manuals})
endif()

set(CPACK_PACKAGE_NAME hiprt)
set(CPACK_PACKAGE_VENDOR "hiprt contributors")
set(CPACK_PACKAGE_CONTACT "${HIPRT_PACKAGE_CONTACT}")
# The first line of each CPACK_DEBIAN_*_DESCRIPTION is the summary of its package.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_PRE_BUILD_SCRIPTS ${hiprt_packages}/bundle.cmake)

# One archive of everything. Its name has the machine, because it holds programs.
set(CPACK_ARCHIVE_COMPONENT_INSTALL OFF)
set(CPACK_SYSTEM_NAME "${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR}")

# Debian's packages: one per group of components.
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

set(hiprt_library_package libhiprt-build${HIPRT_ABI})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME ${hiprt_library_package})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
configure_file(${hiprt_packages}/shlibs.in ${hiprt_package_files}/shlibs @ONLY)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${hiprt_packages}/symbols ${hiprt_package_files}/shlibs
  ${hiprt_packages}/triggers)
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "builders of bounding volume hierarchies for ray tracing
The shared library hiprt::build: builds, checks and opens BVH files for CPUs
and GPUs. Programs that were linked with it need this package.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libhiprt-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
set(hiprt_dev_depends "${hiprt_library_package} (= ${PROJECT_VERSION})" libglm-dev libexpected-dev)
if(HIPRT_THREADS STREQUAL "tbb")
  list(APPEND hiprt_dev_depends libtbb-dev)
endif()
if(HIPRT_EMBREE_VERSION)
  list(APPEND hiprt_dev_depends libembree-dev)
endif()
list(JOIN hiprt_dev_depends ", " CPACK_DEBIAN_DEV_PACKAGE_DEPENDS)
set(CPACK_DEBIAN_DEV_DESCRIPTION "ray traversal in headers, and the builder library (development files)
Headers for kernels of HIP and CUDA and for C++20: closest, any and all hits,
instances, motion blur, custom primitives. With the static libraries of the
builders, and files for CMake and pkg-config.")

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME hiprt-tools)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_TOOLS_DESCRIPTION "command line tools that build, check, trace and render BVH files
bvhbuild builds a bounding volume hierarchy of meshes, shapes or scenes of
instances; bvhinfo describes and checks it; bvhtrace traces rays; bvhquery
finds what is near points and in boxes; bvhrender renders pictures.")

set(hiprt_package_groups library dev tools)
if(TARGET hiprt_api)
  list(APPEND hiprt_package_groups hiprt_api)
  set(CPACK_DEBIAN_HIPRT_API_PACKAGE_NAME libhiprt0300164)
  set(CPACK_DEBIAN_HIPRT_API_PACKAGE_SECTION libs)
  set(CPACK_DEBIAN_HIPRT_API_PACKAGE_CONTROL_EXTRA ${hiprt_packages}/triggers)
  set(CPACK_DEBIAN_HIPRT_API_DESCRIPTION "ray tracing library for programs of AMD's HIPRT
The shared library libhiprt0300164.so has the functions of HIPRT 3.1 for one
kind of GPU. It needs the driver of the GPU, and a run-time compiler for
kernels that programs bring as source.")
endif()

# Debian wants a copyright file and a changelog in each package.
file(READ ${PROJECT_SOURCE_DIR}/LICENSE license)
string(REGEX REPLACE "^MIT License\n\nCopyright[^\n]*\n\n" "" license "${license}")
string(STRIP "${license}" license)
string(REPLACE "\n\n" "\n.\n" license "${license}")
string(REPLACE "\n" "\n " license " ${license}")
configure_file(${hiprt_packages}/copyright.in ${hiprt_package_files}/copyright @ONLY)
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
configure_file(${hiprt_packages}/changelog.in ${hiprt_package_files}/changelog @ONLY)
if(HIPRT_GZIP)
  execute_process(COMMAND ${HIPRT_GZIP} -9nc ${hiprt_package_files}/changelog
    OUTPUT_FILE ${hiprt_package_files}/changelog.gz)
  foreach(group IN LISTS hiprt_package_groups)
    string(TOUPPER ${group} upper)
    install(FILES ${hiprt_package_files}/copyright ${hiprt_package_files}/changelog.gz COMPONENT debian_${group}
      DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME} EXCLUDE_FROM_ALL)
  endforeach()
endif()

include(CPack)
cpack_add_component_group(library)
cpack_add_component_group(dev)
cpack_add_component_group(tools)
foreach(component IN ITEMS debian_library library)
  cpack_add_component(${component} GROUP library)
endforeach()
foreach(component IN ITEMS debian_dev device format build)
  cpack_add_component(${component} GROUP dev)
endforeach()
foreach(component IN ITEMS debian_tools tools)
  cpack_add_component(${component} GROUP tools)
endforeach()
if(TARGET hiprt_api)
  cpack_add_component_group(hiprt_api)
  foreach(component IN ITEMS debian_hiprt_api hiprt_api)
    cpack_add_component(${component} GROUP hiprt_api)
  endforeach()
endif()
