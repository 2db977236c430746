#pragma once
/// The headers of hiprt_device as text. Internal; rtc/embed_headers.cmake writes the definition.

#include <span>

namespace hiprt::gpu::rtc {

struct EmbeddedHeader {
  const char* name;  ///< As in #include <name>.
  const char* text;
};

std::span<const EmbeddedHeader> embedded_headers();

}  // namespace hiprt::gpu::rtc
