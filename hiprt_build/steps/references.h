#pragma once
/// One reference per group of primitives. Internal.

#include <hiprt_build/steps/binary_tree.h>
#include <hiprt_build/steps/geometry.h>

namespace hiprt::build {

/// Step: reference i holds group i.
struct MakeReferenceStep {
  const PrimitiveSoup& soup;
  std::span<const PrimitiveGroup> groups;
  std::span<Reference> references;

  void operator()(std::size_t i) const {
    const Aabb box = groups[i].bounds(soup);
    references[i] = Reference{
        {box.min[0], box.min[1], box.min[2]}, 0, {box.max[0], box.max[1], box.max[2]}, static_cast<std::uint32_t>(i)};
  }
};

}  // namespace hiprt::build
