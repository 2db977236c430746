#pragma once
/// An island with a forest, in the manner of Disney's Moana scene: few triangles, thousands of millions in instances on
/// three levels. The same on every machine.

#include <tools/render/scene/camera.h>
#include <tools/scene_io/scene/scene_description.h>

#include <cstdint>

namespace hiprt::bench {

struct IslandOptions {
  std::uint32_t districts = 220;  ///< Instances of the scene, of 6 kinds; 1 or more.
  std::uint32_t groves = 64;      ///< Per district, of 8 kinds; 1 or more.
  std::uint32_t plants = 48;      ///< Per grove, of 10 kinds; 1 or more.
  /// 1: about 1.1 M triangles in meshes. Less: coarser ground and plants.
  double detail = 1.0;
};

/// The ground, trees, bushes and rocks; groves, districts, and the island of them. y is up, units are metres. With the
/// defaults 33 thousand million triangles and more.
tools::SceneDescription island(const IslandOptions& options = {});

/// A view from above the sea.
tools::Camera island_camera();

}  // namespace hiprt::bench
