#pragma once
/// A teapot in a stadium: fine detail in a large scene, the classic that uniform grids fail at. The same on every
/// machine.

#include <tools/render/scene/camera.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <cstdint>

namespace hiprt::bench {

/// A bowl of terraces 400 m long around a field; a teapot 20 cm high stands in its middle. y is up, units are metres.
/// @param triangles of the stadium, and as many again of the teapot, about; 1000 or more.
tools::Mesh stadium(std::uint32_t triangles = 1'000'000);

/// Looks at the teapot, the terraces behind it.
tools::Camera stadium_camera();

}  // namespace hiprt::bench
