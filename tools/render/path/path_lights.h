#pragma once
/// Where light comes from: a sky in octahedral projection, and triangles that emit.

#include <tools/render/scene/path_surface.h>

#include <hiprt_device/math/vec_functions.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

/// A direction from which light may come.
struct LightSample {
  Vec3 direction{0.0f};   ///< Unit.
  float distance = 0.0f;  ///< +inf: the sky.
  Vec3 radiance{0.0f};
  float density = 0.0f;  ///< Per solid angle; 0: no sample.
};

/// The largest i with sums.data[first + i] <= x. @pre sums.data[first] = 0 and x < 1 = sums.data[first + count].
HIPRT_HD inline std::uint32_t find_step(const PathView<float>& sums, std::uint64_t first, std::uint32_t count,
                                        float x) {
  std::uint32_t low = 0, high = count;
  while (high - low > 1) {
    const std::uint32_t middle = low + (high - low) / 2;
    (sums.data[first + middle] <= x ? low : high) = middle;
  }
  return low;
}

/// The sky's square is [-1, 1]^2: the octahedron |x| + |y| + |z| = 1 from above, its lower half folded out (Engelhardt
/// and Dachsbacher, "Octahedron environment maps", 2008). +y is up.
struct Octahedral {
  HIPRT_HD static float sign(float x) { return x < 0.0f ? -1.0f : 1.0f; }
  HIPRT_HD static Vec3 direction(float x, float y) {
    Vec3 p(x, 1.0f - absolute(x) - absolute(y), y);
    if (p.y < 0.0f) p = Vec3((1.0f - absolute(y)) * sign(x), p.y, (1.0f - absolute(x)) * sign(y));
    return unit_or_zero(p);
  }
  struct Projection {
    float x, y;
    float stretch;  ///< Solid angle of a piece of the square, over its area.
  };
  HIPRT_HD static Projection project(const Vec3& d) {
    const float sum = absolute(d.x) + absolute(d.y) + absolute(d.z), x = d.x / sum, y = d.z / sum;
    const float stretch = sum * sum * sum;
    if (d.y >= 0.0f) return {x, y, stretch};
    return {(1.0f - absolute(y)) * sign(x), (1.0f - absolute(x)) * sign(y), stretch};
  }
};

class Sky {
 public:
  HIPRT_HD explicit Sky(const PathScene& scene) : scene_(scene) {
    if (scene.arrays.sky.size != 0) size_ = static_cast<std::uint32_t>(scene.arrays.sky_rows.size - 1);
  }

  HIPRT_HD bool empty() const { return size_ == 0; }

  /// Bilinear, over the square's edges to where the sphere goes on. @param d unit.
  HIPRT_HD Vec3 radiance(const Vec3& d) const {
    if (empty()) return Vec3(0.0f);
    const Octahedral::Projection at = Octahedral::project(d);
    const float n = static_cast<float>(size_), x = (0.5f * at.x + 0.5f) * n - 0.5f, y = (0.5f * at.y + 0.5f) * n - 0.5f;
    const float left = std::floor(x), top = std::floor(y), right = x - left, below = y - top;
    const int i = static_cast<int>(left), j = static_cast<int>(top);
    return (texel(i, j) * (1.0f - right) + texel(i + 1, j) * right) * (1.0f - below) +
           (texel(i, j + 1) * (1.0f - right) + texel(i + 1, j + 1) * right) * below;
  }

  HIPRT_HD float density(const Vec3& d) const {
    if (empty()) return 0.0f;
    const Octahedral::Projection at = Octahedral::project(d);
    return density(pixel(at.x), pixel(at.y), at.stretch);
  }

  HIPRT_HD LightSample sample(float u, float v) const {
    const PathView<float>&rows = scene_.arrays.sky_rows, &columns = scene_.arrays.sky_columns;
    const std::uint32_t row = find_step(rows, 0, size_, v);
    const std::uint64_t first = std::uint64_t{row} * (size_ + 1);
    const std::uint32_t column = find_step(columns, first, size_, u);
    const auto within = [](float x, float from, float to) { return to > from ? (x - from) / (to - from) : 0.5f; };
    const float i =
        static_cast<float>(column) + within(u, columns.data[first + column], columns.data[first + column + 1]);
    const float j = static_cast<float>(row) + within(v, rows.data[row], rows.data[row + 1]);
    const float n = static_cast<float>(size_);
    LightSample result;
    result.direction = Octahedral::direction(2.0f * i / n - 1.0f, 2.0f * j / n - 1.0f);
    result.distance = std::numeric_limits<float>::infinity();
    result.radiance = radiance(result.direction);
    result.density = density(result.direction);
    return result;
  }

 private:
  HIPRT_HD std::uint32_t pixel(float x) const {
    const float at = (0.5f * x + 0.5f) * static_cast<float>(size_);
    const auto i = static_cast<std::uint32_t>(max_of(at, 0.0f));
    return i < size_ ? i : size_ - 1;
  }
  HIPRT_HD float density(std::uint32_t column, std::uint32_t row, float stretch) const {
    const PathView<float>&rows = scene_.arrays.sky_rows, &columns = scene_.arrays.sky_columns;
    const std::uint64_t first = std::uint64_t{row} * (size_ + 1) + column;
    const float chosen = (rows.data[row + 1] - rows.data[row]) * (columns.data[first + 1] - columns.data[first]);
    const float half = 0.5f * static_cast<float>(size_);
    return chosen * half * half / stretch;
  }
  HIPRT_HD const Vec3& texel(int i, int j) const {
    const int n = static_cast<int>(size_);
    if (i < 0 || i >= n) {
      i = i < 0 ? -1 - i : 2 * n - 1 - i;
      j = n - 1 - j;
    }
    if (j < 0 || j >= n) {
      j = j < 0 ? -1 - j : 2 * n - 1 - j;
      i = n - 1 - i;
    }
    return scene_.arrays.sky.data[static_cast<std::uint64_t>(j) * size_ + static_cast<std::uint64_t>(i)];
  }

  const PathScene& scene_;
  std::uint32_t size_ = 0;
};

/// Triangles that emit, on both sides.
class TriangleLights {
 public:
  HIPRT_HD explicit TriangleLights(const PathScene& scene) : scene_(scene), arrays_(scene.arrays) {}

  HIPRT_HD bool empty() const { return arrays_.light_instances.size == 0; }

  /// @param choice, u, v in [0, 1).
  HIPRT_HD LightSample sample(const Vec3& from, float time, float choice, float u, float v) const {
    const std::uint32_t light =
        find_step(arrays_.light_sums, 0, static_cast<std::uint32_t>(arrays_.light_sums.size - 1), choice);
    const PathLightInstance& instance = instance_of(light);
    const PathLight& local = arrays_.lights.data[instance.first_local + (light - instance.first_light)];
    const Corners corners(scene_, instance, local, time);
    // Uniform (Osada et al. 2002): the square folded along its diagonal keeps what is stratified more so than a root.
    const bool fold = u + v > 1.0f;
    const float b1 = fold ? 1.0f - u : u, b2 = fold ? 1.0f - v : v;
    const Vec3 to = corners.at(b1, b2) - from;
    const float squared = glm::dot(to, to);
    LightSample result;
    if (!(squared > 0.0f && corners.area > 0.0f)) return result;
    result.distance = std::sqrt(squared);
    result.direction = to / result.distance;
    result.radiance = emission(local, b1, b2);
    result.density = density(light, corners, result.direction, squared);
    return result;
  }

  /// Of sample() for a ray that has hit one. @param surface of the hit. @param squared distance.
  template <unsigned kLevels>
  HIPRT_HD float density(const PathSurface& surface, const InstancePath<kLevels>& path, const Ray& ray, float t) const {
    if (empty() || surface.triangle == kNoTriangle) return 0.0f;
    const std::uint32_t number = arrays_.triangle_light.data[surface.triangle];
    const PathLightInstance* instance = number == kInvalidId ? nullptr : find_instance(path);
    if (instance == nullptr) return 0.0f;
    const Corners corners(scene_, *instance, arrays_.lights.data[instance->first_local + number], ray.time);
    const Vec3 offset = ray.direction * t;
    return density(instance->first_light + number, corners, ray.direction, glm::dot(offset, offset));
  }

 private:
  /// In the scene, at a time.
  struct Corners {
    Vec3 first, edge1, edge2, normal;
    float area;

    HIPRT_HD Corners(const PathScene& scene, const PathLightInstance& instance, const PathLight& light, float time) {
      InstancePath<kTraceLevels> path;
      path.depth = instance.depth;
      for (std::uint32_t i = 0; i < instance.depth; ++i)
        path.instance[i] = scene.arrays.light_paths.data[instance.path_begin + i];
      Vec3 corner[3] = {light.corner[0], light.corner[1], light.corner[2]};
      if (instance.depth != 0) {
        const InstanceTransform where(scene.view, path, time);
        for (Vec3& c : corner) c = where.point_to_scene(c);
      }
      first = corner[0];
      edge1 = corner[1] - first;
      edge2 = corner[2] - first;
      const Vec3 product = glm::cross(edge1, edge2);
      normal = unit_or_zero(product);
      area = 0.5f * std::sqrt(glm::dot(product, product));
    }
    HIPRT_HD Vec3 at(float u, float v) const { return first + edge1 * u + edge2 * v; }
  };

  HIPRT_HD const PathLightInstance& instance_of(std::uint32_t light) const {
    auto low = std::uint32_t{0}, high = static_cast<std::uint32_t>(arrays_.light_instances.size);
    while (high - low > 1) {
      const std::uint32_t middle = low + (high - low) / 2;
      (arrays_.light_instances.data[middle].first_light <= light ? low : high) = middle;
    }
    return arrays_.light_instances.data[low];
  }

  /// Compares the path of a light's instance with @p path: -1, 0 or 1.
  template <unsigned kLevels>
  HIPRT_HD int compare(const PathLightInstance& instance, const InstancePath<kLevels>& path) const {
    if constexpr (kLevels != 0) {
      for (std::uint32_t i = 0; i < instance.depth && i < path.depth; ++i) {
        const std::uint32_t here = arrays_.light_paths.data[instance.path_begin + i];
        if (here != path.instance[i]) return here < path.instance[i] ? -1 : 1;
      }
    }
    return instance.depth == path.depth ? 0 : instance.depth < path.depth ? -1 : 1;
  }
  template <unsigned kLevels> HIPRT_HD const PathLightInstance* find_instance(const InstancePath<kLevels>& path) const {
    auto low = std::uint32_t{0}, high = static_cast<std::uint32_t>(arrays_.light_instances.size);
    while (low < high) {
      const std::uint32_t middle = low + (high - low) / 2;
      const int order = compare(arrays_.light_instances.data[middle], path);
      if (order == 0) return &arrays_.light_instances.data[middle];
      if (order < 0)
        low = middle + 1;
      else
        high = middle;
    }
    return nullptr;
  }

  HIPRT_HD float density(std::uint32_t light, const Corners& corners, const Vec3& direction, float squared) const {
    const float chosen = arrays_.light_sums.data[light + 1] - arrays_.light_sums.data[light];
    const float cosine = absolute(glm::dot(corners.normal, direction));
    return cosine > 0.0f && corners.area > 0.0f ? chosen * squared / (corners.area * cosine) : 0.0f;
  }

  HIPRT_HD Vec3 emission(const PathLight& light, float u, float v) const {
    const PathGeometry& geometry = arrays_.geometries.data[light.geometry];
    PathTriangle triangle(geometry, geometry.first_triangle + light.primitive);
    const PathMaterial& material = arrays_.materials.data[arrays_.triangle_material.data[triangle.triangle]];
    Vec3 result = material.emission;
    if (has_texture(material.emission_texture)) {
      const TexturePoint t =
          hiprt::tools::sample(scene_, material.emission_texture, triangle.coordinates(scene_, u, v), true);
      result *= Vec3(t.channel[0], t.channel[1], t.channel[2]);
    }
    return result;
  }

  const PathScene& scene_;
  const PathArrays<PathView>& arrays_;
};

/// The sky and the triangles together: half of the samples each, if there are both.
class Lights {
 public:
  HIPRT_HD explicit Lights(const PathScene& scene) : sky_(scene), triangles_(scene) {
    sky_part_ = sky_.empty() ? 0.0f : triangles_.empty() ? 1.0f : 0.5f;
  }

  HIPRT_HD bool empty() const { return sky_.empty() && triangles_.empty(); }
  HIPRT_HD const Sky& sky() const { return sky_; }

  HIPRT_HD LightSample sample(const Vec3& from, float time, float choice, float u, float v) const {
    const bool sky = choice < sky_part_;
    LightSample result = sky ? sky_.sample(u, v)
                             : triangles_.sample(from, time, rescaled((choice - sky_part_) / (1.0f - sky_part_)), u, v);
    result.density *= sky ? sky_part_ : 1.0f - sky_part_;
    return result;
  }
  /// Of sample(), for a direction to the sky.
  HIPRT_HD float sky_density(const Vec3& direction) const { return sky_part_ * sky_.density(direction); }
  /// And for a ray that hits a triangle.
  template <unsigned kLevels>
  HIPRT_HD float density(const PathSurface& surface, const InstancePath<kLevels>& path, const Ray& ray, float t) const {
    return (1.0f - sky_part_) * triangles_.density(surface, path, ray, t);
  }

 private:
  HIPRT_HD static float rescaled(float x) {
    constexpr float kBelowOne = 0x1.fffffep-1f;
    return x < kBelowOne ? x : kBelowOne;
  }

  Sky sky_;
  TriangleLights triangles_;
  float sky_part_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
