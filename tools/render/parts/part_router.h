#pragma once
/// Which parts of a scene a ray may have hits in.

#include <tools/parts/part_manifest.h>

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

/// The boxes of all parts. The test is that of the traversal (box_test.h) with the margin of each part's tree. So a
/// part without a visit has no hit (docs/proofs/conservative-boxes.md, docs/proofs/instances.md).
class PartRouter {
 public:
  /// @param parts must live as long as this.
  explicit PartRouter(std::span<const ScenePart> parts) : parts_(parts) {}

  /// Appends the visits of a ray, in the order of `enter`. Its cost is proportional to the number of parts.
  void route(const Ray& ray, std::vector<PartVisit>& visits) const;

  std::size_t parts() const { return parts_.size(); }

 private:
  std::span<const ScenePart> parts_;
};

}  // namespace hiprt::tools
