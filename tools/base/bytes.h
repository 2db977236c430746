#pragma once
/// Values in a row of bytes, in the machine's (little-endian) order: messages between ranks, checkpoints.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace hiprt::tools {

class ByteWriter {
 public:
  template <class T> void add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    add_bytes(std::as_bytes(std::span(&value, 1)));
  }
  void add_bytes(std::span<const std::byte> bytes) {
    // Not insert(): GCC 12 warns of copies behind the end, with -O3.
    const std::size_t end = bytes_.size();
    bytes_.resize(end + bytes.size());
    std::copy(bytes.begin(), bytes.end(), bytes_.data() + end);
  }
  /// With its size before it.
  void add_text(std::string_view text) {
    add(std::uint64_t{text.size()});
    add_bytes(std::as_bytes(std::span(text)));
  }
  /// With their number before them.
  template <class T> void add_array(std::span<const T> values) {
    add(std::uint64_t{values.size()});
    add_bytes(std::as_bytes(values));
  }

  std::vector<std::byte>& bytes() { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

/// Reads what a ByteWriter wrote. After the first value that is not there ok() is false, and values are zeros.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::span<const std::byte> take(std::uint64_t size) {
    if (size > bytes_.size()) {
      ok_ = false;
      return {};
    }
    const auto part = bytes_.first(static_cast<std::size_t>(size));
    bytes_ = bytes_.subspan(part.size());
    return part;
  }
  template <class T> T get() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value{};
    if (const auto part = take(sizeof(T)); !part.empty()) std::memcpy(&value, part.data(), sizeof(T));
    return value;
  }
  std::string get_text() {
    const auto part = take(get<std::uint64_t>());
    return {reinterpret_cast<const char*>(part.data()), part.size()};
  }
  template <class T> std::vector<T> get_array() {
    const auto count = get<std::uint64_t>();
    // The bytes are counted first: a wrong number must not allocate.
    if (count > bytes_.size() / sizeof(T)) {
      ok_ = false;
      return {};
    }
    std::vector<T> values(static_cast<std::size_t>(count));
    if (const auto part = take(count * sizeof(T)); !part.empty()) std::memcpy(values.data(), part.data(), part.size());
    return values;
  }
  /// All that is left.
  std::span<const std::byte> rest() { return take(bytes_.size()); }

  bool ok() const { return ok_; }
  bool at_end() const { return bytes_.empty(); }

 private:
  std::span<const std::byte> bytes_;
  bool ok_ = true;
};

}  // namespace hiprt::tools
