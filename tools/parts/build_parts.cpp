#include <tools/parts/build_parts.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/parts/part_boxes.h>
#include <tools/parts/part_data.h>
#include <tools/parts/part_selection.h>
#include <tools/parts/scene_pieces.h>
#include <tools/parts/split_scene.h>

#include <hiprt_build/file.h>
#include <hiprt_build/format/view.h>

#include <algorithm>
#include <filesystem>
#include <utility>

namespace hiprt::tools {
namespace {

class PartsBuilder {
 public:
  PartsBuilder(const SceneDescription& scene, std::span<const build::Buffer> files, const SceneSurfaces* surfaces,
               const PartsOptions& options, const BuildRequest& request, const ProgressSink& progress)
      : scene_(scene), files_(files), surfaces_(surfaces), options_(options), request_(request), progress_(progress) {}

  build::Result<PartManifest> run() {
    const SceneMap map(scene_, files_, surfaces_);
    const ScenePieces pieces(scene_, map, options_.parts);
    if (pieces.own.size() < options_.parts)
      return invalid_input(scene_.path + ": " + std::to_string(options_.parts) + " parts need as many instances, and " +
                           std::to_string(pieces.own.size()) + " can be distributed: those without light");
    manifest_.path = options_.output;
    manifest_.instances = pieces.own.size() + pieces.shared.size();
    manifest_.materials = surfaces_ != nullptr;
    const auto parts = split_scene(map.split_input(pieces.own), options_.parts);
    const std::size_t all = parts.size() + (pieces.shared.empty() ? 0 : 1);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      std::vector<ScenePiece> selected;
      for (const std::uint32_t k : parts[i]) selected.push_back(pieces.own[k]);
      auto part = build_one(map, selected, std::to_string(i), i, all);
      if (!part) return tl::unexpected(std::move(part.error()));
      manifest_.parts.push_back(std::move(*part));
    }
    if (!pieces.shared.empty()) {
      auto part = build_one(map, pieces.shared, "shared", parts.size(), all);
      if (!part) return tl::unexpected(std::move(part.error()));
      manifest_.shared = std::move(*part);
    }
    const std::string text = to_json(manifest_);
    if (auto written = build::write_file(options_.output, std::as_bytes(std::span(text))); !written)
      return tl::unexpected(std::move(written.error()));
    return std::move(manifest_);
  }

 private:
  build::Result<ScenePart> build_one(const SceneMap& map, std::span<const ScenePiece> pieces, const std::string& word,
                                     std::size_t number, std::size_t all) {
    const SceneSelection selection = select(scene_, map, pieces);
    const auto step = [&](const char*, double done) {
      progress_("parts", (static_cast<double>(number) + done) / static_cast<double>(all));
    };
    const auto bvh = build_selection(scene_, files_, selection, options_.on_gpu, request_, step);
    if (!bvh) return tl::unexpected(bvh.error());
    const auto bytes = std::as_const(bvh->buffer).bytes();
    const auto view = open_buffer(bytes);
    if (!view) return fail(build::ErrorCode::kBackend, "the part that was built: " + to_string(view.error()));
    const FileHeader& header = *view->header;
    const bool empty = header.root == kInvalidRef;
    ScenePart part{{},
                   {},
                   pieces.size(),
                   empty ? Box{} : header.bounds,
                   header.condition,
                   header.reach,
                   boxes_near_root(*view, kMostPartBoxes)};
    manifest_.levels = std::max(manifest_.levels, std::uint32_t{header.levels});
    if (auto written = write(word + ".bvh", bytes, part.bvh); !written) return tl::unexpected(written.error());
    if (auto written = write(word + ".data", encode(data_of(selection)), part.data); !written)
      return tl::unexpected(written.error());
    return part;
  }

  PartData data_of(const SceneSelection& selection) const {
    PartData data;
    for (const SceneSelection::Group& group : selection.groups) {
      const bool all = group.instances.size() == scene_.groups[group.original].instances.size();
      data.groups.push_back(all ? std::vector<std::uint32_t>{} : group.instances);
    }
    if (surfaces_ != nullptr) data.surfaces = select(*surfaces_, selection.files);
    return data;
  }

  build::Result<void> write(const std::string& ending, std::span<const std::byte> bytes, PartFile& file) const {
    const std::filesystem::path path = std::filesystem::path(options_.output).replace_extension(ending);
    file = {path.filename().string(), bytes.size(), to_text(digest_of(bytes))};
    if (interrupted()) return fail(build::ErrorCode::kCancelled, "cancelled");
    return build::write_file(path, bytes);
  }

  const SceneDescription& scene_;
  std::span<const build::Buffer> files_;
  const SceneSurfaces* surfaces_;
  const PartsOptions& options_;
  const BuildRequest& request_;
  const ProgressSink& progress_;
  PartManifest manifest_;
};

}  // namespace

bool is_plain_clay(const SceneSurfaces& surfaces) {
  if (!surfaces.textures.empty() || surfaces.materials.size() > 1) return false;
  // surface_load.cpp makes this material for files without materials.
  for (const Material& material : surfaces.materials)
    if (material.name != "clay" || material.metallic != 0.0f || material.alpha_cutoff != 0.0f) return false;
  return std::all_of(surfaces.objects.begin(), surfaces.objects.end(), [](const auto& object) {
    return std::all_of(object.begin(), object.end(), [](const GeometrySurface& geometry) {
      return geometry.coordinates.empty() && geometry.normals.empty();
    });
  });
}

build::Result<PartManifest> build_parts(const SceneDescription& scene, std::span<const build::Buffer> files,
                                        const SceneSurfaces* surfaces, const PartsOptions& options,
                                        const BuildRequest& request, const ProgressSink& progress) {
  return PartsBuilder(scene, files, surfaces, options, request, progress).run();
}

}  // namespace hiprt::tools
