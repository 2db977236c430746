#pragma once
/// The sizes, offsets and numbers of HIPRT 3.1's interface. Compiling is the test.

#include <hiprt/hiprt_device.h>

#if !defined(__CUDACC_RTC__) && !defined(__HIPCC_RTC__)
// offsetof of members of unions, and of types that have initialisers, works with all compilers.
#if defined(__clang__)
#pragma clang diagnostic ignored "-Winvalid-offsetof"
#elif defined(__GNUC__)
#pragma GCC diagnostic ignored "-Winvalid-offsetof"
#endif
#define HIPRT_TEST_OFFSET(type, member, offset) static_assert(offsetof(type, member) == offset)

HIPRT_TEST_OFFSET(hiprtRay, origin, 0);
HIPRT_TEST_OFFSET(hiprtRay, minT, 12);
HIPRT_TEST_OFFSET(hiprtRay, direction, 16);
HIPRT_TEST_OFFSET(hiprtRay, maxT, 28);
HIPRT_TEST_OFFSET(hiprtHit, instanceID, 0);
HIPRT_TEST_OFFSET(hiprtHit, instanceIDs, 0);
HIPRT_TEST_OFFSET(hiprtHit, primID, 16);
HIPRT_TEST_OFFSET(hiprtHit, uv, 24);
HIPRT_TEST_OFFSET(hiprtHit, normal, 32);
HIPRT_TEST_OFFSET(hiprtHit, t, 44);
HIPRT_TEST_OFFSET(hiprtFuncDataSet, intersectFuncData, 0);
HIPRT_TEST_OFFSET(hiprtFuncDataSet, filterFuncData, 8);
HIPRT_TEST_OFFSET(hiprtFuncNameSet, intersectFuncName, 0);
HIPRT_TEST_OFFSET(hiprtFuncNameSet, filterFuncName, 8);
HIPRT_TEST_OFFSET(hiprtFuncTableHeader, numGeomTypes, 0);
HIPRT_TEST_OFFSET(hiprtFuncTableHeader, numRayTypes, 4);
HIPRT_TEST_OFFSET(hiprtFuncTableHeader, funcDataSets, 8);
HIPRT_TEST_OFFSET(hiprtGlobalStackBuffer, stackSize, 0);
HIPRT_TEST_OFFSET(hiprtGlobalStackBuffer, stackCount, 4);
HIPRT_TEST_OFFSET(hiprtGlobalStackBuffer, stackData, 8);
HIPRT_TEST_OFFSET(hiprtSharedStackBuffer, stackSize, 0);
HIPRT_TEST_OFFSET(hiprtSharedStackBuffer, stackData, 8);
HIPRT_TEST_OFFSET(hiprtGlobalStackBufferInput, type, 0);
HIPRT_TEST_OFFSET(hiprtGlobalStackBufferInput, entryType, 4);
HIPRT_TEST_OFFSET(hiprtGlobalStackBufferInput, stackSize, 8);
HIPRT_TEST_OFFSET(hiprtGlobalStackBufferInput, threadCount, 12);
HIPRT_TEST_OFFSET(hiprtInstanceStackEntry, ray, 0);
HIPRT_TEST_OFFSET(hiprtInstanceStackEntry, scene, 32);
HIPRT_TEST_OFFSET(hiprtContextCreationInput, ctxt, 0);
HIPRT_TEST_OFFSET(hiprtContextCreationInput, device, 8);
HIPRT_TEST_OFFSET(hiprtContextCreationInput, deviceType, 12);
HIPRT_TEST_OFFSET(hiprtBuildOptions, buildFlags, 0);
HIPRT_TEST_OFFSET(hiprtBuildOptions, batchBuildMaxPrimCount, 4);
HIPRT_TEST_OFFSET(hiprtTriangleMeshPrimitive, vertices, 0);
HIPRT_TEST_OFFSET(hiprtTriangleMeshPrimitive, vertexCount, 8);
HIPRT_TEST_OFFSET(hiprtTriangleMeshPrimitive, vertexStride, 12);
HIPRT_TEST_OFFSET(hiprtTriangleMeshPrimitive, triangleIndices, 16);
HIPRT_TEST_OFFSET(hiprtTriangleMeshPrimitive, triangleCount, 24);
HIPRT_TEST_OFFSET(hiprtTriangleMeshPrimitive, triangleStride, 28);
HIPRT_TEST_OFFSET(hiprtTriangleMeshPrimitive, trianglePairIndices, 32);
HIPRT_TEST_OFFSET(hiprtTriangleMeshPrimitive, trianglePairCount, 40);
HIPRT_TEST_OFFSET(hiprtAABBListPrimitive, aabbs, 0);
HIPRT_TEST_OFFSET(hiprtAABBListPrimitive, aabbCount, 8);
HIPRT_TEST_OFFSET(hiprtAABBListPrimitive, aabbStride, 12);
HIPRT_TEST_OFFSET(hiprtBvhNodeList, internalNodes, 0);
HIPRT_TEST_OFFSET(hiprtBvhNodeList, leafNodes, 8);
HIPRT_TEST_OFFSET(hiprtBvhNodeList, nodeCount, 16);
HIPRT_TEST_OFFSET(hiprtInternalNode, aabbMin, 0);
HIPRT_TEST_OFFSET(hiprtInternalNode, aabbMax, 12);
HIPRT_TEST_OFFSET(hiprtInternalNode, childIndices, 24);
HIPRT_TEST_OFFSET(hiprtInternalNode, childNodeTypes, 32);
HIPRT_TEST_OFFSET(hiprtLeafNode, aabbMin, 0);
HIPRT_TEST_OFFSET(hiprtLeafNode, aabbMax, 12);
HIPRT_TEST_OFFSET(hiprtLeafNode, primID, 24);
HIPRT_TEST_OFFSET(hiprtGeometryBuildInput, type, 0);
HIPRT_TEST_OFFSET(hiprtGeometryBuildInput, geomType, 4);
HIPRT_TEST_OFFSET(hiprtGeometryBuildInput, primitive, 8);
HIPRT_TEST_OFFSET(hiprtGeometryBuildInput, nodeList, 56);
HIPRT_TEST_OFFSET(hiprtInstance, type, 0);
HIPRT_TEST_OFFSET(hiprtInstance, geometry, 8);
HIPRT_TEST_OFFSET(hiprtInstance, scene, 8);
HIPRT_TEST_OFFSET(hiprtSceneBuildInput, instances, 0);
HIPRT_TEST_OFFSET(hiprtSceneBuildInput, instanceTransformHeaders, 8);
HIPRT_TEST_OFFSET(hiprtSceneBuildInput, instanceFrames, 16);
HIPRT_TEST_OFFSET(hiprtSceneBuildInput, instanceMasks, 24);
HIPRT_TEST_OFFSET(hiprtSceneBuildInput, nodeList, 32);
HIPRT_TEST_OFFSET(hiprtSceneBuildInput, instanceCount, 56);
HIPRT_TEST_OFFSET(hiprtSceneBuildInput, frameCount, 60);
HIPRT_TEST_OFFSET(hiprtSceneBuildInput, frameType, 64);
HIPRT_TEST_OFFSET(hiprtFrameSRT, rotation, 0);
HIPRT_TEST_OFFSET(hiprtFrameSRT, scale, 16);
HIPRT_TEST_OFFSET(hiprtFrameSRT, translation, 28);
HIPRT_TEST_OFFSET(hiprtFrameSRT, time, 40);
HIPRT_TEST_OFFSET(hiprtFrameMatrix, matrix, 0);
HIPRT_TEST_OFFSET(hiprtFrameMatrix, time, 48);
HIPRT_TEST_OFFSET(hiprtTransformHeader, frameIndex, 0);
HIPRT_TEST_OFFSET(hiprtTransformHeader, frameCount, 4);
#undef HIPRT_TEST_OFFSET
#endif

static_assert(sizeof(hiprtFloat2) == 8 && sizeof(hiprtInt2) == 8 && sizeof(hiprtUint2) == 8);
static_assert(sizeof(hiprtFloat3) == 12 && sizeof(hiprtInt3) == 12 && sizeof(hiprtUint3) == 12);
static_assert(sizeof(hiprtFloat4) == 16 && sizeof(hiprtInt4) == 16 && sizeof(hiprtUint4) == 16);
static_assert(alignof(hiprtFloat2) == 8 && alignof(hiprtFloat3) == 4 && alignof(hiprtFloat4) == 16);

static_assert(sizeof(hiprtError) == 4 && hiprtSuccess == 0 && hiprtErrorNotImplemented == 1);
static_assert(hiprtErrorInternal == 2 && hiprtErrorOutOfHostMemory == 3 && hiprtErrorOutOfDeviceMemory == 4);
static_assert(hiprtErrorInvalidApiVersion == 5 && hiprtErrorInvalidParameter == 6);
static_assert(hiprtTraversalTerminateAtAnyHit == 1 && hiprtTraversalTerminateAtClosestHit == 2);
static_assert(hiprtTraversalStateInit == 0 && hiprtTraversalStateFinished == 1 && hiprtTraversalStateHit == 2);
static_assert(hiprtTraversalStateStackOverflow == 3);
static_assert(hiprtTraversalHintDefault == 0 && hiprtTraversalHintShadowRays == 1);
static_assert(hiprtTraversalHintReflectionRays == 2);
static_assert(hiprtLogLevelNone == 0 && hiprtLogLevelInfo == 1 && hiprtLogLevelWarn == 2 && hiprtLogLevelError == 4);
static_assert(hiprtBuildOperationBuild == 1 && hiprtBuildOperationUpdate == 2);
static_assert(hiprtBuildFlagBitPreferFastBuild == 0 && hiprtBuildFlagBitPreferBalancedBuild == 1);
static_assert(hiprtBuildFlagBitPreferHighQualityBuild == 2 && hiprtBuildFlagBitCustomBvhImport == 3);
static_assert(hiprtBuildFlagBitDisableSpatialSplits == 4 && hiprtBuildFlagBitDisableTrianglePairing == 8);
static_assert(hiprtBuildFlagBitDisableOrientedBoundingBoxes == 16);
static_assert(hiprtPrimitiveTypeTriangleMesh == 0 && hiprtPrimitiveTypeAABBList == 1);
static_assert(hiprtInstanceTypeGeometry == 0 && hiprtInstanceTypeScene == 1);
static_assert(hiprtTriangleNode == 0 && hiprtCustomNode == 1);
static_assert(hiprtFrameTypeSRT == 0 && hiprtFrameTypeMatrix == 1);
static_assert(hiprtStackTypeGlobal == 0 && hiprtStackTypeDynamic == 1);
static_assert(hiprtStackEntryTypeInteger == 0 && hiprtStackEntryTypeInstance == 1);
static_assert(hiprtBvhNodeTypeInternal == 0 && hiprtBvhNodeTypeLeaf == 1);
static_assert(hiprtDeviceAMD == 0 && hiprtDeviceNVIDIA == 1);
static_assert(hiprtInvalidValue == 0xffffffffu && hiprtFullRayMask == 0xffffffffu);
static_assert(hiprtMaxBatchBuildMaxPrimCount == 512 && hiprtMaxInstanceLevels == 4);
static_assert(hiprt::InvalidValue == ~0u && hiprt::FullRayMask == ~0u && hiprt::MaxInstanceLevels == 4);
static_assert(hiprt::MaxBatchBuildMaxPrimCount == 512 && hiprt::DefaultAlignment == 64);
static_assert(hiprt::InstanceIDBits == 24 && hiprt::Rtip == 0 && hiprt::BranchingFactor == 4);
static_assert(hiprt::is_same<hiprtGeometry, void*>::value && hiprt::is_same<hiprtRayMask, uint32_t>::value);
static_assert(hiprt::RoundUp(5, 4) == 8 && hiprt::DivideRoundUp(9, 4) == 3 && hiprt::Log2(17u) == 4);
