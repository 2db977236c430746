#pragma once
/// LLVM bitcode of AMD kernels, for a compiler that reads files. Internal.

#include <hiprt_build/error.h>

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace hiprt::gpu::rtc {

/// @param code bitcode, or a bundle of clang's (clang-offload-bundler) with bitcode for several processors.
/// @return the bitcode for a processor such as gfx1030. An entry of a bundle may ask for features of the processor
///         (gfx90a:xnack-): the first entry for the processor is taken.
/// @return kInvalidInput for other bytes, and for a bundle that is compressed, damaged, or lacks the processor.
build::Result<std::span<const std::byte>> find_bitcode(std::span<const std::byte> code, std::string_view processor);

/// Bytes in memory that other code reads by the name of a file.
class MemoryFile {
 public:
  /// @return kIo with the system's reason.
  static build::Result<MemoryFile> make(std::span<const std::byte> bytes);
  MemoryFile(MemoryFile&& other) noexcept;
  MemoryFile& operator=(MemoryFile&&) = delete;
  ~MemoryFile();

  /// Of this process and others, while the object lives.
  std::string path() const;

 private:
  explicit MemoryFile(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

}  // namespace hiprt::gpu::rtc
