#pragma once
/// The way of a batch of rays through the parts of a scene: which part each ray visits next, and what is known of it.
///
/// A ray visits one part at a time, the nearest first. It ends at its closest hit so far, and does not visit parts
/// behind that. So it visits each part at most once.

#include <tools/render/parts/part_answer.h>
#include <tools/render/parts/part_router.h>

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

namespace hiprt::tools {

/// What a tour finds. The arrays have an element per ray, `paths` has `levels`.
struct TourHits {
  Hit* hits;              ///< Query::kAny: found or not.
  std::uint32_t* paths;   ///< Query::kClosest only. The numbers of instances are those of the scene.
  PathSurface* surfaces;  ///< The same.
  std::uint32_t levels;
};

/// A copy continues from the state of the original.
class RayTour {
 public:
  /// @param hits what is known already: no hit, or one in the shared part. With Query::kAny, rays that have a hit visit
  /// no part.
  /// @param rays, hits must live as long as this and its copies.
  RayTour(const PartRouter& router, Query query, std::span<const Ray> rays, const TourHits& hits);

  bool done() const { return open_ == 0; }
  /// Number of rays that are ready to visit a part.
  std::size_t ready(std::uint32_t part) const { return ready_[part].size(); }

  /// Some rays on their way to a part.
  struct Parcel {
    std::uint32_t part = 0;
    std::vector<std::uint32_t> numbers;  ///< Of the rays.
    std::vector<Ray> rays;               ///< They end at their closest hits so far.
  };
  /// Takes rays that are ready. @param most how many at most.
  Parcel take(std::uint32_t part, std::size_t most);

  /// Takes a part's answer to a parcel.
  /// @return false if the answer does not fit the parcel; then nothing has changed.
  bool give(const Parcel& parcel, const PartAnswer& answer);

 private:
  bool is_behind_hit(std::uint32_t ray, const PartVisit& visit) const;
  /// Moves a ray to its next part, or ends its tour.
  void go_on(std::uint32_t ray);
  void take_closest(std::uint32_t ray, const PartHit& hit, std::span<const std::uint32_t> path);

  Query query_;
  std::span<const Ray> rays_;
  TourHits hits_;
  std::vector<PartVisit> visits_;                 ///< Of ray 0, of ray 1, ...
  std::vector<std::uint64_t> next_;               ///< Index of each ray's next visit.
  std::vector<std::uint64_t> end_;                ///< Behind each ray's last visit.
  std::vector<std::deque<std::uint32_t>> ready_;  ///< Rays, by part.
  std::size_t open_;                              ///< Rays whose tours go on.
};

}  // namespace hiprt::tools
