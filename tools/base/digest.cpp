#include <tools/base/digest.h>

#ifndef XXH_INLINE_ALL
#define XXH_INLINE_ALL
#endif
#include <xxhash.h>

#include <cstring>

namespace hiprt::tools {
namespace {

Digest canonical(XXH128_hash_t hash) {
  XXH128_canonical_t bytes;
  XXH128_canonicalFromHash(&bytes, hash);
  Digest digest;
  static_assert(sizeof(digest) == sizeof(bytes));
  std::memcpy(digest.data(), &bytes, sizeof(digest));
  return digest;
}

}  // namespace

struct Digester::State {
  XXH3_state_t state;
};

Digest digest_of(std::span<const std::byte> bytes) { return canonical(XXH3_128bits(bytes.data(), bytes.size())); }

std::string to_text(const Digest& digest) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const std::byte byte : digest) {
    text += kDigits[std::to_integer<unsigned>(byte) / 16];
    text += kDigits[std::to_integer<unsigned>(byte) % 16];
  }
  return text;
}

Digester::Digester() : state_(std::make_unique<State>()) { XXH3_128bits_reset(&state_->state); }
Digester::~Digester() = default;

void Digester::add(std::span<const std::byte> bytes) {
  XXH3_128bits_update(&state_->state, bytes.data(), bytes.size());
}

Digest Digester::get() const { return canonical(XXH3_128bits_digest(&state_->state)); }

}  // namespace hiprt::tools
