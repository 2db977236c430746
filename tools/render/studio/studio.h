#pragma once
/// The light of bvhrender's pictures: a bright sky with a large soft key light over the viewer's left shoulder, a dim
/// floor, and a plain backdrop behind the object.

#include <tools/render/scene/camera.h>

#include <hiprt_device/math/vec.h>

#include <array>
#include <cstddef>
#include <functional>

namespace hiprt::tools {

/// The cosine-weighted mean over the hemisphere around a normal of light that depends on the angle to one axis only.
class ZonalIrradiance {
 public:
  /// @param light of the cosine of that angle, -1 to 1.
  explicit ZonalIrradiance(const std::function<Vec3(float)>& light);

  /// @param cosine between normal and axis.
  Vec3 at(float cosine) const;

 private:
  static constexpr std::size_t kSteps = 64;
  std::array<Vec3, kSteps + 1> table_;  ///< Over the cosine from -1 to 1.
};

class Studio {
 public:
  explicit Studio(const Camera& camera);

  /// Light from a unit direction, without occlusion.
  Vec3 sky(const Vec3& direction) const;

  /// The cosine-weighted mean of sky() over the hemisphere around a unit normal.
  Vec3 open_sky(const Vec3& normal) const;

  /// What a pixel shows where nothing is hit.
  /// @param height 0 at the bottom of the picture, 1 at the top.
  static Vec3 backdrop(float height);

  /// Reflectance of everything: a warm light grey.
  static Vec3 clay() { return {0.80f, 0.775f, 0.745f}; }

 private:
  Vec3 up_, key_;  ///< Unit.
  ZonalIrradiance dome_, lobe_;
};

}  // namespace hiprt::tools
