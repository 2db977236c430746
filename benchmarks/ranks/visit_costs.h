#pragma once
/// What a visit of rays to a part costs, from two sums over visits.

#include <algorithm>

namespace hiprt::bench {

/// Sums over all visits of some rays to parts.
struct VisitSums {
  double seconds = 0.0, rays = 0.0, parcels = 0.0;
};

/// Seconds of a visit without rays, and of each ray.
struct ParcelCosts {
  double parcel = 0.0, ray = 0.0;
};

/// The costs that explain both sums together. If the parcels are as large in both, as in tiny pictures, all time is
/// that of the rays.
/// @param many, few visits of the same rays in large and in small parcels.
inline ParcelCosts split(const VisitSums& many, const VisitSums& few) {
  if (!(many.rays > 0.0)) return {};
  // seconds = parcels * parcel + rays * ray, for both.
  const double determinant = few.parcels * many.rays - many.parcels * few.rays;
  const double difference = few.seconds * many.rays - many.seconds * few.rays;
  const double parcel = determinant > 0.0 ? std::max(0.0, difference / determinant) : 0.0;
  return {parcel, std::max(0.0, many.seconds - parcel * many.parcels) / many.rays};
}

}  // namespace hiprt::bench
