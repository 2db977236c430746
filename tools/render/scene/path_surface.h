#pragma once
/// The surface at a hit: position, normals and material.

#include <tools/render/scene/frame.h>
#include <tools/render/scene/instance_paths.h>
#include <tools/render/scene/path_scene.h>

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/instances/motion.h>
#include <hiprt_device/math/vec_functions.h>

namespace hiprt::tools {

/// What scatters and emits at a point.
struct PathSurface {
  Vec3 geometric{0.0f};  ///< Unit normals on the side that the path comes from.
  Vec3 normal{0.0f};     ///< For shading.
  TextureCoordinates coordinates{0.0f, 0.0f};
  Vec3 base_color{0.0f};
  float metallic = 0.0f, roughness = 1.0f;
  Vec3 emission{0.0f};
  std::uint32_t object = 0;
  std::uint64_t triangle = kNoTriangle;
};

inline namespace HIPRT_ISA_NAMESPACE {

/// Transform from the scene to the object of an instance path: object point = linear * p + offset. In double.
struct InstanceTransform {
  double linear[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  double offset[3] = {0, 0, 0};
  std::uint32_t object = 0;  ///< Of a scene without instances: 0.

  template <unsigned kLevels>
  HIPRT_HD InstanceTransform(const SceneView& scene, const InstancePath<kLevels>& path, float time) {
    follow(scene, path, time, [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) {
      double next[3][3], moved[3];
      for (unsigned r = 0; r < 3; ++r) {
        moved[r] = 0.0;
        for (unsigned c = 0; c < 3; ++c) {
          next[r][c] = 0.0;
          for (unsigned k = 0; k < 3; ++k) next[r][c] += static_cast<double>(record.linear[r][k]) * linear[k][c];
          moved[r] +=
              static_cast<double>(record.linear[r][c]) * (offset[c] - static_cast<double>(record.translation[c]));
        }
      }
      for (unsigned r = 0; r < 3; ++r) {
        offset[r] = moved[r];
        for (unsigned c = 0; c < 3; ++c) linear[r][c] = next[r][c];
      }
      object = record.object;
    });
  }

  HIPRT_HD Vec3 normal_to_scene(const Vec3& n) const {
    const auto column = [&](unsigned c) {
      return static_cast<float>(linear[0][c] * static_cast<double>(n.x) + linear[1][c] * static_cast<double>(n.y) +
                                linear[2][c] * static_cast<double>(n.z));
    };
    return Vec3(column(0), column(1), column(2));
  }
  HIPRT_HD Vec3 point_to_scene(const Vec3& p) const {
    const double(&m)[3][3] = linear;
    const double x = static_cast<double>(p.x) - offset[0], y = static_cast<double>(p.y) - offset[1],
                 z = static_cast<double>(p.z) - offset[2];
    const auto cofactor = [&](unsigned r, unsigned c) {
      const unsigned r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      return m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
    };
    const double determinant = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
    const auto component = [&](unsigned k) {
      return static_cast<float>((cofactor(0, k) * x + cofactor(1, k) * y + cofactor(2, k) * z) / determinant);
    };
    return Vec3(component(0), component(1), component(2));
  }
};

/// @return @p v / |v|; 0 if that is none.
HIPRT_HD inline Vec3 unit_or_zero(const Vec3& v) {
  const float most = max_component(v);
  if (!(most > 0.0f && most <= std::numeric_limits<float>::max())) return Vec3(0.0f);
  const Vec3 scaled = v / most;
  return scaled / std::sqrt(glm::dot(scaled, scaled));
}

namespace path_detail {

HIPRT_HD inline std::uint32_t wrapped(int i, std::uint32_t size, TextureWrap wrap) {
  const int n = static_cast<int>(size);
  if (wrap == TextureWrap::kClamp) return static_cast<std::uint32_t>(i < 0 ? 0 : i >= n ? n - 1 : i);
  const int period = wrap == TextureWrap::kMirror ? 2 * n : n;
  int at = i % period;
  if (at < 0) at += period;
  return static_cast<std::uint32_t>(at < n ? at : period - 1 - at);
}

}  // namespace path_detail

/// Colour and alpha of a texture, 0 to 1 per channel.
struct TexturePoint {
  float channel[4];
};

/// Bilinear. @param srgb whether the colours are sRGB's; they come back linear.
HIPRT_HD inline TexturePoint sample(const PathScene& scene, const PathTextureUse& use, const TextureCoordinates& at,
                                    bool srgb) {
  const PathTexture& texture = scene.arrays.textures.data[use.texture];
  const float x =
      (use.matrix[0][0] * at.u + use.matrix[0][1] * at.v + use.matrix[0][2]) * static_cast<float>(texture.width);
  const float y =
      (use.matrix[1][0] * at.u + use.matrix[1][1] * at.v + use.matrix[1][2]) * static_cast<float>(texture.height);
  // Farther out there is nothing left between texels; NaN too.
  constexpr float kFarthest = 4194304.0f;
  const float px = absolute(x) < kFarthest ? x - 0.5f : 0.0f, py = absolute(y) < kFarthest ? y - 0.5f : 0.0f;
  const float left = std::floor(px), top = std::floor(py);
  const float weight_x[2] = {1.0f - (px - left), px - left}, weight_y[2] = {1.0f - (py - top), py - top};
  TexturePoint result{{0.0f, 0.0f, 0.0f, 0.0f}};
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i) {
      const std::uint32_t column = path_detail::wrapped(static_cast<int>(left) + i, texture.width, use.wrap_u);
      const std::uint32_t row = path_detail::wrapped(static_cast<int>(top) + j, texture.height, use.wrap_v);
      const std::uint32_t texel =
          scene.arrays.texels.data[std::uint64_t{texture.first_texel} + std::uint64_t{row} * texture.width + column];
      const float weight = weight_x[i] * weight_y[j];
      for (unsigned c = 0; c < 4; ++c) {
        const std::uint32_t byte = texel >> (8 * c) & 0xffu;
        const float value = srgb && c < 3 ? scene.arrays.linear.data[byte] : static_cast<float>(byte) * (1.0f / 255.0f);
        result.channel[c] += weight * value;
      }
    }
  return result;
}

HIPRT_HD inline bool has_texture(const PathTextureUse& use) { return use.texture != kInvalidId; }

/// Which of the scene's triangles was hit, or that it was a sphere or a curve.
struct PathTriangle {
  const PathGeometry* geometry = nullptr;  ///< nullptr: nothing is known but the material.
  std::uint64_t triangle = kNoTriangle;
  std::uint32_t material = 0;

  HIPRT_HD PathTriangle(const PathGeometry& of, std::uint64_t number) : geometry(&of), triangle(number) {}
  HIPRT_HD PathTriangle(const PathScene& scene, std::uint32_t object, std::uint32_t of_object,
                        std::uint32_t primitive) {
    if (scene.arrays.first_geometry.size == 0) return;
    const PathGeometry& of = scene.arrays.geometries.data[scene.arrays.first_geometry.data[object] + of_object];
    material = of.material;
    if (material != kInvalidId) return;
    geometry = &of;
    triangle = geometry->first_triangle + primitive;
    material = scene.arrays.triangle_material.data[triangle];
  }

  /// Between the corners' values. @param u, v as Hit has them.
  template <class Value, class Read>
  HIPRT_HD Value between(const PathScene& scene, float u, float v, Read&& read) const {
    const std::uint32_t(&corner)[3] = scene.arrays.triangles.data[triangle].vertex;
    return read(corner[0]) * (1.0f - u - v) + read(corner[1]) * u + read(corner[2]) * v;
  }
  HIPRT_HD TextureCoordinates coordinates(const PathScene& scene, float u, float v) const {
    if (geometry == nullptr || geometry->first_coordinates == kNoVertices) return {u, v};
    const TextureCoordinates* of = scene.arrays.coordinates.data + geometry->first_coordinates;
    return {between<float>(scene, u, v, [&](std::uint32_t vertex) { return of[vertex].u; }),
            between<float>(scene, u, v, [&](std::uint32_t vertex) { return of[vertex].v; })};
  }
};

/// The normal between those of a triangle's corners, in the object's space. Of a triangle that moves, corners have the
/// normals between those of two times.
/// @pre the geometry has normals
HIPRT_HD inline Vec3 normal_between(const PathScene& scene, const PathTriangle& triangle, const Hit& hit, float time) {
  const PathGeometry& geometry = *triangle.geometry;
  const Vec3* normals = scene.arrays.normals.data + geometry.first_normal;
  const auto at = [&](const Vec3* vertices) {
    return triangle.between<Vec3>(scene, hit.u, hit.v, [&](std::uint32_t vertex) { return vertices[vertex]; });
  };
  if (geometry.times < 2) return at(normals);
  const float* times = scene.arrays.times.data + geometry.first_time;
  const std::uint32_t key = segment_at(geometry.times - 1, time, [&](std::uint32_t i) { return times[i]; });
  const float s = part_of(times[key], times[key + 1], time);
  normals += key * geometry.vertices;
  return at(normals) * (1.0f - s) + at(normals + geometry.vertices) * s;
}

/// @param path of the hit. @param hit found.
template <unsigned kLevels>
HIPRT_HD inline PathSurface surface_at(const PathScene& scene, const Ray& ray, const Hit& hit,
                                       const InstancePath<kLevels>& path) {
  PathSurface result;
  const Vec3 normal = unit_or_zero(hit.normal);
  const bool has_normal = glm::dot(normal, normal) > 0.0f;
  result.geometric = !has_normal ? -ray.direction : glm::dot(normal, ray.direction) > 0.0f ? -normal : normal;
  result.normal = result.geometric;
  const InstanceTransform transform(scene.view, path, ray.time);
  result.object = transform.object;
  const PathTriangle triangle(scene, transform.object, hit.geometry, hit.primitive);
  result.triangle = triangle.triangle;
  result.coordinates = triangle.coordinates(scene, hit.u, hit.v);
  if (triangle.geometry != nullptr && triangle.geometry->first_normal != kNoVertices) {
    const Vec3 smooth = unit_or_zero(transform.normal_to_scene(normal_between(scene, triangle, hit, ray.time)));
    const float side = glm::dot(smooth, result.geometric);
    if (side != 0.0f) result.normal = side < 0.0f ? -smooth : smooth;
    // A shading normal that faces away from the ray would be black: use the geometric normal.
    if (!(glm::dot(result.normal, ray.direction) < 0.0f)) result.normal = result.geometric;
  }
  const PathMaterial& material = scene.arrays.materials.data[triangle.material];
  result.base_color = material.base_color;
  result.metallic = material.metallic;
  result.roughness = material.roughness;
  result.emission = material.emission;
  const auto color = [](const TexturePoint& t) { return Vec3(t.channel[0], t.channel[1], t.channel[2]); };
  if (has_texture(material.base_color_texture))
    result.base_color *= color(sample(scene, material.base_color_texture, result.coordinates, true));
  if (has_texture(material.metallic_roughness_texture)) {
    const TexturePoint t = sample(scene, material.metallic_roughness_texture, result.coordinates, false);
    result.metallic *= t.channel[2];
    result.roughness *= t.channel[1];
  }
  if (has_texture(material.emission_texture))
    result.emission *= color(sample(scene, material.emission_texture, result.coordinates, true));
  return result;
}

/// Intersection filter: rejects hits where the alpha of the material is below its cutoff.
struct AlphaCutout {
  const PathScene* scene = nullptr;  ///< nullptr: every hit is accepted.

  template <class AnyHit> HIPRT_HD FilterResult operator()(const Ray&, const AnyHit& hit) const {
    if (scene == nullptr) return FilterResult::kAccept;
    std::uint32_t object = 0;
    if constexpr (requires { hit.path; })
      follow<false>(
          scene->view, hit.path, 0.0f,
          [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) { object = record.object; });
    const PathTriangle triangle(*scene, object, hit.geometry, hit.primitive);
    const PathMaterial& material = scene->arrays.materials.data[triangle.material];
    if (!(material.alpha_cutoff > 0.0f)) return FilterResult::kAccept;
    float alpha = material.alpha;
    if (has_texture(material.base_color_texture))
      alpha *= sample(*scene, material.base_color_texture, triangle.coordinates(*scene, hit.u, hit.v), true).channel[3];
    return alpha < material.alpha_cutoff ? FilterResult::kReject : FilterResult::kAccept;
  }
};
static_assert(IntersectionFilter<AlphaCutout>);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
