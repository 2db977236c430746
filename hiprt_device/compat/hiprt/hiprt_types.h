#pragma once
/// Handles, enumerations and structs under HIPRT's names, with HIPRT 3.1's layouts.

#include <hiprt/hiprt_vec.h>

/// An object of the host.
typedef struct hiprtContextObject* hiprtContext;
typedef void* hiprtDevicePtr;
/// Device pointers that kernels take by value. Programs must not read through them.
typedef hiprtDevicePtr hiprtGeometry;
typedef hiprtDevicePtr hiprtScene;
typedef hiprtDevicePtr hiprtFuncTable;
/// Handles of the driver: hipCtx_t or CUcontext, hipDevice_t, hipStream_t, hipFunction_t, hipModule_t.
typedef void* hiprtApiCtx;
typedef int hiprtApiDevice;
typedef void* hiprtApiStream;
typedef void* hiprtApiFunction;
typedef void* hiprtApiModule;

typedef uint32_t hiprtRayMask;
typedef uint32_t hiprtBuildFlags;
typedef uint32_t hiprtLogLevel;

/// Values without a type of their own.
enum : uint32_t {
  hiprtInvalidValue = ~0u,
  hiprtFullRayMask = ~0u,
  hiprtMaxBatchBuildMaxPrimCount = 512u,
  hiprtMaxInstanceLevels = 4u,
};

/// Results of the host's functions.
enum hiprtError {
  hiprtSuccess = 0,
  hiprtErrorNotImplemented = 1,
  hiprtErrorInternal = 2,
  hiprtErrorOutOfHostMemory = 3,
  hiprtErrorOutOfDeviceMemory = 4,
  hiprtErrorInvalidApiVersion = 5,
  hiprtErrorInvalidParameter = 6,
};
/// Kinds of primitives that a tree import names.
enum hiprtPrimitiveNodeType { hiprtTriangleNode = 0, hiprtCustomNode = 1 };
/// When a traversal ends.
enum hiprtTraversalType { hiprtTraversalTerminateAtAnyHit = 1, hiprtTraversalTerminateAtClosestHit = 2 };
/// The state of a traversal.
enum hiprtTraversalState {
  hiprtTraversalStateInit = 0,           ///< There was no getNextHit() yet.
  hiprtTraversalStateFinished = 1,       ///< There are no more hits.
  hiprtTraversalStateHit = 2,            ///< The last getNextHit() found a hit, and there may be more.
  hiprtTraversalStateStackOverflow = 3,  ///< The stack was too small: hits may be missing.
};
/// Accepted and without effect.
enum hiprtTraversalHint {
  hiprtTraversalHintDefault = 0,
  hiprtTraversalHintShadowRays = 1,
  hiprtTraversalHintReflectionRays = 2,
};
/// Bits of hiprtLogLevel.
enum hiprtLogLevelBits {
  hiprtLogLevelNone = 0,
  hiprtLogLevelInfo = 1,
  hiprtLogLevelWarn = 2,
  hiprtLogLevelError = 4,
};
/// What a build does.
enum hiprtBuildOperation { hiprtBuildOperationBuild = 1, hiprtBuildOperationUpdate = 2 };
/// Values of hiprtBuildFlags: the lowest two bits are a number, the others are bits.
enum hiprtBuildFlagBits {
  hiprtBuildFlagBitPreferFastBuild = 0,
  hiprtBuildFlagBitPreferBalancedBuild = 1,
  hiprtBuildFlagBitPreferHighQualityBuild = 2,
  hiprtBuildFlagBitCustomBvhImport = 3,
  hiprtBuildFlagBitDisableSpatialSplits = 4,
  hiprtBuildFlagBitDisableTrianglePairing = 8,
  hiprtBuildFlagBitDisableOrientedBoundingBoxes = 16,
};
/// Primitives of a geometry.
enum hiprtPrimitiveType { hiprtPrimitiveTypeTriangleMesh = 0, hiprtPrimitiveTypeAABBList = 1 };
/// What an instance refers to.
enum hiprtInstanceType { hiprtInstanceTypeGeometry = 0, hiprtInstanceTypeScene = 1 };
/// The form of frames.
enum hiprtFrameType { hiprtFrameTypeSRT = 0, hiprtFrameTypeMatrix = 1 };
/// How a stack buffer is divided: a fixed part per thread, or parts that waves take while they run.
enum hiprtStackType { hiprtStackTypeGlobal = 0, hiprtStackTypeDynamic = 1 };
/// Entries of a stack buffer: nodes, or hiprtInstanceStackEntry.
enum hiprtStackEntryType { hiprtStackEntryTypeInteger = 0, hiprtStackEntryTypeInstance = 1 };
/// Kinds of nodes of an imported tree.
enum hiprtBvhNodeType { hiprtBvhNodeTypeInternal = 0, hiprtBvhNodeTypeLeaf = 1 };
/// The driver of a context.
enum hiprtDeviceType { hiprtDeviceAMD = 0, hiprtDeviceNVIDIA = 1 };

/// The points origin + t * direction with minT <= t <= maxT. A negative minT counts as 0.
struct alignas(16) hiprtRay {
  hiprtFloat3 origin;
  float minT = 0.0f;
  hiprtFloat3 direction;
  float maxT = hiprt::FltMax;
};

/// A hit. hiprt_device/docs/HIPRT_PROGRAMS.md says what its members are in each case.
struct alignas(16) hiprtHit {
  union {
    uint32_t instanceID = hiprtInvalidValue;
    uint32_t instanceIDs[hiprtMaxInstanceLevels];
  };
  uint32_t primID = hiprtInvalidValue;
  hiprtFloat2 uv;
  hiprtFloat3 normal;
  float t = -1.0f;

  HIPRT_HOST_DEVICE bool hasHit() const { return primID != hiprtInvalidValue; }
};

/// The data of the two functions of a geometry type and a ray type.
struct hiprtFuncDataSet {
  const void* intersectFuncData = nullptr;
  const void* filterFuncData = nullptr;
};
/// The names of these functions.
struct hiprtFuncNameSet {
  const char* intersectFuncName = nullptr;
  const char* filterFuncName = nullptr;
};
/// What a hiprtFuncTable points to. Set numGeomTypes * rayType + geomType is that of a pair of types.
struct hiprtFuncTableHeader {
  uint32_t numGeomTypes;
  uint32_t numRayTypes;
  hiprtFuncDataSet* funcDataSets;
};

/// Device memory for the stacks of a launch.
struct hiprtGlobalStackBuffer {
  uint32_t stackSize;
  uint32_t stackCount;
  void* stackData;
};
/// Shared memory for the stacks of a block.
struct hiprtSharedStackBuffer {
  uint32_t stackSize;
  void* stackData;
};
/// What to allocate for a hiprtGlobalStackBuffer.
struct hiprtGlobalStackBufferInput {
  hiprtStackType type = hiprtStackTypeGlobal;
  hiprtStackEntryType entryType = hiprtStackEntryTypeInteger;
  uint32_t stackSize;
  uint32_t threadCount;
};
/// An entry of an instance stack.
struct alignas(16) hiprtInstanceStackEntry {
  hiprtRay ray;
  hiprtScene scene;
};

/// The driver's context and device that a hiprtContext uses.
struct hiprtContextCreationInput {
  hiprtApiCtx ctxt;
  hiprtApiDevice device;
  hiprtDeviceType deviceType;
};
/// How to build.
struct hiprtBuildOptions {
  hiprtBuildFlags buildFlags;
  uint32_t batchBuildMaxPrimCount = 0u;
};

/// Triangles. Without indices, triangle i has the vertices 3 * i to 3 * i + 2.
struct hiprtTriangleMeshPrimitive {
  hiprtDevicePtr vertices;
  uint32_t vertexCount;
  uint32_t vertexStride;
  hiprtDevicePtr triangleIndices = nullptr;
  uint32_t triangleCount = 0u;
  uint32_t triangleStride = 0u;
  hiprtDevicePtr trianglePairIndices = nullptr;
  uint32_t trianglePairCount = 0u;
};
/// Boxes of custom primitives. The upper corner is at half of the stride.
struct hiprtAABBListPrimitive {
  hiprtDevicePtr aabbs;
  uint32_t aabbCount;
  uint32_t aabbStride;
};
/// A tree to import.
struct hiprtBvhNodeList {
  hiprtDevicePtr internalNodes;
  hiprtDevicePtr leafNodes;
  uint32_t nodeCount;
};
/// An inner node of such a tree.
struct alignas(64) hiprtInternalNode {
  hiprtFloat3 aabbMin;
  hiprtFloat3 aabbMax;
  uint32_t childIndices[2];
  hiprtBvhNodeType childNodeTypes[2];
};
/// A leaf of such a tree.
struct alignas(32) hiprtLeafNode {
  hiprtFloat3 aabbMin;
  hiprtFloat3 aabbMax;
  uint32_t primID;
};
/// A geometry to build.
struct alignas(64) hiprtGeometryBuildInput {
  hiprtPrimitiveType type;
  uint32_t geomType = hiprtInvalidValue;
  union Primitive {
    hiprtTriangleMeshPrimitive triangleMesh;
    hiprtAABBListPrimitive aabbList;
    HIPRT_HOST_DEVICE Primitive() : triangleMesh{} {}
  } primitive;
  hiprtBvhNodeList nodeList;
};
/// An instance of a geometry or of a scene.
struct alignas(16) hiprtInstance {
  hiprtInstanceType type;
  union {
    hiprtGeometry geometry;
    hiprtScene scene;
  };
};
/// A scene to build.
struct alignas(16) hiprtSceneBuildInput {
  hiprtDevicePtr instances;
  hiprtDevicePtr instanceTransformHeaders;
  hiprtDevicePtr instanceFrames;
  hiprtDevicePtr instanceMasks;
  hiprtBvhNodeList nodeList;
  uint32_t instanceCount;
  uint32_t frameCount;
  hiprtFrameType frameType = hiprtFrameTypeSRT;
};
/// Scale, then rotation, then translation. The rotation is an axis (x, y, z) and an angle (w, radians).
struct alignas(16) hiprtFrameSRT {
  hiprtFloat4 rotation;
  hiprtFloat3 scale;
  hiprtFloat3 translation;
  float time;
};
/// Rows of the matrix from the object to the world; column 3 is the translation.
struct alignas(64) hiprtFrameMatrix {
  float matrix[3][4];
  float time;
};
/// The frames of an instance.
struct alignas(8) hiprtTransformHeader {
  uint32_t frameIndex;
  uint32_t frameCount;
};

static_assert(sizeof(hiprtRay) == 32 && alignof(hiprtRay) == 16, "layout of HIPRT");
static_assert(sizeof(hiprtHit) == 48 && alignof(hiprtHit) == 16, "layout of HIPRT");
static_assert(sizeof(hiprtFuncDataSet) == 16 && sizeof(hiprtFuncNameSet) == 16, "layout of HIPRT");
static_assert(sizeof(hiprtFuncTableHeader) == 16 && alignof(hiprtFuncTableHeader) == 8, "layout of HIPRT");
static_assert(sizeof(hiprtGlobalStackBuffer) == 16 && sizeof(hiprtSharedStackBuffer) == 16, "layout of HIPRT");
static_assert(sizeof(hiprtGlobalStackBufferInput) == 16 && alignof(hiprtGlobalStackBufferInput) == 4,
              "layout of HIPRT");
static_assert(sizeof(hiprtInstanceStackEntry) == 48 && alignof(hiprtInstanceStackEntry) == 16, "layout of HIPRT");
static_assert(sizeof(hiprtContextCreationInput) == 16 && sizeof(hiprtBuildOptions) == 8, "layout of HIPRT");
static_assert(sizeof(hiprtTriangleMeshPrimitive) == 48 && sizeof(hiprtAABBListPrimitive) == 16, "layout of HIPRT");
static_assert(sizeof(hiprtBvhNodeList) == 24 && alignof(hiprtBvhNodeList) == 8, "layout of HIPRT");
static_assert(sizeof(hiprtInternalNode) == 64 && alignof(hiprtInternalNode) == 64, "layout of HIPRT");
static_assert(sizeof(hiprtLeafNode) == 32 && alignof(hiprtLeafNode) == 32, "layout of HIPRT");
static_assert(sizeof(hiprtGeometryBuildInput) == 128 && alignof(hiprtGeometryBuildInput) == 64, "layout of HIPRT");
static_assert(sizeof(hiprtInstance) == 16 && alignof(hiprtInstance) == 16, "layout of HIPRT");
static_assert(sizeof(hiprtSceneBuildInput) == 80 && alignof(hiprtSceneBuildInput) == 16, "layout of HIPRT");
static_assert(sizeof(hiprtFrameSRT) == 48 && alignof(hiprtFrameSRT) == 16, "layout of HIPRT");
static_assert(sizeof(hiprtFrameMatrix) == 64 && alignof(hiprtFrameMatrix) == 64, "layout of HIPRT");
static_assert(sizeof(hiprtTransformHeader) == 8 && alignof(hiprtTransformHeader) == 8, "layout of HIPRT");
