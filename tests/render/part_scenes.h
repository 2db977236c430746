#pragma once
/// Random scenes of nested instances with materials, as a whole and in parts.

#include "path_scenes.h"

#include <hiprt_build/file.h>
#include <hiprt_build/host/host_part.h>
#include <tests/oracle/meshes.h>
#include <tests/tools/temp_folder.h>
#include <tools/build/build_scene.h>
#include <tools/parts/build_parts.h>
#include <tools/parts/part_data.h>
#include <tools/parts/part_owners.h>
#include <tools/render/parts/part_exchange.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace hiprt::test {

/// What random scenes have.
struct PartSceneOptions {
  unsigned groups = 3;                ///< Besides the scene.
  unsigned instances = 6;             ///< Of each group; the scene has twice as many.
  bool lights = true, cutout = true;  ///< Of these materials.
  bool moving = true;                 ///< Some instances move, and an object deforms.
};

/// A description and the surfaces of its objects: meshes of one geometry each, some of two.
struct PartDescription {
  tools::SceneDescription scene;
  tools::SceneSurfaces surfaces;
};

inline tools::Mesh mesh_of(const oracle::Mesh& from) {
  tools::Mesh mesh;
  mesh.positions = from.positions;
  mesh.triangles = from.triangles;
  return mesh;
}

/// The mesh at time 0, and higher at time 1.
inline tools::ShapeSet rising(const oracle::Mesh& mesh) {
  tools::ShapeSet set;
  set.kind = ShapeKind::kMovingTriangles;
  set.keys = 2;
  for (const float time : {0.0f, 1.0f})
    for (const auto& p : mesh.positions) set.points.push_back({{p[0], p[1] + 0.5f * time * (1.0f + p[0]), p[2]}, time});
  for (const auto& t : mesh.triangles) set.segments.insert(set.segments.end(), t.begin(), t.end());
  return set;
}

/// The same for the same seed. Some instances are there twice at the same place, so that hits tie.
inline PartDescription random_description(std::uint64_t seed, const PartSceneOptions& options) {
  oracle::Random random(seed);
  PartDescription result;
  tools::SceneDescription& scene = result.scene;
  scene.path = "random";
  tools::SceneSurfaces& surfaces = result.surfaces;
  tools::Texture& checks = surfaces.textures.emplace_back();
  checks.width = checks.height = 4;
  for (unsigned i = 0; i < 16; ++i) checks.texels.push_back((i + i / 4) % 2 == 0 ? 0xffc08040u : 0x20ffffffu);
  surfaces.textures.push_back(checks);
  for (unsigned i = 0; i < 5; ++i) {
    tools::Material& material = surfaces.materials.emplace_back();
    material.name = "m" + std::to_string(i);
    material.base_color = {random.uniform_float(0.2, 0.9), random.uniform_float(0.2, 0.9), 0.5f};
    material.metallic = i == 1 ? 1.0f : 0.0f;
    material.roughness = random.uniform_float(0.2, 1.0);
    if (i == 2) material.base_color_texture.texture = 1;
    if (i == 2 && options.cutout) material.alpha_cutoff = 0.5f;
    if (i == 3 && options.lights) material.emission = {3.0f, 2.0f, 1.0f};
  }
  const oracle::Mesh square = floor_square(0.5f);
  const std::vector<oracle::Mesh> meshes{oracle::icosphere(1), square, floor_square(0.3f), oracle::icosphere(0),
                                         square};
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    tools::SceneObject& object = scene.objects.emplace_back();
    object.name = "object " + std::to_string(i);
    tools::GeometrySurface surface = surface_of(meshes[i], i % 5);
    if (options.moving && i == 2) {
      object.shapes.push_back(scene.shapes.size());
      scene.shapes.push_back(rising(oracle::placed(meshes[i], 0.8)));
      surface.times = {0, 1};
      surface.normals.assign(meshes[i].positions.size(), {0, 1, 0});
      surface.normals.resize(2 * meshes[i].positions.size(), {-0.6f, 0.8f, 0});
    } else {
      object.meshes.push_back(scene.meshes.size());
      scene.meshes.push_back(mesh_of(oracle::placed(meshes[i], 0.8)));
    }
    for (const auto& p : meshes[i].positions) {
      surface.coordinates.push_back({p[0] + p[1], p[2]});
      if (i == 0) surface.normals.push_back(p);
    }
    surfaces.objects.push_back({surface});
  }
  const auto object_count = static_cast<std::uint32_t>(meshes.size());
  for (unsigned g = 0; g <= options.groups; ++g) {
    tools::SceneGroup& group = scene.groups.emplace_back();
    group.location = "groups.g" + std::to_string(g);
    const bool last = g == options.groups;
    for (unsigned i = 0; i < options.instances * (last ? 2 : 1); ++i) {
      build::Instance instance;
      instance.object = random.below(object_count + g);
      if (last && g != 0 && i < 2) instance.object = object_count + g - 1;
      const double extent = last ? 3.0 : 1.5, turn = random.uniform(0.0, 6.0);
      const auto c = static_cast<float>(std::cos(turn)), s = static_cast<float>(std::sin(turn));
      const auto size = random.uniform_float(0.5, 1.3);
      const auto at = random.in_cube(extent);
      instance.to_scene = {
          {{c * size, 0.1f, s * size, at[0]}, {0, size, 0.2f, at[1]}, {-s * size, 0, c * size, at[2]}}};
      if (options.moving && random.below(4) == 0) {
        auto motion = std::make_unique<build::Motion>();
        motion->keys = {{.time = 0, .translation = {at[0], at[1], at[2]}},
                        {.time = 1, .translation = {at[0] + 0.5f, at[1], at[2] - 0.3f}, .rotation = {0, 0.3f, 0, 1}}};
        instance.motion = motion.get();
        scene.motions.push_back(std::move(motion));
      }
      group.instances.push_back(instance);
      if (random.below(3) == 0) group.instances.push_back(instance);
    }
  }
  return result;
}

/// A scene as one file.
class WholeScene {
 public:
  /// @param surfaces false: clay.
  WholeScene(std::uint64_t seed, const PartSceneOptions& options, bool surfaces, const tools::PathSettings& settings) {
    PartDescription description = random_description(seed, options);
    auto built = tools::build_scene(description.scene, {}, [](const char*, double) {});
    INFO((built ? std::string() : built.error().message));
    REQUIRE(built.has_value());
    file_ = std::move(built->file);
    view_ = *open_buffer(std::as_const(file_).bytes());
    description.surfaces.objects.resize(view_.objects.size());
    auto data =
        tools::make_path_data(view_, surfaces ? &description.surfaces : nullptr,
                              tools::make_sky([](const Vec3& d) { return Vec3(0.2f + 0.2f * d.y); }, 16), {}, 0.5f);
    REQUIRE(data.has_value());
    data_ = std::move(*data);
    scene_.emplace(tools::PathScene{host_.scene(view_), tools::views(data_), settings});
  }
  WholeScene(const WholeScene&) = delete;
  WholeScene& operator=(const WholeScene&) = delete;

  const tools::PathScene& scene() const { return *scene_; }
  const tools::PathData& data() const { return data_; }
  const BufferView& view() const { return view_; }

 private:
  build::Buffer file_;
  BufferView view_{};
  HostPart host_;
  tools::PathData data_;
  std::optional<tools::PathScene> scene_;
};

/// The same scene in parts, in files of a folder.
class PartedScene {
 public:
  PartedScene(std::uint64_t seed, const PartSceneOptions& options, bool surfaces, std::size_t parts) {
    PartDescription description = random_description(seed, options);
    tools::BuiltScene built;
    const auto files = tools::build_objects(
        description.scene, {}, [](const char*, double) {}, built);
    REQUIRE(files.has_value());
    auto manifest = tools::build_parts(description.scene, *files, surfaces ? &description.surfaces : nullptr,
                                       {parts, folder_ / "p.json"}, {}, [](const char*, double) {});
    INFO((manifest ? std::string() : manifest.error().message));
    REQUIRE(manifest.has_value());
    // As readers get it.
    auto read = tools::parse_part_manifest(tools::to_json(*manifest), folder_ / "p.json");
    INFO((read ? std::string() : read.error().message));
    REQUIRE(read.has_value());
    manifest_ = std::move(*read);
  }

  const tools::PartManifest& manifest() const { return manifest_; }
  const TempFolder& folder() const { return folder_; }

  struct Files {
    build::Buffer bvh;
    tools::PartData data;
  };
  Files load(const tools::ScenePart& part) const {
    auto bvh = build::read_file(manifest_.path_of(part.bvh));
    REQUIRE(bvh.has_value());
    const auto bytes = build::read_file(manifest_.path_of(part.data));
    REQUIRE(bytes.has_value());
    auto data = tools::decode_part_data(bytes->bytes(), *open_buffer(std::as_const(*bvh).bytes()));
    INFO((data ? std::string() : data.error().message));
    REQUIRE(data.has_value());
    return {std::move(*bvh), std::move(*data)};
  }

 private:
  TempFolder folder_;
  tools::PartManifest manifest_;
};

/// A process of a run: the parts that it has, and the shared one.
class PartProcess {
 public:
  /// @param mail nullptr: it has all parts.
  PartProcess(const PartedScene& parts, const tools::PathSettings& settings, tools::RayMail* mail, std::size_t credit) {
    tools::PartExchange::Setup setup;
    setup.manifest = &parts.manifest();
    setup.owner = tools::owners_of(parts.manifest().parts, mail == nullptr ? 1 : mail->ranks());
    setup.mail = mail;
    setup.credit = credit;
    for (std::size_t i = 0; i < setup.owner.size(); ++i) {
      auto& tracer = setup.tracers.emplace_back();
      if (mail != nullptr && setup.owner[i] != mail->rank()) continue;
      auto files = parts.load(parts.manifest().parts[i]);
      auto made =
          tools::PartTracer::make(std::move(files.bvh), std::move(files.data), parts.manifest().levels, settings);
      INFO((made ? std::string() : made.error().message));
      REQUIRE(made.has_value());
      tracer = std::move(*made);
    }
    std::optional<PartedScene::Files> shared;
    SceneView scene;
    if (parts.manifest().shared) {
      shared = parts.load(*parts.manifest().shared);
      shared_file_ = std::move(shared->bvh);
      view_ = *open_buffer(std::as_const(shared_file_).bytes());
      scene = host_.scene(view_);
      setup.shared_numbers = tools::PathNumbers(view_, std::move(shared->data.groups));
    }
    auto data =
        tools::make_path_data(view_, shared && shared->data.surfaces ? &*shared->data.surfaces : nullptr,
                              tools::make_sky([](const Vec3& d) { return Vec3(0.2f + 0.2f * d.y); }, 16), {}, 0.5f);
    REQUIRE(data.has_value());
    data_ = std::move(*data);
    scene_.emplace(tools::PathScene{scene, tools::views(data_), settings});
    setup.shared = &*scene_;
    setup.shared_alpha_cutout = tools::has_alpha_cutout(data_);
    exchange_ = std::make_unique<tools::PartExchange>(std::move(setup));
  }

  const tools::PathScene& scene() const { return *scene_; }
  tools::PartExchange& exchange() { return *exchange_; }

 private:
  build::Buffer shared_file_;
  BufferView view_{};
  HostPart host_;
  tools::PathData data_;
  std::optional<tools::PathScene> scene_;
  std::unique_ptr<tools::PartExchange> exchange_;
};

}  // namespace hiprt::test
