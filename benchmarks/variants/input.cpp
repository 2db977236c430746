#include "input.h"

#include "../common/spawned_rays.h"
#include "cpu_kernels.h"

#include <hiprt_build/exec/threads.h>
#include <hiprt_build/file.h>
#include <hiprt_build/format/validate.h>
#include <tools/render/scene/camera.h>
#include <tools/scene_io/rays_file.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <utility>

namespace hiprt::bench {
namespace {

namespace fs = std::filesystem;
using build::ErrorCode;

tl::unexpected<build::Error> fail(const fs::path& path, const std::string& what) {
  return tl::unexpected<build::Error>(build::Error{ErrorCode::kInvalidInput, path.string() + ": " + what});
}

/// Files of a folder (empty: the current one) with that extension, sorted.
std::vector<fs::path> list_files(const fs::path& folder, const char* extension) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder.empty() ? fs::path(".") : folder, error))
    if (entry.path().extension() == extension) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// The part between the scene's name and the extension.
std::string middle_of(const fs::path& path) {
  const std::string stem = path.stem().string();
  const std::size_t dot = stem.find('.');
  return dot == std::string::npos ? std::string() : stem.substr(dot + 1);
}

build::Result<std::vector<Box>> load_boxes(const fs::path& path) {
  auto file = build::map_file(path);
  if (!file) return tl::unexpected(file.error());
  std::uint32_t count = 0;
  if (file->size() >= sizeof(count)) std::memcpy(&count, file->bytes().data(), sizeof(count));
  if (file->size() != sizeof(count) + sizeof(Box) * std::size_t{count})
    return fail(path, "its size is not that of its boxes");
  std::vector<Box> boxes(count);
  if (count != 0) std::memcpy(boxes.data(), file->bytes().data() + sizeof(count), sizeof(Box) * std::size_t{count});
  return boxes;
}

/// BoxSet ignores the geometry, so a scene may have only one custom geometry.
build::Result<void> check_boxes(const Tree& tree) {
  for (const GeometryRecord& geometry : tree.view.geometries)
    if ((geometry.flags & kGeometryCustom) != 0 &&
        (geometry.primitive_count != tree.boxes.size() || geometry_type(geometry.flags) != 0))
      return fail(tree.path, "a geometry of " + std::to_string(geometry.primitive_count) +
                                 " custom primitives of type " + std::to_string(geometry_type(geometry.flags)) +
                                 ", but " + std::to_string(tree.boxes.size()) + " boxes for type 0");
  return {};
}

build::Result<tools::Camera> choose_camera(const Tree& tree, const fs::path& file, double aspect) {
  if (file.empty()) return tools::automatic_camera(tree.view.header->bounds, aspect);
  std::ifstream stream(file);
  if (!stream) return fail(file, "cannot be read");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const auto camera = tools::parse_camera(text);
  if (!camera) return fail(file, camera.error());
  return *camera;
}

std::vector<Ray> primary_rays(const tools::Camera& camera, const Picture& picture) {
  const tools::CameraRays rays(camera, picture.width, picture.height);
  const bool tiles = picture.order == PixelOrder::kTiles;
  const unsigned wide = tiles ? 8 : picture.width, high = tiles ? 4 : 1;
  std::vector<Ray> result;
  for (unsigned top = 0; top < picture.height; top += high)
    for (unsigned left = 0; left < picture.width; left += wide)
      for (unsigned row = top; row < std::min(top + high, picture.height); ++row)
        for (unsigned column = left; column < std::min(left + wide, picture.width); ++column)
          result.push_back(rays.ray(column + 0.5, row + 0.5));
  return result;
}

void set_times(std::vector<Ray>& rays) {
  for (std::size_t i = 0; i < rays.size(); ++i) rays[i].time = ray_time(static_cast<std::uint32_t>(i));
}

}  // namespace

std::string scene_of(const fs::path& path) {
  const std::string stem = path.filename().string();
  return stem.substr(0, stem.find('.'));
}

build::Result<std::vector<fs::path>> find_trees(const fs::path& folder, const std::vector<std::string>& scenes) {
  std::vector<fs::path> all = list_files(folder, ".bvh");
  if (all.empty()) return fail(folder, "has no .bvh files");
  if (scenes.empty()) return all;
  std::vector<fs::path> chosen;
  for (const std::string& scene : scenes) {
    const std::size_t before = chosen.size();
    std::copy_if(all.begin(), all.end(), std::back_inserter(chosen),
                 [&](const fs::path& path) { return scene_of(path) == scene; });
    if (chosen.size() == before) return fail(folder, "has no " + scene + ".*.bvh");
  }
  return chosen;
}

build::Result<Tree> load_tree(const fs::path& path) {
  auto buffer = build::map_file(path);
  if (!buffer) return tl::unexpected(buffer.error());
  const ParallelLoop side_by_side = [](std::size_t count, const std::function<void(std::size_t)>& body) {
    build::Threads::run(0, [&] { build::Threads::for_each(count, body); });
  };
  if (const auto valid = validate(buffer->bytes(), side_by_side); !valid)
    return fail(path, "not a valid BVH file: " + to_string(valid.error()));
  const auto view = open_buffer(buffer->bytes());
  if (!view) return fail(path, "not a valid BVH file: " + to_string(view.error()));
  Tree tree{scene_of(path), middle_of(path), path, std::move(*buffer), *view, {}};
  if ((tree.view.header->features & feature_bit(Feature::kCustom)) != 0) {
    auto boxes = load_boxes(path.parent_path() / (tree.scene + ".boxes"));
    if (!boxes) return tl::unexpected(boxes.error());
    tree.boxes = std::move(*boxes);
    if (const auto fits = check_boxes(tree); !fits) return tl::unexpected(fits.error());
  }
  return tree;
}

std::vector<fs::path> find_rays(const fs::path& folder, const std::string& scene) {
  std::vector<fs::path> files = list_files(folder, ".rays");
  std::erase_if(files, [&](const fs::path& path) { return scene_of(path) != scene; });
  return files;
}

build::Result<RayBuffer> load_rays(const fs::path& path) {
  auto batch = tools::read_rays(path);
  if (!batch) return tl::unexpected(batch.error());
  set_times(batch->rays);
  return RayBuffer{middle_of(path), batch->any_hit, "in the order of " + path.filename().string(),
                   std::move(batch->rays)};
}

build::Result<std::vector<RayBuffer>> make_rays(const Tree& tree, const fs::path& camera_file, const Picture& picture,
                                                bool only_primary) {
  const auto camera = choose_camera(tree, camera_file, static_cast<double>(picture.width) / picture.height);
  if (!camera) return tl::unexpected(camera.error());
  const std::string order = picture.order == PixelOrder::kTiles ? "generated, pixel by pixel, in tiles of 8 x 4"
                                                                : "generated, pixel by pixel, row by row";
  std::vector<RayBuffer> sets{{"primary", false, order, primary_rays(*camera, picture)}};
  set_times(sets[0].rays);
  if (only_primary) return sets;
  const std::vector<Ray> rays = sets[0].rays;
  std::vector<Hit> hits(rays.size());
  const SceneView scene = make_scene_view(tree.view);
  run_on_cpu({&scene, Query::kClosest, false, scene.levels, tree.boxes.empty() ? nullptr : tree.boxes.data(),
              rays.data(), hits.data(), nullptr, rays.size()});
  const Box& bounds = scene.bounds;
  const auto extent = [&](int axis) { return bounds.max[axis] - bounds.min[axis]; };
  const float diagonal = std::hypot(extent(0), extent(1), extent(2));
  const Vec3 light(bounds.min[0] + 0.5f * extent(0), bounds.min[1] + 0.95f * extent(1),
                   bounds.min[2] + 0.5f * extent(2));
  sets.push_back({"ao", true, order, cosine_rays(rays, hits, 0.1f * diagonal, 1)});
  sets.push_back({"shadow", true, order, rays_to(light, rays, hits)});
  sets.push_back({"diffuse", false, order, cosine_rays(rays, hits, std::numeric_limits<float>::infinity(), 2)});
  for (RayBuffer& set : sets) set_times(set.rays);
  return sets;
}

}  // namespace hiprt::bench
