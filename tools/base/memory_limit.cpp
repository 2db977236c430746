#include <tools/base/memory_limit.h>

#include <hiprt_build/format/out_of_memory.h>

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>
#endif

namespace hiprt::tools {
namespace {

std::uint64_t limit_that_lives = 0;  ///< In bytes; 0: none.

#ifdef __linux__
std::uint64_t page_bytes() { return static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)); }

std::uint64_t half_of_memory() {
  const long pages = sysconf(_SC_PHYS_PAGES);
  return pages > 0 ? static_cast<std::uint64_t>(pages) * page_bytes() / 2 : 0;
}

/// Bytes that count for RLIMIT_DATA now (proc_pid_statm(5), field 6).
std::optional<std::uint64_t> data_bytes() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t field = 0;
  for (unsigned i = 0; i < 6; ++i)
    if (!(file >> field)) return std::nullopt;
  return field * page_bytes();
}
#endif

}  // namespace

#ifdef __linux__
MemoryLimit::MemoryLimit(std::uint64_t bytes) {
  if (bytes == 0) bytes = half_of_memory();
  const auto now = data_bytes();
  rlimit limit{};
  if (bytes == 0 || !now || getrlimit(RLIMIT_DATA, &limit) != 0) return;
  old_ = limit.rlim_cur;
  const std::uint64_t wanted = bytes < RLIM_INFINITY - *now ? *now + bytes : RLIM_INFINITY;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_cur, wanted);
  is_set_ = setrlimit(RLIMIT_DATA, &limit) == 0;
  if (is_set_) limit_that_lives = bytes;
}

MemoryLimit::~MemoryLimit() {
  if (!is_set_) return;
  rlimit limit{};
  if (getrlimit(RLIMIT_DATA, &limit) == 0) {
    limit.rlim_cur = old_;
    setrlimit(RLIMIT_DATA, &limit);
  }
  limit_that_lives = 0;
}
#else
MemoryLimit::MemoryLimit(std::uint64_t) {}
MemoryLimit::~MemoryLimit() = default;
#endif

void require_memory(std::uint64_t bytes) { ::operator delete(::operator new(bytes)); }

build::Error not_enough_memory(const std::string& name, std::string_view action,
                               const std::bad_alloc& failure) noexcept {
  try {
    build::Error error = build::out_of_memory({action}, failure);
    if (limit_that_lives != 0)
      error.message = "not enough memory " + std::string(action) + "; the limit is " +
                      std::to_string(limit_that_lives) + " bytes, --max-memory sets it";
    error.message.insert(0, name + ": ");
    return error;
  } catch (const std::bad_alloc&) {
    return build::error_or_out_of_memory(build::ErrorCode::kOutOfMemory, "out of memory");
  }
}

}  // namespace hiprt::tools
