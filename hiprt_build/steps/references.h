#pragma once
/// One reference per group of triangles. Internal.

#include <hiprt_build/steps/binary_tree.h>
#include <hiprt_build/steps/geometry.h>

namespace hiprt::build {

/// Step: reference i holds group i.
struct MakeReferenceStep {
  const TriangleSoup& soup;
  std::span<const TriangleGroup> groups;
  std::span<Reference> references;

  void operator()(std::size_t i) const {
    Aabb box;
    for (const Position& v : groups[i].vertices(soup)) box.add(to_float4(v));
    references[i] = Reference{
        {box.min[0], box.min[1], box.min[2]}, 0, {box.max[0], box.max[1], box.max[2]}, static_cast<std::uint32_t>(i)};
  }
};

}  // namespace hiprt::build
