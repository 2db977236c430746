#include <tools/scene_io/query_file.h>

#include <tools/base/errors.h>
#include <tools/base/memory_limit.h>
#include <tools/base/read_input.h>
#include <tools/scene_io/npy_file.h>
#include <tools/scene_io/query_npy.h>

#include <hiprt_build/file.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <new>
#include <string>

namespace hiprt::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian and copied as they are");

struct Header {
  std::uint32_t count, each;
};

/// A header, numbers and records as one file.
build::Result<void> write_parts(const std::filesystem::path& path, const Header& header,
                                std::span<const std::byte> numbers, std::span<const std::byte> records) try {
  std::vector<std::byte> bytes(sizeof(header) + numbers.size() + records.size());
  std::memcpy(bytes.data(), &header, sizeof(header));
  const auto behind = std::ranges::copy(numbers, bytes.begin() + sizeof(header)).out;
  std::ranges::copy(records, behind);
  return build::write_file(path, bytes);
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to write the results", failure));
}

std::string each_text(std::uint32_t shape) {
  for (const QueryShape known : {QueryShape::kPoint, QueryShape::kSphere, QueryShape::kBox})
    if (shape == static_cast<std::uint32_t>(known)) return plural(known);
  return "no shape that bvhquery knows";
}

}  // namespace

const char* plural(QueryShape shape) {
  return shape == QueryShape::kPoint ? "points" : shape == QueryShape::kSphere ? "spheres" : "boxes";
}

build::Result<QueryBatch> read_queries(const std::filesystem::path& path, QueryShape shape) try {
  const auto file = read_input(path);
  if (!file) return tl::unexpected(file.error());
  const auto bytes = file->bytes();
  if (is_npy(bytes) || is_npy_name(path)) return decode_npy_queries(path, bytes, shape);
  const std::string name = path.string() + ": ", what = plural(shape);
  const auto wanted = static_cast<std::uint32_t>(shape);
  Header header{};
  if (bytes.size() < sizeof(header))
    return invalid_input(name + std::to_string(bytes.size()) + " bytes are too few for the header of 8 of a file of " +
                         what);
  std::memcpy(&header, bytes.data(), sizeof(header));
  if (header.each != wanted)
    return invalid_input(name + "the number at byte 4 is " + std::to_string(header.each) + " (" +
                         each_text(header.each) + "), a file of " + what + " has " + std::to_string(wanted));
  const std::uint64_t floats = std::uint64_t{header.count} * wanted, expected = sizeof(header) + floats * sizeof(float);
  if (bytes.size() != expected)
    return invalid_input(name + "the header says " + std::to_string(header.count) + " " + what + ", which takes " +
                         std::to_string(expected) + " bytes, but the file has " + std::to_string(bytes.size()));
  QueryBatch batch{shape, std::vector<float>(static_cast<std::size_t>(floats))};
  std::ranges::copy(bytes.subspan(sizeof(header)), std::as_writable_bytes(std::span{batch.values}).begin());
  return batch;
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to read it", failure));
}

build::Result<void> write_queries(const std::filesystem::path& path, const QueryBatch& batch) {
  const Header header{static_cast<std::uint32_t>(batch.size()), static_cast<std::uint32_t>(batch.shape)};
  return write_parts(path, header, {}, std::as_bytes(std::span{batch.values}));
}

build::Result<void> write_results(const std::filesystem::path& path, std::uint32_t count, std::uint32_t each,
                                  std::span<const std::byte> records) {
  return write_parts(path, {count, each}, {}, records);
}

build::Result<void> write_lists(const std::filesystem::path& path, std::span<const std::uint64_t> first,
                                std::span<const std::byte> records) {
  return write_parts(path, {static_cast<std::uint32_t>(first.size() - 1), 0}, std::as_bytes(first), records);
}

}  // namespace hiprt::tools
