#pragma once
/// The rays of one sample per pixel of a path tracer, wave by wave.

#include "scene_source.h"

#include <hiprt_device/scene_view.h>
#include <tools/base/parallel.h>

#include <cstdint>
#include <string>
#include <vector>

namespace hiprt::bench {

struct Picture {
  unsigned width = 960, height = 540;
  unsigned bounces = 2;
};

/// Rays that are traced together.
struct Wave {
  std::string name;  ///< "primary", "bounce N" (from 1), "shadow N" (of bounce N; 0: of the primary hits).
  std::string kind;  ///< "primary", "secondary" or "shadow".
  bool any_hit = false;
  std::vector<Ray> rays;
};

/// One ray per pixel. Each hit spawns a shadow ray to the light or, without a light, into the sky. It also spawns a
/// diffuse ray, which is the next bounce. Diffuse rays and rays into the sky are cosine-weighted. Spawned rays start at
/// spawn_origin(). Rays keep the order of the pixels. Waves without rays are left out.
/// @param scene of any hierarchy of the source. It is traced to make the rays.
std::vector<Wave> make_waves(const SceneView& scene, const SourceScene& source, const Picture& picture,
                             const tools::ThreadLimit& limit);

}  // namespace hiprt::bench
