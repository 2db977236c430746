#pragma once
/// A limit of the memory that readers of files may take.

#include <hiprt_build/error.h>

#include <cstdint>
#include <new>
#include <string>
#include <string_view>

namespace hiprt::tools {

/// While a limit lives, the process can allocate that many bytes more than it had before. Allocations beyond it fail
/// with std::bad_alloc, also those of libraries. The system counts (RLIMIT_DATA of Linux); elsewhere nothing is
/// limited. The bytes of files that are read count too. At most one limit may live at a time.
class MemoryLimit {
 public:
  /// @param bytes 0: half of the machine's memory.
  explicit MemoryLimit(std::uint64_t bytes);
  MemoryLimit(const MemoryLimit&) = delete;
  MemoryLimit& operator=(const MemoryLimit&) = delete;
  ~MemoryLimit();

 private:
  std::uint64_t old_ = 0;  ///< The system's limit before.
  bool is_set_ = false;
};

/// Throws std::bad_alloc unless so many bytes can be allocated now. For libraries that report too little memory as
/// damaged input.
void require_memory(std::uint64_t bytes);

/// kOutOfMemory: "a.obj: not enough memory to read it", and the limit if one lives, else the bytes wanted and free. If
/// there is no memory for this text either, it is "out of memory".
/// @param name of the file or thing. @param action as "to read it".
build::Error not_enough_memory(const std::string& name, std::string_view action,
                               const std::bad_alloc& failure) noexcept;

}  // namespace hiprt::tools
