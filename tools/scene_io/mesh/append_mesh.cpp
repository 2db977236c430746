#include <tools/scene_io/mesh/append_mesh.h>

#include <tools/base/errors.h>

#include <limits>

namespace hiprt::tools {

build::Result<std::uint32_t> append(Mesh& mesh, std::span<const build::Position> positions,
                                    std::span<const build::Triangle> triangles, const Transform& to_world) {
  if (positions.size() > std::numeric_limits<std::uint32_t>::max() - mesh.positions.size())
    return fail(build::ErrorCode::kTooLarge, "all nodes together have more than 4294967295 vertices");
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  for (const build::Position& position : positions) mesh.positions.push_back(to_world(position));
  const bool mirrored = to_world.mirrors();
  for (const build::Triangle& t : triangles)
    mesh.triangles.push_back({base + t[0], base + t[mirrored ? 2 : 1], base + t[mirrored ? 1 : 2]});
  return base;
}

}  // namespace hiprt::tools
