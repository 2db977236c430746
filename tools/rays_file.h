#pragma once
/// Files of rays and hits, raw and little-endian.
///
///     .rays   u32 count, u32 any-hit flag (0 closest, 1 any), count x 8 float32 {origin, tmin, direction, tmax}
///     .hits   count x {float32 t (+inf: a miss), u32 primitive (0xffffffff: a miss)}
///
/// A primitive's number runs over all geometries of a file in order.

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

struct HitRecord {
  float t;
  std::uint32_t primitive;
};
static_assert(sizeof(HitRecord) == 8);

/// @return kIo if the file cannot be read, kInvalidInput if its size does not fit its count or its flag is not 0 or 1.
/// Rays are not judged: tracing one that is not finite gives a miss.
build::Result<RayBatch> read_rays(const std::filesystem::path& path);
build::Result<std::vector<HitRecord>> read_hits(const std::filesystem::path& path);

/// The old file or the whole new one is there afterwards (build::write_file). Ray masks are not stored.
build::Result<void> write_rays(const std::filesystem::path& path, bool any_hit, std::span<const Ray> rays);
build::Result<void> write_hits(const std::filesystem::path& path, std::span<const HitRecord> hits);

}  // namespace hiprt::tools
