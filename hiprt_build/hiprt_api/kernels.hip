#include <hiprt_build/hiprt_api/kernels.h>

#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/instances/make_instance.h>
#include <hiprt_build/instances/motion_keys.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::api {
namespace {

using build::kernels::thread_index;

__global__ void put_headers(const SceneView* views, ObjectHeader* headers, std::uint32_t count) {
  const std::uint32_t i = thread_index();
  if (i < count) headers[i].view = views[i];
}

__global__ void put_refitted(const gpu::RefitReport* report, SceneView* view, ObjectHeader* header) {
  if (report->status != gpu::RefitStatus::kOk) return;
  *view = report->view;
  header->view = report->view;
}

/// A frame as one matrix.
__device__ build::Affine matrix_of(const hiprtFrameMatrix& frame) {
  build::Affine affine;
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 4; ++c) affine.row[r][c] = frame.matrix[r][c];
  return affine;
}

/// Unit quaternion of an axis and an angle. Angle 0 is the identity, whatever the axis.
__device__ build::Quaternion quaternion_of(const hiprtFloat4& rotation) {
  const double axis[3] = {static_cast<double>(rotation.x), static_cast<double>(rotation.y),
                          static_cast<double>(rotation.z)};
  const double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  if (rotation.w == 0.0f || !(length > 0.0)) return {{0.0, 0.0, 0.0, 1.0}};
  const double half = 0.5 * static_cast<double>(rotation.w), factor = sin(half) / length;
  return {{axis[0] * factor, axis[1] * factor, axis[2] * factor, cos(half)}};
}

__device__ build::Affine matrix_of(const hiprtFrameSRT& frame) {
  double rotation[3][3];
  build::motion_keys_detail::rotation_of(quaternion_of(frame.rotation), rotation);
  const float scale[3] = {frame.scale.x, frame.scale.y, frame.scale.z};
  const float translation[3] = {frame.translation.x, frame.translation.y, frame.translation.z};
  build::Affine affine;
  for (unsigned r = 0; r < 3; ++r) {
    for (unsigned c = 0; c < 3; ++c)
      affine.row[r][c] = static_cast<float>(rotation[r][c] * static_cast<double>(scale[c]));
    affine.row[r][3] = translation[r];
  }
  return affine;
}

__device__ build::Affine frame_at(const SceneArrays& from, std::uint32_t i) {
  if (from.frames == nullptr || i >= from.frame_count) return {};
  return from.type == hiprtFrameTypeMatrix ? matrix_of(static_cast<const hiprtFrameMatrix*>(from.frames)[i])
                                           : matrix_of(static_cast<const hiprtFrameSRT*>(from.frames)[i]);
}

__global__ void make_parts(SceneArrays from, SceneParts to) {
  const std::uint32_t i = thread_index();
  if (i >= from.instance_count) return;
  hiprtTransformHeader frames{i, 1};
  if (from.headers != nullptr) frames = from.headers[i];
  if (to.has_inner != nullptr && from.instances[i].type == hiprtInstanceTypeScene) *to.has_inner = 1;
  const void* const handle = from.instances[i].geometry;
  SceneView view = handle != nullptr ? static_cast<const ObjectHeader*>(handle)->view : SceneView{};
  gpu::DeviceInstance instance;
  instance.object = i;
  instance.id = i;
  if (from.masks != nullptr) instance.mask = from.masks[i];
  const bool moves = to.ranges != nullptr && frames.frameCount > 1;
  if (to.ranges != nullptr) to.ranges[i] = {moves ? frames.frameIndex : 0, moves ? frames.frameCount : 0};
  instance.to_scene = frame_at(from, frames.frameIndex);
  // One such instance would make the whole scene empty.
  if (!moves && build::make_instance(instance.to_scene.row).fault != build::TransformFault::kNone) {
    instance.to_scene = {};
    view = SceneView{};
  }
  to.instances[i] = instance;
  to.views[i] = view;
}

__global__ void make_keys(SceneArrays from, SceneParts to) {
  const std::uint32_t i = thread_index();
  if (i >= from.frame_count) return;
  if (from.type == hiprtFrameTypeMatrix) {
    const auto& frame = static_cast<const hiprtFrameMatrix*>(from.frames)[i];
    to.matrices[i] = {frame.time, matrix_of(frame)};
    return;
  }
  const auto& frame = static_cast<const hiprtFrameSRT*>(from.frames)[i];
  build::MotionKey key;
  key.time = frame.time;
  const build::Quaternion q = quaternion_of(frame.rotation);
  for (unsigned k = 0; k < 4; ++k) key.rotation[k] = static_cast<float>(q.x[k]);
  const float scale[3] = {frame.scale.x, frame.scale.y, frame.scale.z};
  const float translation[3] = {frame.translation.x, frame.translation.y, frame.translation.z};
  for (unsigned k = 0; k < 3; ++k) {
    key.scale[k] = scale[k];
    key.translation[k] = translation[k];
  }
  to.keys[i] = key;
}

HIPRT_HD std::uint64_t address_of(const void* pointer) { return reinterpret_cast<std::uintptr_t>(pointer); }

__global__ void copy_objects(InnerScene inner, ObjectRecord* table) {
  const std::uint32_t i = thread_index();
  if (i >= inner.objects) return;
  const SceneView& view = inner.scene->view;
  ObjectRecord object = view.objects[i];
  // Offsets are addresses: modulo 2^64.
  object.offset += address_of(view.base);
  if (object.instances != 0) {
    const std::uint64_t place = object.offset + object.instances - address_of(inner.more);
    object.instances = address_of(inner.copy + inner.instances) + place - object.offset;
  }
  object.reserved = static_cast<std::uint32_t>(view.layout);
  table[inner.first_object + i] = object;
}

__global__ void copy_instances(InnerScene inner) {
  const std::uint32_t i = thread_index();
  if (i >= inner.instances + inner.more_count) return;
  InstanceRecord record = i < inner.instances ? inner.scene->view.instances[i] : inner.more[i - inner.instances];
  record.object += inner.first_object;
  inner.copy[i] = record;
}

__global__ void link_copies(InstanceRecord* const* copies, ObjectRecord* table, std::uint32_t count) {
  const std::uint32_t i = thread_index();
  if (i < count && copies[i] != nullptr && table[i].instances != 0)
    table[i].instances = address_of(copies[i]) - table[i].offset;
}

}  // namespace

Result<void> enqueue_headers(const SceneView* views, ObjectHeader* headers, std::uint32_t count, hipStream_t stream) {
  gpu::Launcher steps(stream);
  steps.each(count, "put_headers", put_headers, views, headers, count);
  return steps.result();
}

Result<void> enqueue_refitted(const gpu::RefitReport* report, SceneView* view, ObjectHeader* header,
                              hipStream_t stream) {
  gpu::Launcher steps(stream);
  steps.one("put_refitted", put_refitted, report, view, header);
  return steps.result();
}

Result<void> enqueue_parts(const SceneArrays& from, const SceneParts& to, hipStream_t stream) {
  gpu::Launcher steps(stream);
  steps.each(from.instance_count, "make_parts", make_parts, from, to);
  if (to.ranges != nullptr) steps.each(from.frame_count, "make_keys", make_keys, from, to);
  return steps.result();
}

Result<void> enqueue_inner(const InnerScene& inner, ObjectRecord* table, hipStream_t stream) {
  gpu::Launcher steps(stream);
  steps.each(inner.objects, "copy_objects", copy_objects, inner, table);
  steps.each(inner.instances + inner.more_count, "copy_instances", copy_instances, inner);
  return steps.result();
}

Result<void> enqueue_links(InstanceRecord* const* copies, ObjectRecord* table, std::uint32_t count,
                           hipStream_t stream) {
  gpu::Launcher steps(stream);
  steps.each(count, "link_copies", link_copies, copies, table, count);
  return steps.result();
}

}  // namespace hiprt::api
