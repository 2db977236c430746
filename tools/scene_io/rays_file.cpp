#include <tools/scene_io/rays_file.h>

#include <tools/base/memory_limit.h>
#include <tools/base/read_input.h>

#include <hiprt_build/file.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <new>
#include <string>

namespace hiprt::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian and copied as they are");

struct PathsHeader {
  std::uint32_t count, levels;
};
using RayRecord = std::array<float, 8>;
static_assert(sizeof(RayRecord) == kRayBytes);

tl::unexpected<build::Error> invalid(const std::filesystem::path& path, const std::string& what) {
  return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput, path.string() + ": " + what});
}

Ray decode(const RayRecord& r) {
  Ray ray;
  ray.origin = {r[0], r[1], r[2]};
  ray.tmin = r[3];
  ray.direction = {r[4], r[5], r[6]};
  ray.tmax = r[7];
  return ray;
}

RayRecord encode(const Ray& ray) {
  return {ray.origin.x,    ray.origin.y,    ray.origin.z,    ray.tmin,
          ray.direction.x, ray.direction.y, ray.direction.z, ray.tmax};
}

}  // namespace

build::Result<std::uint64_t> check_rays_header(const std::filesystem::path& path, const RaysHeader& header,
                                               std::uint64_t size) {
  if (size < sizeof(header))
    return invalid(path, std::to_string(size) + " bytes are too few for a ray file's header of 8");
  const std::uint64_t expected = sizeof(header) + std::uint64_t{header.count} * kRayBytes;
  const bool larger = header.count == ~std::uint32_t{0} && size > expected && (size - expected) % kRayBytes == 0;
  if (size != expected && !larger)
    return invalid(path, "the header says " + std::to_string(header.count) + " rays, which takes " +
                             std::to_string(expected) + " bytes, but the file has " + std::to_string(size));
  if (header.any_hit > 1)
    return invalid(path, "the any-hit flag at byte 4 is " + std::to_string(header.any_hit) + ", not 0 or 1");
  return (size - sizeof(header)) / kRayBytes;
}

void decode_rays(std::span<const std::byte> bytes, std::span<Ray> rays) {
  for (std::size_t i = 0; i < rays.size(); ++i) {
    RayRecord record;
    std::memcpy(&record, bytes.data() + i * sizeof(record), sizeof(record));
    rays[i] = decode(record);
  }
}

build::Result<RayBatch> read_rays(const std::filesystem::path& path) try {
  const auto file = read_input(path);
  if (!file) return tl::unexpected(file.error());
  const auto bytes = file->bytes();
  RaysHeader header{};
  std::memcpy(&header, bytes.data(), std::min(bytes.size(), sizeof(header)));
  const auto count = check_rays_header(path, header, bytes.size());
  if (!count) return tl::unexpected(count.error());
  RayBatch batch{header.any_hit == 1, std::vector<Ray>(static_cast<std::size_t>(*count))};
  decode_rays(bytes.subspan(sizeof(header)), batch.rays);
  return batch;
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to read it", failure));
}

build::Result<std::vector<HitRecord>> read_hits(const std::filesystem::path& path) try {
  const auto file = read_input(path);
  if (!file) return tl::unexpected(file.error());
  const auto bytes = file->bytes();
  if (bytes.size() % sizeof(HitRecord) != 0)
    return invalid(path, std::to_string(bytes.size()) + " bytes are no whole number of 8-byte hits");
  std::vector<HitRecord> hits(bytes.size() / sizeof(HitRecord));
  std::ranges::copy(bytes, std::as_writable_bytes(std::span{hits}).begin());
  return hits;
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to read it", failure));
}

build::Result<RayPaths> read_paths(const std::filesystem::path& path) try {
  const auto file = read_input(path);
  if (!file) return tl::unexpected(file.error());
  const auto bytes = file->bytes();
  PathsHeader header{};
  if (bytes.size() < sizeof(header))
    return invalid(path, std::to_string(bytes.size()) + " bytes are too few for a path file's header of 8");
  std::memcpy(&header, bytes.data(), sizeof(header));
  const std::uint64_t records = std::uint64_t{header.count} * header.levels;
  const std::uint64_t found = (bytes.size() - sizeof(header)) / sizeof(PathRecord);
  const bool larger =
      header.count == ~std::uint32_t{0} && header.levels != 0 && found > records && found % header.levels == 0;
  if ((records != found && !larger) || bytes.size() % sizeof(PathRecord) != 0)
    return invalid(path, "the header says " + std::to_string(header.count) + " rays of " +
                             std::to_string(header.levels) + " levels, 8 bytes for each, but the file has " +
                             std::to_string(bytes.size() - sizeof(header)) + " bytes of them");
  RayPaths result{header.levels, std::vector<PathRecord>(static_cast<std::size_t>(found))};
  std::ranges::copy(bytes.subspan(sizeof(header)), std::as_writable_bytes(std::span{result.paths}).begin());
  return result;
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to read it", failure));
}

build::Result<void> write_rays(const std::filesystem::path& path, bool any_hit, std::span<const Ray> rays) try {
  if (rays.size() > 0xffffffffu)
    return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, path.string() + ": " + std::to_string(rays.size()) +
                                                                        " rays, a ray file holds at most 4294967295"});
  const RaysHeader header{static_cast<std::uint32_t>(rays.size()), any_hit ? 1u : 0u};
  std::vector<std::byte> bytes(sizeof(header) + rays.size() * sizeof(RayRecord));
  std::memcpy(bytes.data(), &header, sizeof(header));
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const RayRecord record = encode(rays[i]);
    std::memcpy(bytes.data() + sizeof(header) + i * sizeof(record), &record, sizeof(record));
  }
  return build::write_file(path, bytes);
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to write the rays", failure));
}

build::Result<void> write_hits(const std::filesystem::path& path, std::span<const HitRecord> hits) {
  return build::write_file(path, std::as_bytes(hits));
}

build::Result<void> write_paths(const std::filesystem::path& path, std::uint32_t count, std::uint32_t levels,
                                std::span<const PathRecord> paths) try {
  const PathsHeader header{count, levels};
  std::vector<std::byte> bytes(sizeof(header) + paths.size_bytes());
  std::memcpy(bytes.data(), &header, sizeof(header));
  std::ranges::copy(std::as_bytes(paths), bytes.begin() + sizeof(header));
  return build::write_file(path, bytes);
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to write the results", failure));
}

}  // namespace hiprt::tools
