#include <tools/parts/part_data.h>

#include <tools/base/bytes.h>
#include <tools/base/errors.h>

#include <algorithm>
#include <array>
#include <functional>
#include <string>
#include <utility>

namespace hiprt::tools {
namespace {

constexpr std::array<char, 8> kMagic{'H', 'I', 'P', 'R', 'T', 'P', 'R', 'T'};
constexpr std::uint32_t kDataVersion = 2;

/// A Material without its name.
struct MaterialRecord {
  std::array<float, 3> base_color;
  float alpha, alpha_cutoff, metallic, roughness;
  std::array<float, 3> emission;
  TextureUse base_color_texture, metallic_roughness_texture, emission_texture;
};

void add(ByteWriter& writer, const GeometrySurface& surface) {
  writer.add(surface.shape_material.value_or(kInvalidId));
  writer.add(surface.shapes);
  writer.add_array(std::span(surface.triangles));
  writer.add_array(std::span(surface.materials));
  writer.add_array(std::span(surface.coordinates));
  writer.add_array(std::span(surface.normals));
  writer.add_array(std::span(surface.times));
}

GeometrySurface get_surface(ByteReader& reader) {
  GeometrySurface surface;
  const auto material = reader.get<std::uint32_t>();
  surface.shapes = reader.get<std::uint64_t>();
  surface.triangles = reader.get_array<build::Triangle>();
  surface.materials = reader.get_array<std::uint32_t>();
  surface.coordinates = reader.get_array<std::array<float, 2>>();
  surface.normals = reader.get_array<std::array<float, 3>>();
  surface.times = reader.get_array<float>();
  if (material != kInvalidId) surface.shape_material = material;
  return surface;
}

void add(ByteWriter& writer, const SceneSurfaces& surfaces) {
  writer.add(std::uint64_t{surfaces.textures.size()});
  for (const Texture& texture : surfaces.textures) {
    writer.add(texture.width);
    writer.add(texture.height);
    writer.add_array(std::span(texture.texels));
  }
  writer.add(std::uint64_t{surfaces.materials.size()});
  for (const Material& m : surfaces.materials) {
    writer.add_text(m.name);
    writer.add(MaterialRecord{m.base_color, m.alpha, m.alpha_cutoff, m.metallic, m.roughness, m.emission,
                              m.base_color_texture, m.metallic_roughness_texture, m.emission_texture});
  }
  writer.add(std::uint64_t{surfaces.objects.size()});
  for (const auto& object : surfaces.objects) {
    writer.add(std::uint64_t{object.size()});
    for (const GeometrySurface& geometry : object) add(writer, geometry);
  }
}

SceneSurfaces get_surfaces(ByteReader& reader) {
  SceneSurfaces surfaces;
  for (auto left = reader.get<std::uint64_t>(); left != 0 && reader.ok(); --left) {
    Texture& texture = surfaces.textures.emplace_back();
    texture.width = reader.get<std::uint32_t>();
    texture.height = reader.get<std::uint32_t>();
    texture.texels = reader.get_array<std::uint32_t>();
  }
  for (auto left = reader.get<std::uint64_t>(); left != 0 && reader.ok(); --left) {
    const std::string name = reader.get_text();
    const auto m = reader.get<MaterialRecord>();
    surfaces.materials.push_back({name, m.base_color, m.alpha, m.alpha_cutoff, m.metallic, m.roughness, m.emission,
                                  m.base_color_texture, m.metallic_roughness_texture, m.emission_texture});
  }
  for (auto left = reader.get<std::uint64_t>(); left != 0 && reader.ok(); --left) {
    auto& object = surfaces.objects.emplace_back();
    for (auto geometries = reader.get<std::uint64_t>(); geometries != 0 && reader.ok(); --geometries)
      object.push_back(get_surface(reader));
  }
  return surfaces;
}

/// Checks that the numbers in surfaces stay within their arrays. @return what is wrong; empty: nothing.
class SurfaceCheck {
 public:
  SurfaceCheck(const SceneSurfaces& surfaces, const BufferView& bvh) : surfaces_(surfaces), bvh_(bvh) {}

  std::string run() {
    for (std::size_t i = 0; i < surfaces_.textures.size(); ++i) {
      const Texture& texture = surfaces_.textures[i];
      const std::uint64_t texels = std::uint64_t{texture.width} * texture.height;
      if (texels == 0 || texture.texels.size() != texels)
        return "texture " + std::to_string(i) + " has another number of texels than its size says";
    }
    for (std::size_t i = 0; i < surfaces_.materials.size(); ++i) {
      const Material& m = surfaces_.materials[i];
      for (const TextureUse* use : {&m.base_color_texture, &m.metallic_roughness_texture, &m.emission_texture})
        if (!fits(*use)) return "material " + std::to_string(i) + " uses a texture that does not exist";
    }
    return check_objects();
  }

 private:
  bool fits(const TextureUse& use) const {
    const auto is_known = [](TextureWrap wrap) {
      return wrap == TextureWrap::kRepeat || wrap == TextureWrap::kMirror || wrap == TextureWrap::kClamp;
    };
    return (use.texture == TextureUse{}.texture || use.texture < surfaces_.textures.size()) && is_known(use.wrap_u) &&
           is_known(use.wrap_v);
  }

  std::string check_objects() const {
    std::size_t own = 0;
    for (const ObjectRecord& object : bvh_.objects)
      own += open_buffer(bvh_.object_file(object))->has_instances() ? 0 : 1;
    if (surfaces_.objects.size() != own)
      return std::to_string(surfaces_.objects.size()) + " objects have surfaces, the BVH has " + std::to_string(own);
    for (std::size_t i = 0; i < own; ++i) {
      const BufferView object = *open_buffer(bvh_.object_file(bvh_.objects[i]));
      const auto& geometries = surfaces_.objects[i];
      if (geometries.size() != object.geometries.size())
        return "object " + std::to_string(i) + " has another number of geometries than that of the BVH";
      for (std::size_t g = 0; g < geometries.size(); ++g)
        if (const char* wrong = check(geometries[g], object, g))
          return "object " + std::to_string(i) + ", geometry " + std::to_string(g) + ": " + wrong;
    }
    return {};
  }

  const char* check(const GeometrySurface& surface, const BufferView& object, std::size_t geometry) const {
    const GeometryRecord& record = object.geometries[geometry];
    const bool moves = !object.shapes.empty() && object.shapes[geometry].kind == ShapeKind::kMovingTriangles;
    const bool custom = (record.flags & kGeometryCustom) != 0 && !moves;
    if (surface.primitives() != record.primitive_count || surface.shape_material.has_value() != custom ||
        surface.times.empty() == moves)
      return "it has other primitives than that of the BVH";
    for (std::size_t k = 1; k < surface.times.size(); ++k)
      if (!(surface.times[k - 1] < surface.times[k])) return "its times do not grow";
    if (moves && surface.normals.size() % surface.times.size() != 0) return "a time has not all normals";
    const std::size_t normals = surface.normals.size() / std::max<std::size_t>(surface.times.size(), 1);
    if (surface.materials.size() != surface.triangles.size()) return "not every triangle has a material";
    const auto is_material = [&](std::uint32_t material) { return material < surfaces_.materials.size(); };
    if (!std::all_of(surface.materials.begin(), surface.materials.end(), is_material) ||
        (custom && !is_material(*surface.shape_material)))
      return "a material does not exist";
    const auto fits = [&](const build::Triangle& triangle) {
      return std::all_of(triangle.begin(), triangle.end(), [&](std::uint32_t vertex) {
        return (surface.coordinates.empty() || vertex < surface.coordinates.size()) &&
               (surface.normals.empty() || vertex < normals);
      });
    };
    if (!std::all_of(surface.triangles.begin(), surface.triangles.end(), fits)) return "a vertex does not exist";
    return nullptr;
  }

  const SceneSurfaces& surfaces_;
  const BufferView& bvh_;
};

/// Checks the numbers of the instances of all groups. @return what is wrong; empty: nothing.
std::string check_numbers(const std::vector<std::vector<std::uint32_t>>& groups, const BufferView& bvh) {
  std::vector<std::size_t> sizes;
  for (const ObjectRecord& object : bvh.objects)
    if (const auto view = open_buffer(bvh.object_file(object)); view->has_instances())
      sizes.push_back(view->instances.size());
  sizes.push_back(bvh.instances.size());
  if (groups.size() != sizes.size())
    return "it numbers the instances of " + std::to_string(groups.size()) + " groups, the BVH has " +
           std::to_string(sizes.size());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto& numbers = groups[g];
    if (!numbers.empty() && numbers.size() != sizes[g])
      return "it numbers " + std::to_string(numbers.size()) + " instances of group " + std::to_string(g) +
             ", the BVH has " + std::to_string(sizes[g]);
    if (std::adjacent_find(numbers.begin(), numbers.end(), std::greater_equal<>()) != numbers.end())
      return "the numbers of the instances of group " + std::to_string(g) + " do not ascend";
  }
  return {};
}

}  // namespace

std::vector<std::byte> encode(const PartData& data) {
  ByteWriter writer;
  writer.add(kMagic);
  writer.add(kDataVersion);
  writer.add(std::uint8_t{data.surfaces.has_value()});
  writer.add(std::uint64_t{data.groups.size()});
  for (const auto& numbers : data.groups) writer.add_array(std::span(numbers));
  if (data.surfaces) add(writer, *data.surfaces);
  return std::move(writer.bytes());
}

build::Result<PartData> decode_part_data(std::span<const std::byte> bytes, const BufferView& bvh) {
  ByteReader reader(bytes);
  if (reader.get<std::array<char, 8>>() != kMagic) return invalid_input("it is no data of a part");
  if (const auto version = reader.get<std::uint32_t>(); reader.ok() && version != kDataVersion)
    return invalid_input("its version is " + std::to_string(version) + ", this program reads version " +
                         std::to_string(kDataVersion));
  const bool has_surfaces = reader.get<std::uint8_t>() != 0;
  PartData data;
  for (auto left = reader.get<std::uint64_t>(); left != 0 && reader.ok(); --left)
    data.groups.push_back(reader.get_array<std::uint32_t>());
  if (has_surfaces) data.surfaces = get_surfaces(reader);
  if (!reader.ok() || !reader.at_end()) return invalid_input("it is damaged: a number of elements is wrong");
  if (const std::string wrong = check_numbers(data.groups, bvh); !wrong.empty()) return invalid_input(wrong);
  if (!data.surfaces) return data;
  if (const std::string wrong = SurfaceCheck(*data.surfaces, bvh).run(); !wrong.empty()) return invalid_input(wrong);
  data.surfaces->objects.resize(bvh.objects.size());
  return data;
}

}  // namespace hiprt::tools
