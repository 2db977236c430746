#pragma once
/// One reference per leaf, and how many there may be after splits. Internal.

#include <hiprt_build/tree/binary_tree.h>

#include <span>

namespace hiprt::build {

/// As many leaves as a file can address. All numbers of references, nodes and subtrees, at most twice as many, fit into
/// 31 bits.
inline constexpr std::size_t kMaxReferences = kAddressLimit / sizeof(FloatLeaf);
static_assert(2 * kMaxReferences < kLinkedLeaf);

/// @return how many references there may be after splits: budget times as many, or what can be addressed.
/// @pre budget >= 1
constexpr std::size_t split_capacity(std::size_t count, double budget) {
  const double wanted = static_cast<double>(count) * budget;
  const std::size_t capacity =
      wanted < static_cast<double>(kMaxReferences) ? static_cast<std::size_t>(wanted) : kMaxReferences;
  return capacity < count ? count : capacity;
}

/// Step: reference i holds leaf i.
struct MakeReferenceStep {
  const GeometryTable& geometries;
  std::span<const LeafPrimitives> leaves;
  std::span<Reference> references;

  void operator()(std::size_t i) const {
    const LeafPrimitives& leaf = leaves[i];
    references[i] = Reference{to_box(leaf_simd_box(geometries, leaf)), leaf.contents, leaf.primitive};
  }
};

}  // namespace hiprt::build
