#include <tools/base/read_input.h>

#include <tools/base/memory_limit.h>
#include <tools/base/parallel.h>

#include <hiprt_build/file.h>
#include <hiprt_build/format/out_of_memory.h>

#include <cstdint>
#include <system_error>

namespace hiprt::tools {

build::Result<build::Buffer> read_input(const std::filesystem::path& path, unsigned threads) {
  const ParallelLoop loop = [&](std::size_t count, const std::function<void(std::size_t)>& body) {
    parallel_each(count, threads, body);
  };
  auto file = build::read_file(path, threads == 1 ? ParallelLoop{} : loop);
  if (file || file.error().code != build::ErrorCode::kOutOfMemory) return file;
  // read_file() names neither the path nor the option. Its one large array has the file's size.
  std::error_code fault;
  const std::uint64_t bytes = std::filesystem::file_size(path, fault);
  return tl::unexpected(fault ? not_enough_memory(path.native(), "to read it", std::bad_alloc())
                              : not_enough_memory(path.native(), "to read it", build::AllocationFailed(bytes)));
}

}  // namespace hiprt::tools
