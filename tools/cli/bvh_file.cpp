#include <tools/cli/bvh_file.h>

#include <tools/base/memory_limit.h>
#include <tools/base/parallel.h>
#include <tools/base/read_input.h>
#include <tools/render/scene/trace_limits.h>

#include <hiprt_build/file.h>
#include <hiprt_build/format/view.h>

#include <utility>

namespace hiprt::tools {

namespace {

/// Whether the file says of all its custom primitives what they are.
bool are_shapes(const BufferView& file) {
  for (std::size_t i = 0; i < file.geometries.size(); ++i)
    if ((file.geometries[i].flags & kGeometryCustom) != 0 &&
        (file.shapes.empty() || file.shapes[i].kind == ShapeKind::kNone))
      return false;
  return true;
}

/// The same of a file or of all objects of a scene.
bool has_shapes_only(const BufferView& view) {
  if (!view.has_instances()) return are_shapes(view);
  for (std::size_t i = 0; i < view.objects.size(); ++i) {
    const BufferView object = *open_buffer(view.object_file(view.objects[i]));
    const bool told = !view.object_shapes.empty() && view.object_shapes[i] != 0;
    if (object.has_instances() || (object.header->features & feature_bit(Feature::kCustom)) == 0) continue;
    if (!told || !are_shapes(object)) return false;
  }
  return true;
}

build::Result<BvhFile> validated(const std::filesystem::path& path, unsigned threads, build::Result<BvhFile> file) {
  if (!file) return file;
  if (const auto valid = validate_on(threads, file->view.bytes); !valid)
    return tl::unexpected(format_error(path, valid.error()));
  return file;
}

}  // namespace

build::Error format_error(const std::filesystem::path& path, const FormatIssue& issue) {
  return {build::ErrorCode::kInvalidInput, path.string() + ": not a valid BVH file: " + to_string(issue)};
}

build::Result<BvhFile> open_bytes(const std::filesystem::path& path, build::Result<build::Buffer> buffer) {
  if (!buffer) return tl::unexpected(buffer.error());
  const auto view = open_buffer(std::as_const(*buffer).bytes());
  if (!view) return tl::unexpected(format_error(path, view.error()));
  return BvhFile{std::move(*buffer), *view};
}

build::Result<BvhFile> open_bvh(const std::filesystem::path& path, std::uint64_t max_memory, unsigned threads) {
  const MemoryLimit reading(max_memory);
  return open_bytes(path, read_input(path, threads));
}

tl::expected<ValidateSummary, FormatIssue> validate_on(unsigned threads, std::span<const std::byte> bytes) {
  return validate(bytes, [&](std::size_t count, const std::function<void(std::size_t)>& body) {
    parallel_each(count, threads, body);
  });
}

build::Result<BvhFile> load_bvh(const std::filesystem::path& path, std::uint64_t max_memory, unsigned threads) {
  return validated(path, threads, open_bvh(path, max_memory, threads));
}

build::Result<BvhFile> map_bvh(const std::filesystem::path& path, unsigned threads) {
  return validated(path, threads, open_bytes(path, build::map_file(path)));
}

build::Result<void> check_triangles_only(const std::filesystem::path& path, const BufferView& view) {
  if ((view.header->features & feature_bit(Feature::kCustom)) == 0) return {};
  return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                     path.string() + ": has custom primitives, spheres or curves: insides and overlaps "
                                                     "are those of triangles only. Use --query closest, nearest or "
                                                     "within, or build a file of the meshes alone"});
}

build::Result<void> check_traceable(const std::filesystem::path& path, const BufferView& view) {
  const FileHeader& header = *view.header;
  if ((header.features & feature_bit(Feature::kCustom)) != 0 && !has_shapes_only(view))
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                       path.string() + ": has custom primitives, which need functors of a program of "
                                                       "yours: the tools trace triangles, spheres and curves only"});
  const auto too_large = [&](std::uint32_t number, const char* what, unsigned limit) {
    return tl::unexpected(
        build::Error{build::ErrorCode::kTooLarge,
                     path.string() + ": " + std::to_string(number) + what + ", the limit is " + std::to_string(limit)});
  };
  if (header.levels > kTraceLevels) return too_large(header.levels, " levels of instances", kTraceLevels);
  if (header.stack_bound > kTraceStack) return too_large(header.stack_bound, " stack entries needed", kTraceStack);
  return {};
}

}  // namespace hiprt::tools
