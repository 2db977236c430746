#pragma once
/// Files of rays and hits, raw and little-endian.
///
///     .rays   u32 count, u32 any-hit flag (0 closest, 1 any), count x 8 float32 {origin, tmin, direction, tmax}
///     .hits   count x {float32 t (+inf: a miss), u32 primitive (0xffffffff: a miss)}
///     .paths  u32 count, u32 levels, count x levels x {u32 instance, u32 id} (0xffffffff both: end, or a miss)
///
/// A primitive's number runs over all geometries of a file in order. In a scene of instances, it runs over the
/// geometries of the object at the end of the path. A path lists the instances from the scene to the object, the
/// outermost first. `instance` is the number in the file that contains it, `id` the program's own number
/// (InstanceRecord::id).

#include <hiprt_build/error.h>
#include <hiprt_device/ray.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace hiprt::tools {

struct RayBatch {
  bool any_hit = false;  ///< The query that the rays are meant for.
  std::vector<Ray> rays;
};

/// The header of a ray file.
struct RaysHeader {
  std::uint32_t count;    ///< 0xffffffff: that many, or more, as the size of the file tells.
  std::uint32_t any_hit;  ///< 0 or 1.
};
/// Bytes of a ray in a file.
inline constexpr std::size_t kRayBytes = 32;

/// @param size of the file in bytes. @return the number of rays, or kInvalidInput with what does not fit.
build::Result<std::uint64_t> check_rays_header(const std::filesystem::path& path, const RaysHeader& header,
                                               std::uint64_t size);
/// @param bytes kRayBytes for each ray.
void decode_rays(std::span<const std::byte> bytes, std::span<Ray> rays);

struct HitRecord {
  float t;
  std::uint32_t primitive;
};
static_assert(sizeof(HitRecord) == 8);

struct PathRecord {
  std::uint32_t instance, id;
};
static_assert(sizeof(PathRecord) == 8);

struct RayPaths {
  std::uint32_t levels = 0;
  std::vector<PathRecord> paths;  ///< levels per ray.
};

/// @return kIo if the file cannot be read, kInvalidInput if its size does not fit its count or its flag is not 0 or 1.
/// The values of rays are not checked: a ray that is not finite has no hit.
build::Result<RayBatch> read_rays(const std::filesystem::path& path);
build::Result<std::vector<HitRecord>> read_hits(const std::filesystem::path& path);
build::Result<RayPaths> read_paths(const std::filesystem::path& path);

/// Writes the whole file, or keeps the old one (build::write_file). Ray masks are not stored.
build::Result<void> write_rays(const std::filesystem::path& path, bool any_hit, std::span<const Ray> rays);
build::Result<void> write_hits(const std::filesystem::path& path, std::span<const HitRecord> hits);
/// @param count number of rays. @p paths has `levels` records for each.
build::Result<void> write_paths(const std::filesystem::path& path, std::uint32_t count, std::uint32_t levels,
                                std::span<const PathRecord> paths);

}  // namespace hiprt::tools
