#pragma once
/// Which parts of a scene a ray may have hits in.

#include <tools/parts/part_manifest.h>

#include <hiprt_device/format/node.h>
#include <hiprt_device/ray.h>

#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::tools {

/// A part that a ray may have hits in.
struct PartVisit {
  std::uint32_t part;
  float enter;  ///< No hit in the part has a smaller t.
};

/// A tree over the boxes of all parts. The test is that of the traversal (box_test.h), with a margin that is enough for
/// each part's tree. So a part without a visit has no hit (docs/proofs/parts.md).
class PartRouter {
 public:
  explicit PartRouter(std::span<const ScenePart> parts);

  /// Appends the visits of a ray, in the order of `enter`.
  void route(const Ray& ray, std::vector<PartVisit>& visits) const;

  std::size_t parts() const { return parts_; }

 private:
  struct Item {
    Box box;
    std::uint32_t part;
  };

  /// @return the reference of a tree over the items: a node, or the part of the only one.
  NodeRef build(std::span<Item> items);

  std::size_t parts_;
  std::vector<PlanesBoxNode> nodes_;
  NodeRef root_ = kInvalidRef;
  Box bounds_{};
  float condition_ = 0.0f, reach_ = 0.0f;  ///< The largest of all parts.
};

}  // namespace hiprt::tools
