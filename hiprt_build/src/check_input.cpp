#include <hiprt_build/src/check_input.h>

namespace hiprt::build {

std::string place(const PrimitiveSoup& soup, std::size_t geometry) {
  const bool custom = geometry >= soup.meshes.size();
  const std::size_t index = custom ? geometry - soup.meshes.size() : geometry;
  const std::string_view name = custom ? soup.customs[index].name : soup.meshes[index].name;
  return (custom ? "custom geometry " : "mesh ") + std::to_string(index) +
         (name.empty() ? "" : " (" + std::string(name) + ")");
}

std::string place(const PrimitiveSoup& soup, std::size_t geometry, std::size_t primitive) {
  return place(soup, geometry) + (geometry >= soup.meshes.size() ? ", primitive " : ", triangle ") +
         std::to_string(primitive) + ": ";
}

Result<void> check_indices(CpuEngine& engine, const PrimitiveSoup& soup) {
  for (std::size_t m = 0; m < soup.meshes.size(); ++m) {
    const TriangleMesh& mesh = soup.meshes[m];
    const std::size_t i = engine.find_first(mesh.triangles.size(), [&](std::size_t t) {
      const Triangle& indices = mesh.triangles[t];
      return std::max({indices[0], indices[1], indices[2]}) >= mesh.positions.size();
    });
    if (i == mesh.triangles.size()) continue;
    const Triangle& t = mesh.triangles[i];
    return tl::unexpected(invalid(place(soup, m, i) + "index " + std::to_string(*std::max_element(t.begin(), t.end())) +
                                  ", but there are " + std::to_string(mesh.positions.size()) + " vertices"));
  }
  return {};
}

}  // namespace hiprt::build
