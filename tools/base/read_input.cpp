#include <tools/base/read_input.h>

#include <tools/base/memory_limit.h>
#include <tools/base/parallel.h>

#include <hiprt_build/file.h>

namespace hiprt::tools {

build::Result<build::Buffer> read_input(const std::filesystem::path& path, unsigned threads) {
  const ParallelLoop loop = [&](std::size_t count, const std::function<void(std::size_t)>& body) {
    parallel_each(count, threads, body);
  };
  auto file = build::read_file(path, threads == 1 ? ParallelLoop{} : loop);
  if (!file && file.error().code == build::ErrorCode::kOutOfMemory)
    return tl::unexpected(not_enough_memory(path.native(), "to read it", std::bad_alloc()));
  return file;
}

}  // namespace hiprt::tools
