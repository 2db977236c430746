#pragma once
/// The light of bvhrender's pictures: a bright sky with a large soft key light over the viewer's left shoulder, a dim
/// floor, and a plain backdrop behind the object.

#include "camera.h"

#include <hiprt_device/vec.h>

namespace hiprt::tools {

class Studio {
 public:
  explicit Studio(const Camera& camera);

  /// Light from a unit direction, before anything is in its way. A surface that faces up sees about 1.
  Vec3 sky(const Vec3& direction) const;

  /// What a pixel shows where nothing is hit.
  /// @param height 0 at the bottom of the picture, 1 at the top.
  static Vec3 backdrop(float height);

  /// Reflectance of everything: a warm light grey.
  static Vec3 clay() { return {0.80f, 0.775f, 0.745f}; }

 private:
  Vec3 up_, key_;  ///< Unit.
};

}  // namespace hiprt::tools
