#pragma once
/// How a texture continues outside its picture. In a header without functions, because sources that are compiled for
/// several instruction sets include it.

#include <cstdint>

namespace hiprt::tools {

/// Meaning of texture coordinates outside [0, 1).
enum class TextureWrap : std::uint32_t { kRepeat, kClamp, kMirror };

}  // namespace hiprt::tools
