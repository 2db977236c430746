#pragma once
/// An island with a forest, similar to Disney's Moana scene: about a million triangles, and thousands of millions
/// through three levels of instances. The same on every machine.

#include <tools/render/scene/camera.h>
#include <tools/scene_io/scene/scene_description.h>

#include <cstdint>

namespace hiprt::bench {

struct IslandOptions {
  std::uint32_t districts = 220;  ///< Instances of the scene, of 6 kinds; 1 or more.
  std::uint32_t groves = 64;      ///< Per district, of 8 kinds; 1 or more.
  std::uint32_t plants = 48;      ///< Per grove, of 10 kinds; 1 or more.
  /// 1: about 1.1 million triangles in meshes. Below 1: coarser ground and plants.
  double detail = 1.0;
};

/// Ground, trees, bushes and rocks; groves, districts and the island. y is up, units are metres. The defaults give more
/// than 33 thousand million triangles.
tools::SceneDescription island(const IslandOptions& options = {});

/// A view from above the sea.
tools::Camera island_camera();

}  // namespace hiprt::bench
