#include <tools/render/path/path_data_bytes.h>

#include <tools/base/bytes.h>

#include <type_traits>
#include <utility>

namespace hiprt::tools {

std::vector<std::byte> encode(const PathData& data) {
  ByteWriter writer;
  PathData::for_each(data, data, [&](const auto& array, const auto&) { writer.add_array(std::span(array)); });
  return std::move(writer.bytes());
}

std::optional<PathData> decode_path_data(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  PathData data;
  PathData::for_each(data, data, [&](auto& array, const auto&) {
    using Element = typename std::decay_t<decltype(array)>::value_type;
    static_assert(std::is_trivially_copyable_v<Element>);
    array = reader.get_array<Element>();
  });
  if (!reader.ok() || !reader.at_end()) return std::nullopt;
  return data;
}

Digest digest_of(const PathData& data) {
  Digester digester;
  PathData::for_each(data, data, [&](const auto& array, const auto&) {
    const std::uint64_t size = array.size();
    digester.add(std::as_bytes(std::span(&size, 1)));
    digester.add(std::as_bytes(std::span(array)));
  });
  return digester.get();
}

}  // namespace hiprt::tools
