#pragma once
/// Compiled kernels in files, by a key of all that they are made of. Internal.

#include <hiprt_build/gpu/compile.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace hiprt::gpu::rtc {

/// Makes the key: a hash of 128 bits.
class KernelKey {
 public:
  /// Adds a text. The order counts, and so does where one text ends.
  void add(std::string_view text);
  /// Adds the length of a list.
  void add(std::size_t count);
  /// @return 32 hexadecimal digits.
  std::string text() const;

 private:
  std::string content_;
};

/// @return the folder of the options, or the default; empty if the environment names none.
std::filesystem::path cache_folder(const CompileOptions& options);

/// @return nothing if there is no such file, or if it is damaged.
std::optional<CompiledKernels> read_cached(const std::filesystem::path& folder, const std::string& key);

/// Makes the folder and writes the file, if it can.
void write_cached(const std::filesystem::path& folder, const std::string& key, const CompiledKernels& kernels);

}  // namespace hiprt::gpu::rtc
