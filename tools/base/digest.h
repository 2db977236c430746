#pragma once
/// XXH3-128 checksums of content.

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace hiprt::tools {

/// XXH3-128 (seed 0), in its canonical order of bytes.
using Digest = std::array<std::byte, 16>;

Digest digest_of(std::span<const std::byte> bytes);

/// 32 hexadecimal digits.
std::string to_text(const Digest& digest);

/// The digest of bytes that come in parts.
class Digester {
 public:
  /// Throws std::bad_alloc.
  Digester();
  ~Digester();

  void add(std::span<const std::byte> bytes);
  /// Of all bytes so far.
  Digest get() const;

 private:
  struct State;

  std::unique_ptr<State> state_;
};

}  // namespace hiprt::tools
