#pragma once
/// Motions of instances in device memory: their segments, and the boxes that they sweep. Internal.

#include <hiprt_build/format/motion_bounds.h>
#include <hiprt_build/gpu/instances.h>
#include <hiprt_build/instances/motion_keys.h>

namespace hiprt::build {

/// The keys of one instance.
struct InstanceKeys {
  const gpu::DeviceMotions& motions;
  gpu::KeyRange range;

  HIPRT_HD bool exist() const {
    return range.first < motions.key_count && range.count <= motions.key_count - range.first;
  }
  HIPRT_HD float time(std::uint32_t k) const {
    return motions.keys != nullptr ? motions.keys[range.first + k].time : motions.matrices[range.first + k].time;
  }
  HIPRT_HD MotionFault get(std::uint32_t k, MotionKey& key) const {
    MotionFault fault = MotionFault::kNone;
    if (motions.keys != nullptr)
      key = motions.keys[range.first + k];
    else
      fault = decompose_key(motions.matrices[range.first + k], key);
    return fault == MotionFault::kNone ? fault_of(key) : fault;
  }
  HIPRT_HD MotionFault get(std::uint32_t k, MatrixKey& key) const {
    if (motions.keys == nullptr) {
      key = motions.matrices[range.first + k];
      return motion_keys_detail::is_finite(&key.to_scene.row[0][0], 12) ? MotionFault::kNone : MotionFault::kNotFinite;
    }
    const MotionFault fault = fault_of(motions.keys[range.first + k]);
    if (fault == MotionFault::kNone) key = compose_key(motions.keys[range.first + k]);
    return fault;
  }
};

/// What making a motion has found.
struct MadeMotion {
  MotionFault fault = MotionFault::kNone;
  std::uint32_t key = 0;           ///< Of the fault.
  motion_detail::BadMatrix bad{};  ///< kSingular
  MatrixKey first{};               ///< The transform of the first key that does not hide the instance.
  MotionMagnification magnification{};

  HIPRT_HD bool fails(MotionFault found, std::uint32_t k) {
    fault = found;
    key = k;
    return found != MotionFault::kNone;
  }
};

namespace gpu_motion_detail {

HIPRT_HD inline MatrixKey to_matrix(const MatrixKey& key) { return key; }
HIPRT_HD inline MatrixKey to_matrix(const MotionKey& key) { return compose_key(key); }

HIPRT_HD inline MotionFault between(const MatrixKey&, const MatrixKey&) { return MotionFault::kNone; }
HIPRT_HD inline MotionFault between(const MotionKey& from, const MotionKey& to) { return fault_of_signs(from, to); }

HIPRT_HD inline MotionSegment segment(const MatrixKey& from, const MatrixKey& to, MotionKind) {
  return make_segment(from, to);
}
/// Independent of the keys before, because instances may share a segment.
HIPRT_HD inline MotionSegment segment(const MotionKey& from, const MotionKey& to, MotionKind kind) {
  Quaternion orientation = unit_rotation(from);
  return make_segment(from, to, kind, orientation);
}

template <class Key, class Put> HIPRT_HD MadeMotion make(const InstanceKeys& keys, const Put& put) {
  MadeMotion made;
  Key before{};
  if (made.fails(keys.get(0, before), 0)) return made;
  made.first = to_matrix(before);
  if (made.fails(keys.time(0) - keys.time(0) == 0.0f ? MotionFault::kNone : MotionFault::kBadTime, 0)) return made;
  for (std::uint32_t k = 1; k < keys.range.count; ++k) {
    Key key{};
    if (made.fails(fault_between(keys.time(k - 1), keys.time(k)), k)) return made;
    if (made.fails(keys.get(k, key), k)) return made;
    if (made.fails(between(before, key), k)) return made;
    const MotionSegment made_segment = segment(before, key, keys.motions.kind);
    if (!magnify(made.magnification, made_segment, keys.motions.kind, made.bad)) {
      made.fails(MotionFault::kSingular, k - 1);
      return made;
    }
    put(keys.range.first + k - 1, made_segment);
    if (hides(made.first)) made.first = to_matrix(key);
    before = key;
  }
  return made;
}

}  // namespace gpu_motion_detail

/// Calls put(number, segment) for each segment between the keys of an instance; segment i begins at key i of all.
template <class Put> HIPRT_HD MadeMotion make_motion(const InstanceKeys& keys, const Put& put) {
  if (!keys.exist()) {
    MadeMotion made;
    made.fault = MotionFault::kBadKeys;
    return made;
  }
  return keys.motions.kind == MotionKind::kMatrix ? gpu_motion_detail::make<MatrixKey>(keys, put)
                                                  : gpu_motion_detail::make<MotionKey>(keys, put);
}

/// As InstanceMotionBounds. It reads the segments from the caller's array and allocates nothing.
struct SweptBounds {
  const MotionSegment* segments;
  std::uint32_t count;
  MotionKind kind;

  HIPRT_HD HIPRT_COLD Box bounds(const Box& box) const {
    MotionRange range[3];
    for (std::uint32_t i = 0; i < count; ++i) {
      const SegmentMotion segment(segments[i], kind);
      motion_detail::for_each_corner(box, [&](const double(&p)[3]) {
        for (unsigned axis = 0; axis < 3; ++axis) segment.curve(axis, p).grow(range[axis], 1.0);
      });
    }
    return motion_detail::rounded_box(range, range);
  }
};

}  // namespace hiprt::build

namespace hiprt::build::kernels {

/// Writes to the report what is wrong with the keys of its instance.
/// @return the transform of the first key, if there is no such fault.
HIPRT_HD inline Affine judge_motion(const gpu::DeviceMotions& motions, gpu::InstanceReport& report) {
  const MadeMotion made =
      make_motion(InstanceKeys{motions, motions.ranges[report.instance]}, [](std::uint32_t, const MotionSegment&) {});
  report.motion_fault = made.fault;
  report.key = made.key;
  report.determinant = made.bad.determinant;
  return made.first.to_scene;
}

}  // namespace hiprt::build::kernels
