#pragma once
/// The host functions under HIPRT's names, with HIPRT 3.1's binary interface. Link hiprt::hiprt_api, the library
/// libhiprt0300164.so. hiprt_device/docs/HIPRT_LIBRARY.md says what it does.

#include <hiprt/hiprt_types.h>

#define HIPRT_MAJOR_VERSION 3
#define HIPRT_MINOR_VERSION 1
#define HIPRT_PATCH_VERSION 0
#define HIPRT_HASH_VERSION 0xcb09c56
#define HIPRT_API_VERSION 3001
#define HIPRT_VERSION_STR "03001"
#if !defined(HIP_VERSION_STR)
#define HIP_VERSION_STR "HIP_SDK_NOT_FOUND"
#endif

#if defined(HIPRT_STATIC_LIBRARY)
#define HIPRT_API
#elif defined(_WIN32) && defined(HIPRT_EXPORTS)
#define HIPRT_API __declspec(dllexport)
#elif defined(_WIN32)
#define HIPRT_API __declspec(dllimport)
#else
#define HIPRT_API __attribute__((visibility("default")))
#endif

extern "C" {

/// @param hiprtApiVersion HIPRT_API_VERSION.
HIPRT_API hiprtError hiprtCreateContext(uint32_t hiprtApiVersion, const hiprtContextCreationInput& input,
                                        hiprtContext& contextOut);
HIPRT_API hiprtError hiprtDestroyContext(hiprtContext context);
/// @param level bits of hiprtLogLevelBits.
HIPRT_API hiprtError hiprtSetLogLevel(hiprtContext context, hiprtLogLevel level);
/// The folder of compiled kernels.
HIPRT_API hiprtError hiprtSetCacheDirPath(hiprtContext context, const char* path);

HIPRT_API hiprtError hiprtCreateGeometry(hiprtContext context, const hiprtGeometryBuildInput& buildInput,
                                         hiprtBuildOptions buildOptions, hiprtGeometry& geometryOut);
/// @param geometriesOut addresses of handles.
HIPRT_API hiprtError hiprtCreateGeometries(hiprtContext context, uint32_t numGeometries,
                                           const hiprtGeometryBuildInput* buildInputs, hiprtBuildOptions buildOptions,
                                           hiprtGeometry** geometriesOut);
HIPRT_API hiprtError hiprtDestroyGeometry(hiprtContext context, hiprtGeometry geometry);
HIPRT_API hiprtError hiprtDestroyGeometries(hiprtContext context, uint32_t numGeometries, hiprtGeometry* geometries);
HIPRT_API hiprtError hiprtGetGeometryBuildTemporaryBufferSize(hiprtContext context,
                                                              const hiprtGeometryBuildInput& buildInput,
                                                              hiprtBuildOptions buildOptions, size_t& sizeOut);
HIPRT_API hiprtError hiprtGetGeometriesBuildTemporaryBufferSize(hiprtContext context, uint32_t numGeometries,
                                                                const hiprtGeometryBuildInput* buildInputs,
                                                                hiprtBuildOptions buildOptions, size_t& sizeOut);
HIPRT_API hiprtError hiprtBuildGeometry(hiprtContext context, hiprtBuildOperation buildOperation,
                                        const hiprtGeometryBuildInput& buildInput, hiprtBuildOptions buildOptions,
                                        hiprtDevicePtr temporaryBuffer, hiprtApiStream stream, hiprtGeometry geometry);
HIPRT_API hiprtError hiprtBuildGeometries(hiprtContext context, hiprtBuildOperation buildOperation,
                                          uint32_t numGeometries, const hiprtGeometryBuildInput* buildInputs,
                                          hiprtBuildOptions buildOptions, hiprtDevicePtr temporaryBuffer,
                                          hiprtApiStream stream, hiprtGeometry* geometries);
/// The old geometry is destroyed. Both handles may be the same variable.
HIPRT_API hiprtError hiprtCompactGeometry(hiprtContext context, hiprtApiStream stream, hiprtGeometry geometryIn,
                                          hiprtGeometry& geometryOut);
HIPRT_API hiprtError hiprtCompactGeometries(hiprtContext context, uint32_t numGeometries, hiprtApiStream stream,
                                            hiprtGeometry* geometriesIn, hiprtGeometry** geometriesOut);

HIPRT_API hiprtError hiprtCreateScene(hiprtContext context, const hiprtSceneBuildInput& buildInput,
                                      hiprtBuildOptions buildOptions, hiprtScene& sceneOut);
HIPRT_API hiprtError hiprtCreateScenes(hiprtContext context, uint32_t numScenes,
                                       const hiprtSceneBuildInput* buildInputs, hiprtBuildOptions buildOptions,
                                       hiprtScene** scenesOut);
HIPRT_API hiprtError hiprtDestroyScene(hiprtContext context, hiprtScene scene);
HIPRT_API hiprtError hiprtDestroyScenes(hiprtContext context, uint32_t numScenes, hiprtScene* scenes);
HIPRT_API hiprtError hiprtGetSceneBuildTemporaryBufferSize(hiprtContext context, const hiprtSceneBuildInput& buildInput,
                                                           hiprtBuildOptions buildOptions, size_t& sizeOut);
HIPRT_API hiprtError hiprtGetScenesBuildTemporaryBufferSize(hiprtContext context, uint32_t numScenes,
                                                            const hiprtSceneBuildInput* buildInputs,
                                                            hiprtBuildOptions buildOptions, size_t& sizeOut);
HIPRT_API hiprtError hiprtBuildScene(hiprtContext context, hiprtBuildOperation buildOperation,
                                     const hiprtSceneBuildInput& buildInput, hiprtBuildOptions buildOptions,
                                     hiprtDevicePtr temporaryBuffer, hiprtApiStream stream, hiprtScene scene);
HIPRT_API hiprtError hiprtBuildScenes(hiprtContext context, hiprtBuildOperation buildOperation, uint32_t numScenes,
                                      const hiprtSceneBuildInput* buildInputs, hiprtBuildOptions buildOptions,
                                      hiprtDevicePtr temporaryBuffer, hiprtApiStream stream, hiprtScene* scenes);
HIPRT_API hiprtError hiprtCompactScene(hiprtContext context, hiprtApiStream stream, hiprtScene sceneIn,
                                       hiprtScene& sceneOut);
HIPRT_API hiprtError hiprtCompactScenes(hiprtContext context, uint32_t numScenes, hiprtApiStream stream,
                                        hiprtScene* scenesIn, hiprtScene** scenesOut);

HIPRT_API hiprtError hiprtCreateFuncTable(hiprtContext context, uint32_t numGeomTypes, uint32_t numRayTypes,
                                          hiprtFuncTable& funcTableOut);
HIPRT_API hiprtError hiprtSetFuncTable(hiprtContext context, hiprtFuncTable funcTable, uint32_t geomType,
                                       uint32_t rayType, hiprtFuncDataSet set);
HIPRT_API hiprtError hiprtDestroyFuncTable(hiprtContext context, hiprtFuncTable funcTable);
HIPRT_API hiprtError hiprtCreateGlobalStackBuffer(hiprtContext context, const hiprtGlobalStackBufferInput& input,
                                                  hiprtGlobalStackBuffer& stackBufferOut);
HIPRT_API hiprtError hiprtDestroyGlobalStackBuffer(hiprtContext context, hiprtGlobalStackBuffer stackBuffer);

HIPRT_API hiprtError hiprtSaveGeometry(hiprtContext context, hiprtGeometry geometry, const char* filename);
HIPRT_API hiprtError hiprtLoadGeometry(hiprtContext context, hiprtGeometry& geometryOut, const char* filename);
HIPRT_API hiprtError hiprtSaveScene(hiprtContext context, hiprtScene scene, const char* filename);
HIPRT_API hiprtError hiprtLoadScene(hiprtContext context, hiprtScene& sceneOut, const char* filename);
/// The build must be finished.
HIPRT_API hiprtError hiprtExportGeometryAabb(hiprtContext context, hiprtGeometry geometry, hiprtFloat3& aabbMin,
                                             hiprtFloat3& aabbMax);
HIPRT_API hiprtError hiprtExportSceneAabb(hiprtContext context, hiprtScene scene, hiprtFloat3& aabbMin,
                                          hiprtFloat3& aabbMax);

/// Compiles a source together with a dispatcher of its intersect and filter functions.
HIPRT_API hiprtError hiprtBuildTraceKernels(hiprtContext context, uint32_t numFunctions, const char** funcNames,
                                            const char* src, const char* moduleName, uint32_t numHeaders,
                                            const char** headers, const char** includeNames, uint32_t numOptions,
                                            const char** options, uint32_t numGeomTypes, uint32_t numRayTypes,
                                            hiprtFuncNameSet* funcNameSets, hiprtApiFunction* functionsOut,
                                            hiprtApiModule* moduleOut, bool cache);
HIPRT_API hiprtError hiprtBuildTraceKernelsFromBitcode(hiprtContext context, uint32_t numFunctions,
                                                       const char** funcNames, const char* moduleName,
                                                       const char* bitcodeBinary, size_t bitcodeBinarySize,
                                                       uint32_t numGeomTypes, uint32_t numRayTypes,
                                                       hiprtFuncNameSet* funcNameSets, hiprtApiFunction* functionsOut,
                                                       bool cache);
}
