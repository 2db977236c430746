# Install rules and the package config. Components: device (headers), format (opens and checks files), build (builders;
# the shared library itself is in the component library), tools, and hiprt_api (the library that takes libhiprt's
# place). find_package(hiprt CONFIG COMPONENTS device format) needs neither oneTBB nor Embree.

include(CMakePackageConfigHelpers)
set(hiprt_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/hiprt)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/hiprt_device DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT device
  FILES_MATCHING PATTERN "*.h" PATTERN docs EXCLUDE PATTERN compat EXCLUDE)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/hiprt_device/compat/hiprt
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/hiprt_compat COMPONENT device FILES_MATCHING PATTERN "*.h")
install(TARGETS hiprt_device hiprt_compat EXPORT hiprtDeviceTargets)
# hiprt_gpu_objects(), and the header that gives CUDA's functions HIP's names.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/cmake/hip_nvidia DESTINATION ${hiprt_cmake_dir} COMPONENT device)
install(FILES ${PROJECT_SOURCE_DIR}/cmake/HiprtGpu.cmake ${PROJECT_SOURCE_DIR}/cmake/HiprtLanguages.cmake
  DESTINATION ${hiprt_cmake_dir} COMPONENT device)
install(PROGRAMS ${PROJECT_SOURCE_DIR}/cmake/hip_device_libs.sh DESTINATION ${hiprt_cmake_dir} COMPONENT device)
install(EXPORT hiprtDeviceTargets NAMESPACE hiprt:: DESTINATION ${hiprt_cmake_dir} COMPONENT device)

if(HIPRT_BUILD_FORMAT)
  foreach(header IN ITEMS buffer error export file open_scene trace_rays)
    install(FILES ${PROJECT_SOURCE_DIR}/hiprt_build/${header}.h
      DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/hiprt_build COMPONENT format)
  endforeach()
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/hiprt_build/format
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/hiprt_build COMPONENT format FILES_MATCHING PATTERN "*.h")
  install(FILES ${PROJECT_SOURCE_DIR}/hiprt_build/host/host_part.h
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/hiprt_build/host COMPONENT format)
  install(TARGETS hiprt_format EXPORT hiprtFormatTargets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT format)
  install(EXPORT hiprtFormatTargets NAMESPACE hiprt:: DESTINATION ${hiprt_cmake_dir} COMPONENT format)
endif()

if(HIPRT_BUILD_LIBRARY)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/hiprt_build DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT build
    FILES_MATCHING PATTERN "*.h" REGEX "/hiprt_build/[a-z_]+$" EXCLUDE)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/hiprt_build/gpu
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/hiprt_build COMPONENT build FILES_MATCHING PATTERN "*.h")
  set(hiprt_build_targets hiprt_build hiprt_build_static)
  foreach(target IN ITEMS hiprt_build_gpu hiprt_rtc)
    if(TARGET ${target})
      list(APPEND hiprt_build_targets ${target})
    endif()
  endforeach()
  install(TARGETS ${hiprt_build_targets} EXPORT hiprtBuildTargets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT build
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT build)
  install(EXPORT hiprtBuildTargets NAMESPACE hiprt:: DESTINATION ${hiprt_cmake_dir} COMPONENT build)
endif()

if(TARGET hiprt_api)
  install(TARGETS hiprt_api EXPORT hiprtApiTargets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT hiprt_api)
  install(EXPORT hiprtApiTargets NAMESPACE hiprt:: DESTINATION ${hiprt_cmake_dir} COMPONENT hiprt_api)
endif()

if(HIPRT_BUILD_TOOLS)
  install(TARGETS bvhbuild bvhinfo bvhquery bvhrender bvhtrace EXPORT hiprtToolsTargets
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tools)
  install(EXPORT hiprtToolsTargets NAMESPACE hiprt:: DESTINATION ${hiprt_cmake_dir} COMPONENT tools)
endif()

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/hiprtConfig.cmake.in
  ${PROJECT_BINARY_DIR}/hiprtConfig.cmake INSTALL_DESTINATION ${hiprt_cmake_dir})
# Before 1.0 a new minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/hiprtConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/hiprtConfig.cmake ${PROJECT_BINARY_DIR}/hiprtConfigVersion.cmake
  DESTINATION ${hiprt_cmake_dir} COMPONENT device)

include(HiprtPackages)
