#pragma once
/// Files of points, spheres and boxes, and of what queries of them found. Raw and little-endian.
///
///     points    u32 count, u32 3, count x 3 float32 {x, y, z}
///     spheres   u32 count, u32 4, count x 4 float32 {x, y, z, radius}
///     boxes     u32 count, u32 6, count x 6 float32 {min, max}
///     results   u32 count, u32 k, count x k records. Unused records have the distance inf and the primitive
///               0xffffffff.
///     lists     u32 count, u32 0, (count + 1) x u64, records. Those of query i begin at record number i of these, and
///               end before number i + 1.
///     .npy      arrays of numpy (query_npy.h)
///
/// Records are PointRecord, or a u32: a primitive (of overlaps), or 1 for inside and 0 for outside. Primitives are
/// numbered as in hit files (rays_file.h).

#include <hiprt_build/error.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace hiprt::tools {

/// What a file of queries has. The values are the numbers of floats per element.
enum class QueryShape : std::uint32_t { kPoint = 3, kSphere = 4, kBox = 6 };

/// "points", "spheres" or "boxes".
const char* plural(QueryShape shape);

struct QueryBatch {
  QueryShape shape;
  std::vector<float> values;

  std::size_t size() const { return values.size() / static_cast<std::size_t>(shape); }
  const float* at(std::size_t i) const { return values.data() + i * static_cast<std::size_t>(shape); }
};

struct PointRecord {
  float distance;  ///< inf: nothing was found. With a sign: negative inside.
  float x, y, z;   ///< The closest point.
  float u, v;      ///< Weights of the triangle's corners 1 and 2.
  std::uint32_t primitive;
  std::uint32_t feature;  ///< TriangleFeature: 0 face, 1 to 3 edges 0 to 2, 4 to 6 vertices 0 to 2.
};
static_assert(sizeof(PointRecord) == 32);

/// @param shape that the file must have.
/// @return kIo if the file cannot be read, kInvalidInput if it has another shape (.npy: or type) or its size does not
/// fit its count. The values are not checked: queries that are not finite find nothing.
build::Result<QueryBatch> read_queries(const std::filesystem::path& path, QueryShape shape);
build::Result<void> write_queries(const std::filesystem::path& path, const QueryBatch& batch);

/// Write the whole file, or keep the old one (build::write_file).
/// @param records @p each of every query, in order.
build::Result<void> write_results(const std::filesystem::path& path, std::uint32_t count, std::uint32_t each,
                                  std::span<const std::byte> records);
/// @param first as many as queries and one more.
build::Result<void> write_lists(const std::filesystem::path& path, std::span<const std::uint64_t> first,
                                std::span<const std::byte> records);

}  // namespace hiprt::tools
