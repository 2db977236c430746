#pragma once
/// A teapot in a stadium: fine detail in a large scene, on which uniform grids fail. The same on every machine.

#include <tools/render/scene/camera.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <cstdint>

namespace hiprt::bench {

/// Terraces 400 m long around a field with a teapot 20 cm high in the middle. y is up, units are metres.
/// @param triangles approximate number of the stadium, and again of the teapot; at least 1000.
tools::Mesh stadium(std::uint32_t triangles = 1'000'000);

/// A camera that sees the teapot in front of the terraces.
tools::Camera stadium_camera();

}  // namespace hiprt::bench
