#pragma once
/// Bytes compressed by zstd.

#include <zstd.h>

#include <string>

namespace hiprt::test {

inline std::string zstd(const std::string& bytes) {
  std::string result(ZSTD_compressBound(bytes.size()), '\0');
  result.resize(ZSTD_compress(result.data(), result.size(), bytes.data(), bytes.size(), 3));
  return result;
}

}  // namespace hiprt::test
