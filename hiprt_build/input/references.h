#pragma once
/// One reference per group of primitives. Internal.

#include <hiprt_build/input/geometry.h>
#include <hiprt_build/tree/binary_tree.h>
#include <hiprt_build/tree/linked_tree.h>

namespace hiprt::build {

/// As many as a file can address leaves. All numbers of references, nodes and subtrees, at most twice as many, fit into
/// 31 bits.
inline constexpr std::size_t kMostReferences = kAddressLimit / sizeof(FloatLeaf);
static_assert(2 * kMostReferences < kLinkedLeaf);

/// @return how many references there may be once @p count are split: budget times as many, or what can be addressed.
/// @pre budget >= 1
constexpr std::size_t room_for_splits(std::size_t count, double budget) {
  const double wanted = static_cast<double>(count) * budget;
  const std::size_t room =
      wanted < static_cast<double>(kMostReferences) ? static_cast<std::size_t>(wanted) : kMostReferences;
  return room < count ? count : room;
}

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
