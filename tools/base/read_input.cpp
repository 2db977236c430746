#include <tools/base/read_input.h>

#include <tools/base/memory_limit.h>

#include <hiprt_build/file.h>

namespace hiprt::tools {

build::Result<build::Buffer> read_input(const std::filesystem::path& path) {
  auto file = build::read_file(path);
  if (!file && file.error().code == build::ErrorCode::kOutOfMemory)
    return tl::unexpected(not_enough_memory(path.string()));
  return file;
}

}  // namespace hiprt::tools
