#pragma once
/// The scene of the path tracer's shading: plain arrays in the memory of the processor that shades. This header has no
/// functions, because they would be compiled for several instruction sets under one name.

#include <tools/render/scene/camera.h>
#include <tools/render/scene/shutter.h>
#include <tools/scene_io/surface/texture_wrap.h>

#include <hiprt_device/scene_view.h>

#include <cstdint>

namespace hiprt::tools {

/// Index of a PathGeometry without texture coordinates or normals.
inline constexpr std::uint64_t kNoVertices = ~std::uint64_t{0};
/// Number of the triangle of a hit on a sphere or a curve.
inline constexpr std::uint64_t kNoTriangle = ~std::uint64_t{0};

/// A use of a texture. Texture coordinates (u, v), v down, become matrix * (u, v, 1) first.
struct PathTextureUse {
  std::uint32_t texture;  ///< kInvalidId: no texture.
  TextureWrap wrap_u, wrap_v;
  float matrix[2][3];
};

struct TextureCoordinates {
  float u, v;
};

struct PathCorners {
  std::uint32_t vertex[3];
};

/// A picture of 8 bits per channel; red in a texel's lowest byte, then green, blue, alpha.
struct PathTexture {
  std::uint32_t first_texel, width, height;
};

struct PathMaterial {
  Vec3 base_color;
  float alpha;
  Vec3 emission;
  float alpha_cutoff;
  float metallic, roughness;
  PathTextureUse base_color_texture, metallic_roughness_texture, emission_texture;
};

struct PathGeometry {
  std::uint64_t first_triangle;     ///< In triangles, triangle_material and triangle_light.
  std::uint64_t first_coordinates;  ///< Of vertex 0; kNoVertices: it has none.
  std::uint64_t first_normal;       ///< The same.
  std::uint32_t material;        ///< Of all primitives, which are no triangles; kInvalidId: triangles have their own.
  std::uint32_t times = 0;       ///< Of triangles that move, which have normals at each of these times; else 0.
  std::uint64_t first_time = 0;  ///< In times.
  std::uint64_t vertices = 0;    ///< Normals at each time.
};

/// A triangle of an object that emits, in the object's space.
struct PathLight {
  Vec3 corner[3];
  std::uint32_t geometry;  ///< Index of PathGeometry.
  std::uint32_t primitive;
};

/// An instance of an object with such triangles.
struct PathLightInstance {
  std::uint32_t first_light;  ///< Index in the scene of the first of its lights, which are consecutive.
  std::uint32_t first_local;  ///< The first of its object's in `lights`.
  std::uint32_t path_begin;   ///< Where its path begins in light_paths.
  std::uint32_t depth;        ///< Length of the path.
};

/// The arrays. @tparam Array owner or view of an array of T: Array<T>.
template <template <class> class Array> struct PathArrays {
  // Surfaces. Without objects everything has material 0.
  Array<std::uint32_t> first_geometry;  ///< Per object.
  Array<PathGeometry> geometries;
  Array<PathCorners> triangles;
  Array<std::uint32_t> triangle_material;
  Array<TextureCoordinates> coordinates;
  Array<Vec3> normals;
  Array<float> times;  ///< Of triangles that move; they grow.
  Array<PathMaterial> materials;
  Array<PathTexture> textures;
  Array<std::uint32_t> texels;
  Array<float> linear;  ///< Of the 256 values of sRGB.
  // The sky: a square picture in octahedral projection, and how often its pixels are chosen.
  Array<Vec3> sky;
  Array<float> sky_rows;     ///< Up to each row, of 1.
  Array<float> sky_columns;  ///< In each row, up to each pixel, of 1.
  Array<Vec3> backdrop;      ///< What a row of the picture shows where nothing is; empty: the sky.
  // Triangles that emit.
  Array<PathLight> lights;
  Array<std::uint32_t> triangle_light;  ///< Per triangle: its number among its object's lights. Empty: there are none.
  Array<PathLightInstance> light_instances;  ///< In the order of their paths.
  Array<std::uint32_t> light_paths;          ///< Numbers as InstancePath has them.
  Array<float> light_sums;                   ///< Up to each light of the scene, of 1; one more than there are lights.

  /// apply(of first, of second) for every array.
  template <class First, class Second, class Apply> static void for_each(First& a, Second& b, Apply&& apply) {
    apply(a.first_geometry, b.first_geometry);
    apply(a.geometries, b.geometries);
    apply(a.triangles, b.triangles);
    apply(a.triangle_material, b.triangle_material);
    apply(a.coordinates, b.coordinates);
    apply(a.normals, b.normals);
    apply(a.times, b.times);
    apply(a.materials, b.materials);
    apply(a.textures, b.textures);
    apply(a.texels, b.texels);
    apply(a.linear, b.linear);
    apply(a.sky, b.sky);
    apply(a.sky_rows, b.sky_rows);
    apply(a.sky_columns, b.sky_columns);
    apply(a.backdrop, b.backdrop);
    apply(a.lights, b.lights);
    apply(a.triangle_light, b.triangle_light);
    apply(a.light_instances, b.light_instances);
    apply(a.light_paths, b.light_paths);
    apply(a.light_sums, b.light_sums);
  }
};

/// An array that somebody else owns.
template <class T> struct PathView {
  const T* data = nullptr;
  std::uint64_t size = 0;
};

/// Settings that do not depend on the scene.
struct PathSettings {
  CameraRays camera;
  std::uint32_t width, height;
  Shutter shutter;
  std::uint32_t seed;
  std::uint32_t bounces;  ///< Most bounces of a path; 0: emission only.
};

/// Passed to kernels by value.
struct PathScene {
  SceneView view;
  PathArrays<PathView> arrays;
  PathSettings settings;
};

}  // namespace hiprt::tools
