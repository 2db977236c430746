#pragma once
/// Shared by the rendering tests: scenes, cameras, and the rays of the layers.

#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/scenes.h>
#include <tools/render/image/color.h>
#include <tools/render/studio/render.h>
#include <tools/render/studio/studio.h>

#include <tests/catch.h>

#include <array>
#include <cstring>
#include <vector>

namespace hiprt::test {

using checks::make_scene;
using checks::Scene;
using oracle::Mesh;

inline constexpr std::array<tools::RenderMode, 4> kAllModes{tools::RenderMode::kAo, tools::RenderMode::kPrimary,
                                                            tools::RenderMode::kNormals, tools::RenderMode::kHeatmap};

/// Straight at the plane z = 0 from 4 units before it; y is up.
inline tools::Camera front_camera() { return {{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 40}; }

/// Two geometries in [-1.3, 1.3]^3 that hide each other, seen from a corner.
inline std::vector<Mesh> star_and_soup() { return {oracle::star(2, 11), oracle::soup(150, 0.4, 12)}; }
inline tools::Camera corner_camera() { return {{2.2, 1.4, 2.6}, {0.1, 0, 0}, {0.1, 1, 0}, 45}; }

inline tools::Rendering render_or_fail(const Scene& scene, const tools::Camera& camera,
                                       const tools::RenderOptions& options) {
  auto rendering = tools::render(scene.traced, camera, options);
  if (!rendering) FAIL(rendering.error().message);
  return std::move(*rendering);
}

/// Every bit of every pixel, colours and layers.
inline bool same_bytes(const tools::Image& a, const tools::Image& b) {
  static_assert(sizeof(tools::Pixel) == 19 * 4, "no padding");
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(tools::Pixel)) == 0;
}

/// The largest difference of a channel.
inline float largest_difference(const Vec3& a, const Vec3& b) {
  return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

}  // namespace hiprt::test
