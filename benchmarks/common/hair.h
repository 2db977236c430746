#pragma once
/// A head of hair: many thin curves, long and close to each other. The same on every machine.

#include <tools/render/scene/camera.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <hiprt_build/input.h>

#include <cstdint>
#include <vector>

namespace hiprt::bench {

/// Strands as they lie in a .hair file. Units are centimetres, y is up, the face looks along z.
struct Hair {
  std::vector<ShapePoint> points;      ///< Strand by strand.
  std::vector<std::uint32_t> strands;  ///< Points of each.
};

inline constexpr std::uint32_t kHairPoints = 8;  ///< Per strand.

/// Strands with kHairPoints points each, combed to both sides, in waves that neighbours share. All together cover as
/// much whatever their number: the more there are, the thinner they are, from 0.2 to 0.005 mm.
/// @param strands 1 to 500 million.
Hair hair(std::uint32_t strands);

/// What they grow on: an ellipsoid of 32,000 triangles.
tools::Mesh hair_head();

/// Looks at it from the front and the side.
tools::Camera hair_camera();

}  // namespace hiprt::bench
