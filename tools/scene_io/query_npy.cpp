#include <tools/scene_io/query_npy.h>

#include <tools/base/errors.h>
#include <tools/base/memory_limit.h>
#include <tools/scene_io/npy_file.h>

#include <hiprt_build/file.h>
#include <hiprt_device/math/affine.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <new>
#include <string>

namespace hiprt::tools {
namespace {

constexpr std::string_view kPointFields =
    "('distance', '<f4'), ('point', '<f4', (3,)), ('u', '<f4'), ('v', '<f4'), ('primitive', '<u4'), ('feature', '<u4')";

template <class Value> Value value_at(const std::byte* at, bool big_endian) {
  std::array<std::byte, sizeof(Value)> bytes;
  std::memcpy(bytes.data(), at, bytes.size());
  if (big_endian) std::ranges::reverse(bytes);
  return std::bit_cast<Value>(bytes);
}

float to_float(float value, bool, bool) { return value; }
/// @param is_low, is_high whether it is a box's lower or upper end.
float to_float(double value, bool is_low, bool is_high) {
  return is_low    ? affine_detail::round_down(value)
         : is_high ? affine_detail::round_up(value)
                   : static_cast<float>(value);
}

template <class Value>
void decode(const std::byte* values, const NpyHeader& header, QueryShape shape, std::vector<float>& result) {
  const std::size_t rows = header.shape[0], columns = header.shape[1];
  const bool big_endian = header.type[0] == '>', is_box = shape == QueryShape::kBox;
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t column = 0; column < columns; ++column) {
      const std::size_t i = header.fortran_order ? column * rows + row : row * columns + column;
      const auto value = value_at<Value>(values + i * sizeof(Value), big_endian);
      result[row * columns + column] = to_float(value, is_box && column < 3, is_box && column >= 3);
    }
}

/// @return what is wrong with an array of queries, or nothing.
std::string fault_of(const NpyHeader& header, QueryShape shape, std::size_t bytes) {
  const std::string what = plural(shape), width = std::to_string(static_cast<unsigned>(shape));
  if (header.is_structured)
    return "a structured array, expected plain float32 or float64 (numpy: structured_to_unstructured())";
  const std::string_view type = header.type;
  if (type.size() != 3 || (type[0] != '<' && type[0] != '>') ||
      (type != "<f4" && type != ">f4" && type.substr(1) != "f8"))
    return "values of type '" + header.type +
           "', expected float32 or float64 ('<f4', '<f8', '>f4' or '>f8'; numpy: array.astype('float32'))";
  if (header.shape.size() != 2 || header.shape[1] != static_cast<std::uint64_t>(shape))
    return "shape " + shape_text(header.shape) + ", a file of " + what + " has (n, " + width + ")";
  if (header.shape[0] > 0xffffffffu)
    return std::to_string(header.shape[0]) + " " + what + ", at most 4294967295 are possible";
  const std::uint64_t size = type[2] == '4' ? 4 : 8, expected = header.shape[0] * header.shape[1] * size;
  if (bytes != expected)
    return "shape " + shape_text(header.shape) + " of '" + header.type + "' takes " + std::to_string(expected) +
           " bytes behind the header, but the file has " + std::to_string(bytes);
  return {};
}

build::Result<void> write_array(const std::filesystem::path& path, std::string_view type,
                                std::span<const std::uint64_t> shape, std::span<const std::byte> values) {
  const std::string header = npy_header(type, shape);
  std::vector<std::byte> bytes(header.size() + values.size());
  std::memcpy(bytes.data(), header.data(), header.size());
  std::ranges::copy(values, bytes.begin() + static_cast<std::ptrdiff_t>(header.size()));
  return build::write_file(path, bytes);
}

}  // namespace

build::Result<QueryBatch> decode_npy_queries(const std::filesystem::path& path, std::span<const std::byte> bytes,
                                             QueryShape shape) {
  const auto header = read_npy_header(path, bytes);
  if (!header) return tl::unexpected(header.error());
  const std::span<const std::byte> values = bytes.subspan(header->values);
  if (const std::string fault = fault_of(*header, shape, values.size()); !fault.empty())
    return invalid_input(path.string() + ": " + fault);
  QueryBatch batch{shape, std::vector<float>(header->shape[0] * header->shape[1])};
  if (header->type[2] == '4')
    decode<float>(values.data(), *header, shape, batch.values);
  else
    decode<double>(values.data(), *header, shape, batch.values);
  return batch;
}

build::Result<void> write_npy_results(const std::filesystem::path& path, NpyRecord record,
                                      std::span<const std::uint64_t> shape, std::span<const std::byte> records) try {
  const std::string type = record == NpyRecord::kPoint ? "[" + std::string(kPointFields) + "]" : "'<u4'";
  return write_array(path, type, shape, records);
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to write the results", failure));
}

build::Result<void> write_npy_lists(const std::filesystem::path& path, NpyRecord record,
                                    std::span<const std::uint64_t> first, std::span<const std::byte> records) try {
  const std::size_t size = record == NpyRecord::kPoint ? sizeof(PointRecord) : sizeof(std::uint32_t);
  const std::string fields = record == NpyRecord::kPoint ? std::string(kPointFields) : "('primitive', '<u4')";
  std::vector<std::byte> rows(records.size() / size * (size + sizeof(std::uint32_t)));
  std::byte* to = rows.data();
  for (std::uint32_t query = 0; query + 1 < first.size(); ++query)
    for (std::uint64_t i = first[query]; i < first[query + 1]; ++i) {
      std::memcpy(to, &query, sizeof(query));
      std::memcpy(to + sizeof(query), records.data() + i * size, size);
      to += sizeof(query) + size;
    }
  const std::array<std::uint64_t, 1> shape{records.size() / size};
  return write_array(path, "[('query', '<u4'), " + fields + "]", shape, rows);
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to write the results", failure));
}

build::Result<void> write_npy_paths(const std::filesystem::path& path, std::uint64_t count, std::uint32_t levels,
                                    std::span<const std::byte> records) try {
  const std::array<std::uint64_t, 2> shape{count, levels};
  return write_array(path, "[('instance', '<u4'), ('id', '<u4')]", shape, records);
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to write the results", failure));
}

}  // namespace hiprt::tools
