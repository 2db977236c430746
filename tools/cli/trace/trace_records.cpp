#include <tools/cli/trace/trace_records.h>

#include <tools/render/scene/instance_paths.h>

#include <hiprt_build/format/view.h>

#include <limits>
#include <string>

namespace hiprt::tools {
namespace {

constexpr auto kNothing = [](const InstanceRecord&, const ObjectRecord&, const MotionRecord*) {};

}  // namespace

build::Result<void> check_primitive_counts(const std::filesystem::path& path, const BufferView& view) {
  const auto check = [](const std::string& name, std::uint64_t count) -> build::Result<void> {
    if (count <= kInvalidId) return {};
    return tl::unexpected(build::Error{
        build::ErrorCode::kTooLarge,
        name + ": " + std::to_string(count) + " primitives, a hit file numbers " + std::to_string(kInvalidId)});
  };
  if (auto checked = check(path.string(), view.header->primitive_count); !checked) return checked;
  for (std::size_t i = 0; i < view.objects.size(); ++i) {
    const auto& header = *reinterpret_cast<const FileHeader*>(view.object_file(view.objects[i]).data());
    if (auto checked = check(path.string() + ": object " + std::to_string(i), header.primitive_count); !checked)
      return checked;
  }
  return {};
}

std::uint32_t primitive_number(const SceneView& scene, std::span<const std::uint32_t> path, std::uint32_t geometry,
                               std::uint32_t primitive) {
  const ObjectView object = follow<false>(scene, load_path(path), 0.0f, kNothing);
  return static_cast<std::uint32_t>(object.geometries[geometry].first_primitive + primitive);
}

build::Result<std::vector<HitRecord>> hit_records(const SceneView& scene, std::span<const Hit> hits,
                                                  std::span<const std::uint32_t> paths) {
  std::vector<HitRecord> records(hits.size(), HitRecord{std::numeric_limits<float>::infinity(), kInvalidId});
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Hit& hit = hits[i];
    if (hit.failed())
      return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                         "the scene has features that this tracer was not compiled for"});
    if (!hit.found()) continue;
    const auto path = paths.subspan(i * scene.levels, scene.levels);
    records[i] = {hit.t, primitive_number(scene, path, hit.geometry, hit.primitive)};
  }
  return records;
}

std::vector<PathRecord> path_records(const SceneView& scene, std::span<const std::uint32_t> paths) {
  std::vector<PathRecord> records(paths.size(), PathRecord{kInvalidId, kInvalidId});
  for (std::size_t first = 0; first < paths.size(); first += scene.levels) {
    std::size_t next = first;
    // Where the instances are does not matter here.
    follow<false>(scene, load_path(paths.subspan(first, scene.levels)), 0.0f,
                  [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) {
                    records[next] = {paths[next], record.id};
                    ++next;
                  });
  }
  return records;
}

}  // namespace hiprt::tools
