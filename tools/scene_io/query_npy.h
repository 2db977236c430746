#pragma once
/// Points, spheres and boxes of .npy files, and results as .npy files.
///
///     points, spheres, boxes   float32 or float64, shape (n, 3), (n, 4) or (n, 6), either byte order, either index
///                              order
///     results                  shape (n,), or (n, K) of the K nearest
///     lists                    shape (records,); the first field is the number of the query
///     paths                    shape (records, levels), fields instance and id
///
/// Fields of points are distance, point, u, v, primitive and feature (PointRecord). Other results are one number, which
/// in a list is the field primitive.

#include <tools/scene_io/query_file.h>

namespace hiprt::tools {

/// @param bytes of the file. @return kInvalidInput for another type or shape, with both. float64 becomes the nearest
/// float32. Boxes are rounded outwards, so that nothing is missed.
build::Result<QueryBatch> decode_npy_queries(const std::filesystem::path& path, std::span<const std::byte> bytes,
                                             QueryShape shape);

/// What the records of results are.
enum class NpyRecord { kPoint, kNumber };

/// As write_results().
/// @param shape {queries} or {queries, records of each}.
build::Result<void> write_npy_results(const std::filesystem::path& path, NpyRecord record,
                                      std::span<const std::uint64_t> shape, std::span<const std::byte> records);
/// As write_lists().
build::Result<void> write_npy_lists(const std::filesystem::path& path, NpyRecord record,
                                    std::span<const std::uint64_t> first, std::span<const std::byte> records);
/// @param records pairs {instance, id}: @p levels for each of @p count.
build::Result<void> write_npy_paths(const std::filesystem::path& path, std::uint64_t count, std::uint32_t levels,
                                    std::span<const std::byte> records);

}  // namespace hiprt::tools
