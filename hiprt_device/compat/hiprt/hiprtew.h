#pragma once
/// Loads the library at run time: pointers with the names of its functions, for programs that do not link it.
///
///     #define _ENABLE_HIPRTEW  // In exactly one file.
///     #include <hiprt/hiprtew.h>
///     int result = 0;
///     hiprtewInit(&result);
///     if (result != HIPRTEW_SUCCESS) return;
///     hiprtCreateContext(HIPRT_API_VERSION, input, context);

#if defined(HIPRT_API_VERSION)
#error "hiprtew.h takes the place of hiprt.h: include one of them"
#endif

// The functions are declared under other names, so that the pointers can have theirs.
#define hiprtCreateContext hiprtCreateContext_of_library
#define hiprtDestroyContext hiprtDestroyContext_of_library
#define hiprtSetLogLevel hiprtSetLogLevel_of_library
#define hiprtSetCacheDirPath hiprtSetCacheDirPath_of_library
#define hiprtCreateGeometry hiprtCreateGeometry_of_library
#define hiprtCreateGeometries hiprtCreateGeometries_of_library
#define hiprtDestroyGeometry hiprtDestroyGeometry_of_library
#define hiprtDestroyGeometries hiprtDestroyGeometries_of_library
#define hiprtGetGeometryBuildTemporaryBufferSize hiprtGetGeometryBuildTemporaryBufferSize_of_library
#define hiprtGetGeometriesBuildTemporaryBufferSize hiprtGetGeometriesBuildTemporaryBufferSize_of_library
#define hiprtBuildGeometry hiprtBuildGeometry_of_library
#define hiprtBuildGeometries hiprtBuildGeometries_of_library
#define hiprtCompactGeometry hiprtCompactGeometry_of_library
#define hiprtCompactGeometries hiprtCompactGeometries_of_library
#define hiprtCreateScene hiprtCreateScene_of_library
#define hiprtCreateScenes hiprtCreateScenes_of_library
#define hiprtDestroyScene hiprtDestroyScene_of_library
#define hiprtDestroyScenes hiprtDestroyScenes_of_library
#define hiprtGetSceneBuildTemporaryBufferSize hiprtGetSceneBuildTemporaryBufferSize_of_library
#define hiprtGetScenesBuildTemporaryBufferSize hiprtGetScenesBuildTemporaryBufferSize_of_library
#define hiprtBuildScene hiprtBuildScene_of_library
#define hiprtBuildScenes hiprtBuildScenes_of_library
#define hiprtCompactScene hiprtCompactScene_of_library
#define hiprtCompactScenes hiprtCompactScenes_of_library
#define hiprtCreateFuncTable hiprtCreateFuncTable_of_library
#define hiprtSetFuncTable hiprtSetFuncTable_of_library
#define hiprtDestroyFuncTable hiprtDestroyFuncTable_of_library
#define hiprtCreateGlobalStackBuffer hiprtCreateGlobalStackBuffer_of_library
#define hiprtDestroyGlobalStackBuffer hiprtDestroyGlobalStackBuffer_of_library
#define hiprtSaveGeometry hiprtSaveGeometry_of_library
#define hiprtLoadGeometry hiprtLoadGeometry_of_library
#define hiprtSaveScene hiprtSaveScene_of_library
#define hiprtLoadScene hiprtLoadScene_of_library
#define hiprtExportGeometryAabb hiprtExportGeometryAabb_of_library
#define hiprtExportSceneAabb hiprtExportSceneAabb_of_library
#define hiprtBuildTraceKernels hiprtBuildTraceKernels_of_library
#define hiprtBuildTraceKernelsFromBitcode hiprtBuildTraceKernelsFromBitcode_of_library
#include <hiprt/hiprt.h>
#undef hiprtCreateContext
#undef hiprtDestroyContext
#undef hiprtSetLogLevel
#undef hiprtSetCacheDirPath
#undef hiprtCreateGeometry
#undef hiprtCreateGeometries
#undef hiprtDestroyGeometry
#undef hiprtDestroyGeometries
#undef hiprtGetGeometryBuildTemporaryBufferSize
#undef hiprtGetGeometriesBuildTemporaryBufferSize
#undef hiprtBuildGeometry
#undef hiprtBuildGeometries
#undef hiprtCompactGeometry
#undef hiprtCompactGeometries
#undef hiprtCreateScene
#undef hiprtCreateScenes
#undef hiprtDestroyScene
#undef hiprtDestroyScenes
#undef hiprtGetSceneBuildTemporaryBufferSize
#undef hiprtGetScenesBuildTemporaryBufferSize
#undef hiprtBuildScene
#undef hiprtBuildScenes
#undef hiprtCompactScene
#undef hiprtCompactScenes
#undef hiprtCreateFuncTable
#undef hiprtSetFuncTable
#undef hiprtDestroyFuncTable
#undef hiprtCreateGlobalStackBuffer
#undef hiprtDestroyGlobalStackBuffer
#undef hiprtSaveGeometry
#undef hiprtLoadGeometry
#undef hiprtSaveScene
#undef hiprtLoadScene
#undef hiprtExportGeometryAabb
#undef hiprtExportSceneAabb
#undef hiprtBuildTraceKernels
#undef hiprtBuildTraceKernelsFromBitcode

#if defined(_WIN32)
#include <windows.h>
#define HIPRT_LIB_NAME "hiprt" HIPRT_VERSION_STR "64.dll"
#else
#include <dlfcn.h>
#define HIPRT_LIB_NAME "libhiprt" HIPRT_VERSION_STR "64.so"
#endif

/// Results of hiprtewInit().
enum {
  HIPRTEW_SUCCESS = 0,
  HIPRTEW_ERROR_OPEN_FAILED = -1,
  HIPRTEW_ERROR_ATEXIT_FAILED = -2,
  HIPRTEW_ERROR_OLD_DRIVER = -3,  ///< The library lacks a function.
  HIPRTEW_NOT_INITIALIZED = -4,
};

#define HIPRTEW_FUNCTIONS(each)                                                                                       \
  each(hiprtCreateContext) each(hiprtDestroyContext) each(hiprtSetLogLevel) each(hiprtSetCacheDirPath)                \
      each(hiprtCreateGeometry) each(hiprtCreateGeometries) each(hiprtDestroyGeometry) each(hiprtDestroyGeometries)   \
          each(hiprtGetGeometryBuildTemporaryBufferSize) each(hiprtGetGeometriesBuildTemporaryBufferSize)             \
              each(hiprtBuildGeometry) each(hiprtBuildGeometries) each(hiprtCompactGeometry)                          \
                  each(hiprtCompactGeometries) each(hiprtCreateScene) each(hiprtCreateScenes) each(hiprtDestroyScene) \
                      each(hiprtDestroyScenes) each(hiprtGetSceneBuildTemporaryBufferSize)                            \
                          each(hiprtGetScenesBuildTemporaryBufferSize) each(hiprtBuildScene) each(hiprtBuildScenes)   \
                              each(hiprtCompactScene) each(hiprtCompactScenes) each(hiprtCreateFuncTable)             \
                                  each(hiprtSetFuncTable) each(hiprtDestroyFuncTable)                                 \
                                      each(hiprtCreateGlobalStackBuffer) each(hiprtDestroyGlobalStackBuffer)          \
                                          each(hiprtSaveGeometry) each(hiprtLoadGeometry) each(hiprtSaveScene)        \
                                              each(hiprtLoadScene) each(hiprtExportGeometryAabb)                      \
                                                  each(hiprtExportSceneAabb) each(hiprtBuildTraceKernels)             \
                                                      each(hiprtBuildTraceKernelsFromBitcode)

#if defined(_ENABLE_HIPRTEW)
#define HIPRTEW_POINTER(name) decltype(&name##_of_library) name = nullptr;
#else
#define HIPRTEW_POINTER(name) extern decltype(&name##_of_library) name;
#endif
HIPRTEW_FUNCTIONS(HIPRTEW_POINTER)  // NOLINT(misc-definitions-in-headers): one file of a program has them.
#undef HIPRTEW_POINTER

#if defined(_ENABLE_HIPRTEW)
namespace hiprt::compat_detail {

inline void* open_library() {
#if defined(_WIN32)
  return reinterpret_cast<void*>(LoadLibraryA(HIPRT_LIB_NAME));
#else
  return dlopen(HIPRT_LIB_NAME, RTLD_NOW);
#endif
}
template <typename Function> bool find_function(void* library, const char* name, Function& function) {
#if defined(_WIN32)
  function = reinterpret_cast<Function>(GetProcAddress(static_cast<HMODULE>(library), name));
#else
  function = reinterpret_cast<Function>(dlsym(library, name));
#endif
  return function != nullptr;
}

inline int load_functions() {
  void* const library = open_library();
  if (library == nullptr) return HIPRTEW_ERROR_OPEN_FAILED;
  bool complete = true;
#define HIPRTEW_FIND(name) complete = find_function(library, #name, name) && complete;
  HIPRTEW_FUNCTIONS(HIPRTEW_FIND)
#undef HIPRTEW_FIND
  return complete ? HIPRTEW_SUCCESS : HIPRTEW_ERROR_OLD_DRIVER;
}

}  // namespace hiprt::compat_detail

/// Loads the library at the first call.
void hiprtewInit(int* resultOut) {  // NOLINT(misc-definitions-in-headers)
  static const int result = hiprt::compat_detail::load_functions();
  *resultOut = result;
}
#else
void hiprtewInit(int* resultOut);
#endif
