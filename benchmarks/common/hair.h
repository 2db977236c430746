#pragma once
/// A head of hair: many long, thin, dense curves. The same on every machine.

#include <tools/render/scene/camera.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <hiprt_build/input.h>

#include <cstdint>
#include <vector>

namespace hiprt::bench {

/// Strands as in a .hair file. Units are centimetres, y is up, the face looks along z.
struct Hair {
  std::vector<ShapePoint> points;      ///< Strand by strand.
  std::vector<std::uint32_t> strands;  ///< Number of points of each.
};

inline constexpr std::uint32_t kHairPoints = 8;  ///< Per strand.

/// Strands with kHairPoints points each, combed to both sides, in waves that neighbours share. More strands are
/// thinner, from 0.2 to 0.005 mm, so that the covered area stays the same.
/// @param strands 1 to 500 million.
Hair hair(std::uint32_t strands);

/// The head: an ellipsoid of 32,000 triangles.
tools::Mesh hair_head();

/// A camera in front of the head, to the side.
tools::Camera hair_camera();

}  // namespace hiprt::bench
