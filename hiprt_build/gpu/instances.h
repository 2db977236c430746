#pragma once
/// Trees over instances, made on the device: the top level of a scene whose instances move from frame to frame. Its
/// objects stay where they are.
///
///     auto sizes = hiprt::gpu::instance_sizes(objects_in(*view), 10000);
///     auto scene = hiprt::gpu::upload_scene(*view, stream, allocator, sizes->output);  // With capacity before it.
///     auto objects = hiprt::gpu::objects_of(*scene, *view);
///     auto report = hiprt::gpu::enqueue_instances(objects, {instances, 10000}, {}, scene->buffer.data(), scratch,
///     stream); trace<<<...>>>(&(*report)->view, ...);

#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/build.h>
#include <hiprt_build/gpu/scene.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/motion.h>

#include <string_view>

namespace hiprt::gpu {

/// As build::Instance. Motions are separate: DeviceMotions.
struct DeviceInstance {
  build::Affine to_scene{};  ///< From the object to the scene. Any with an inverse. Unused if the instance has keys.
  std::uint32_t object = 0;  ///< Number in SceneObjects.
  std::uint32_t mask = 0xffffffffu;
  std::uint32_t id = 0;     ///< The program's own number.
  std::uint32_t flags = 0;  ///< InstanceFlags.
};
static_assert(sizeof(DeviceInstance) == 64);

/// The keys of one instance, by number.
struct KeyRange {
  std::uint32_t first = 0;
  std::uint32_t count = 0;  ///< 0: the instance has none and stands still at DeviceInstance::to_scene.
};

/// Motions of instances, as build::Motion, on the device: read until the stream has passed the build. Instances may
/// share keys.
struct DeviceMotions {
  const KeyRange* ranges = nullptr;  ///< One per instance; nullptr: nothing moves.
  const build::MotionKey* keys = nullptr;
  const build::MatrixKey* matrices = nullptr;  ///< Instead of keys. Kinds other than kMatrix decompose them.
  std::uint32_t key_count = 0;                 ///< Of keys or matrices. At most kMaxBuildPrimitives.
  MotionKind kind = MotionKind::kSlerp;
};

/// On the device: read until the stream has passed the build.
struct DeviceInstances {
  const DeviceInstance* instances = nullptr;
  std::uint32_t count = 0;  ///< At most kMaxBuildPrimitives.
  DeviceMotions motions{};
};

/// Objects on the device that instances may be of: all those of a scene of instances, or separate ones (objects.h).
struct SceneObjects {
  /// On the device: what their offsets count from. nullptr: offsets are addresses.
  const std::byte* base = nullptr;
  const ObjectRecord* records = nullptr;  ///< On the device.
  std::uint32_t count = 0;
  NodeLayout layout = NodeLayout::kPlanes;
  float shutter_begin = 0.0f, shutter_rate = 0.0f;  ///< Of what moves in them, as in the file's header.
};

/// The objects of a scene's file, for sizes; where they will be on the device is not known yet.
SceneObjects objects_in(const BufferView& view);
/// @param view of the file on the host whose copy @p scene is.
SceneObjects objects_of(const DeviceScene& scene, const BufferView& view);

struct InstanceOptions {
  /// Of the tree; nodes: what the objects have is taken; leaves hold one instance. Without progress.
  BuildOptions tree{};
  build::InstanceBounds bounds = build::InstanceBounds::kChildren;  ///< All but kPrimitives.
};

/// Why there is no scene: the report's view is empty then.
enum class InstanceStatus : std::uint32_t {
  kOk = 0,
  kNotFinite = 1,       ///< A transform. As build::TransformFault.
  kNoInverse = 2,       ///< A transform: none that floats can hold.
  kBadObject = 3,       ///< There is no object of that number.
  kBadFlags = 4,        ///< Others than InstanceFlags.
  kTooFar = 5,          ///< Bounds are beyond what floats hold.
  kIllConditioned = 6,  ///< The transforms on the path to a primitive, together: beyond kMaxCondition.
  kTooDeep = 7,         ///< As BuildStatus.
  kTooLarge = 8,        ///< As BuildStatus.
  kBadMotion = 9,       ///< Keys of an instance: report's motion_fault and key.
  kOtherLayout = 10,    ///< The object has another node layout than SceneObjects says.
  kOtherShutter = 11,   ///< The object has moving boxes, but SceneObjects has no shutter.
  kNotInTree = 12,      ///< enqueue_update(): the instance was empty when the tree was built, and is not now.
};

/// What a build has made: in device memory, written when the stream passes the build.
struct InstanceReport {
  SceneView view{};  ///< For kernels that follow on the stream; levels, condition, reach and all.
  InstanceStatus status = InstanceStatus::kOk;
  std::uint32_t instance = 0;   ///< Of a fault of one instance: the first one for which it is so.
  std::uint32_t object = 0;     ///< kBadObject: its number.
  std::uint32_t instances = 0;  ///< Records.
  std::uint32_t nodes = 0;      ///< Of the tree.
  std::uint32_t leaves = 0;     ///< Instances in it: those of empty objects are dropped.
  build::MotionFault motion_fault = build::MotionFault::kNone;  ///< kBadMotion
  std::uint32_t key = 0;                                        ///< kBadMotion: number among the instance's keys.
  double determinant = 0.0;                                     ///< kNoInverse: of the transform.
  double condition = 0.0;  ///< kNoInverse: of the transform, or 0; kIllConditioned: of all together.
};

/// Bytes of device memory, exactly; of outputs a multiple of 256.
/// @return kInvalidInput or kTooLarge with the number and its limit, or the runtime's error.
/// @param key_count DeviceMotions::key_count.
Result<BuildSizes> instance_sizes(const SceneObjects& objects, std::uint32_t instances,
                                  const InstanceOptions& options = {}, std::uint32_t key_count = 0);

/// Starts a build on the stream and returns: no allocation, no wait, no copy from or to the host; it can be captured in
/// a graph. Records and boxes of instances that stand still are those of build::build_instances(), bit by bit. Boxes of
/// moving instances contain them at all times; they do not move (Feature::kMovingBoxes).
/// @param output sizes.output bytes, aligned to 256. If objects.base is set, they lie before it in the same allocation
///        (DeviceScene's capacity). Several scenes can lie there: one is traced while the next is made.
/// @param scratch sizes.scratch bytes on the device, aligned to 256.
/// @return where the report will be, in @p output; or the errors of instance_sizes() and of launches.
Result<const InstanceReport*> enqueue_instances(const SceneObjects& objects, const DeviceInstances& instances,
                                                const InstanceOptions& options, std::byte* output, std::byte* scratch,
                                                hipStream_t stream);

/// Moves a built scene: new records, and new boxes for the old tree, in a fraction of a build's time. Rays get slower
/// as instances move away from where they were; then build again. The numbers of objects, instances and keys, the
/// options and @p output must be those of the build. Transforms, masks, ids, keys and objects may be others. The scene
/// must not be traced while the stream passes the update.
Result<const InstanceReport*> enqueue_update(const SceneObjects& objects, const DeviceInstances& instances,
                                             const InstanceOptions& options, std::byte* output, std::byte* scratch,
                                             hipStream_t stream);

/// The report on the host; waits for the stream.
/// @return kInvalidInput with the instance and its determinant, kTooLarge, or the runtime's error.
Result<InstanceReport> read_report(const InstanceReport* report, const SceneObjects& objects, hipStream_t stream);

/// The scene's file in host memory, complete with objects, provenance and checksum; waits for the stream. Separate
/// objects with equal records are one object of the file, and each object comes before the scenes that have instances
/// of it. So objects may have other numbers in the file.
/// @param report of read_report().
/// @param tool for the provenance, e.g. the command line.
Result<build::Buffer> download_file(const InstanceReport& report, const SceneObjects& objects, hipStream_t stream,
                                    std::string_view tool = {});

}  // namespace hiprt::gpu
