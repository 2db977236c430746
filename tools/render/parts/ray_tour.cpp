#include <tools/render/parts/ray_tour.h>

#include <algorithm>
#include <limits>

namespace hiprt::tools {

RayTour::RayTour(const PartRouter& router, Query query, std::span<const Ray> rays, const TourHits& hits)
    : query_(query), rays_(rays), hits_(hits), ready_(router.parts()), open_(rays.size()) {
  next_.reserve(rays.size());
  end_.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    next_.push_back(visits_.size());
    const bool stays = hits.hits[i].failed() || (query == Query::kAny && hits.hits[i].found());
    if (!stays) router.route(rays[i], visits_);
    end_.push_back(visits_.size());
    go_on(static_cast<std::uint32_t>(i));
  }
}

bool RayTour::is_behind_hit(std::uint32_t ray, const PartVisit& visit) const {
  return query_ == Query::kClosest && hits_.hits[ray].found() && visit.enter > hits_.hits[ray].t;
}

void RayTour::go_on(std::uint32_t ray) {
  // Visits are in the order of their entries: the first one behind the hit is followed by others behind it.
  if (next_[ray] == end_[ray] || is_behind_hit(ray, visits_[next_[ray]]))
    --open_;
  else
    ready_[visits_[next_[ray]++].part].push_back(ray);
}

RayTour::Parcel RayTour::take(std::uint32_t part, std::size_t most) {
  Parcel parcel{part, {}, {}};
  std::deque<std::uint32_t>& ready = ready_[part];
  for (std::size_t left = std::min(most, ready.size()); left != 0; --left) {
    const std::uint32_t i = ready.front();
    ready.pop_front();
    parcel.numbers.push_back(i);
    Ray& ray = parcel.rays.emplace_back(rays_[i]);
    // A hit at the same t may win the tie.
    if (query_ == Query::kClosest && hits_.hits[i].found()) ray.tmax = std::min(ray.tmax, hits_.hits[i].t);
  }
  return parcel;
}

bool RayTour::give(const Parcel& parcel, const PartAnswer& answer) {
  if (answer.query != query_ || answer.results.size() != parcel.numbers.size()) return false;
  std::size_t next_hit = 0;
  for (std::size_t k = 0; k < parcel.numbers.size(); ++k) {
    const std::uint32_t ray = parcel.numbers[k];
    Hit& best = hits_.hits[ray];
    bool ends = false;
    switch (answer.results[k]) {
      case VisitResult::kMiss:
        break;
      case VisitResult::kFailed:
        best = {};
        best.t = std::numeric_limits<float>::quiet_NaN();
        ends = true;
        break;
      case VisitResult::kHit:
        if (query_ == Query::kClosest) {
          take_closest(ray, answer.hits[next_hit],
                       std::span(answer.paths).subspan(next_hit * hits_.levels, hits_.levels));
          ++next_hit;
        } else {
          best.primitive = 0;
          ends = true;
        }
        break;
    }
    if (ends)
      --open_;
    else
      go_on(ray);
  }
  return true;
}

void RayTour::take_closest(std::uint32_t ray, const PartHit& found, std::span<const std::uint32_t> path) {
  Hit& best = hits_.hits[ray];
  const std::span<std::uint32_t> best_path(hits_.paths + std::size_t{ray} * hits_.levels, hits_.levels);
  const auto comes_first = [&] {
    if (!best.found() || found.hit.t != best.t) return !best.found() || found.hit.t < best.t;
    // As one traversal decides (query_core.h). Two parts have no path in common, and none that begins the other.
    return std::lexicographical_compare(path.begin(), path.end(), best_path.begin(), best_path.end());
  };
  if (!comes_first()) return;
  best = found.hit;
  std::copy(path.begin(), path.end(), best_path.begin());
  hits_.surfaces[ray] = surface_of(found);
}

}  // namespace hiprt::tools
