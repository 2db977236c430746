#pragma once
/// The record and the box of an instance that stands still, as every builder makes them. Internal.

#include <hiprt_build/format/instance_bounds.h>
#include <hiprt_build/motion.h>

#include <cstdint>

namespace hiprt::build {

/// What is wrong with a transform.
enum class TransformFault : std::uint32_t { kNone = 0, kNotFinite = 1, kNoInverse = 2 };

struct MadeInstance {
  InstanceRecord record{};  ///< Its place; object, mask, id and flags are 0.
  TransformFault fault = TransformFault::kNone;
  double determinant = 0.0;  ///< Of the transform; of a kNotFinite one 0.
  double condition = 0.0;    ///< Of the record; 0 if it is not finite.
};

/// @param to_scene rows of 3 x 4.
HIPRT_HD inline MadeInstance make_instance(const float (&to_scene)[3][4]) {
  using format_detail::is_finite;
  MadeInstance made;
  InstanceRecord& record = made.record;
  bool finite = true;
  for (unsigned r = 0; r < 3; ++r) {
    for (unsigned c = 0; c < 3; ++c) record.linear[r][c] = to_scene[r][c];
    record.translation[r] = to_scene[r][3];
    for (const float x : to_scene[r]) finite = finite && is_finite(x);
  }
  if (!finite) {
    made.fault = TransformFault::kNotFinite;
    return made;
  }
  // In double, rounded once: the record's is what is traced, and all bounds are made of it.
  const LinearInverse inverse(record);
  made.determinant = inverse.determinant;
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 3; ++c) {
      record.linear[r][c] = nearest_float(inverse.row[r][c]);
      finite = finite && is_finite(record.linear[r][c]);
    }
  if (finite) made.condition = condition_of(record);
  if (!finite || !(made.condition <= static_cast<double>(kMaxCondition)) || !LinearInverse(record).exists())
    made.fault = TransformFault::kNoInverse;
  return made;
}

/// The box of an instance with a record, as far as builders look that need no memory for it.
/// @param file of the object. @param levels of box nodes to go down: up to 2.
template <class Layout>
HIPRT_HD Box instance_box(const InstanceRecord& record, const ObjectRecord& object, const std::byte* file,
                          unsigned levels) {
  const StillInstanceBounds to_scene(record);
  using Bounder = format_detail::InstanceBounder<Layout, StillInstanceBounds, format_detail::ShortPartStack<2>>;
  return Bounder(format_detail::BoundedObject(file, object), to_scene).bounds(object.root, levels);
}

}  // namespace hiprt::build
