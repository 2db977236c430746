#pragma once
/// Launches kernels into a stream one after the other. After an error all later launches are skipped. Internal.

#include <hiprt_build/gpu/launch.h>

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

namespace hiprt::gpu {

class Launcher {
 public:
  static constexpr unsigned kBlock = 256;

  explicit Launcher(hipStream_t stream) : stream_(stream) {}

  hipStream_t stream() const { return stream_; }
  Result<void>& result() { return result_; }

  /// One thread.
  template <class... Parameters>
  void one(const char* name, void (*kernel)(Parameters...), std::type_identity_t<Parameters>... arguments) {
    if (result_) result_ = launch(kernel, Grid{}, stream_, {.block = 1, .name = name}, arguments...);
  }
  /// So many blocks of @p block threads.
  template <class... Parameters>
  void blocks(const char* name, unsigned block, std::uint64_t count, void (*kernel)(Parameters...),
              std::type_identity_t<Parameters>... arguments) {
    const Grid grid{static_cast<unsigned>(count)};
    if (result_) result_ = launch(kernel, grid, stream_, {.block = block, .name = name}, arguments...);
  }
  /// A thread for each of @p count.
  template <class... Parameters>
  void each(std::uint64_t count, const char* name, void (*kernel)(Parameters...),
            std::type_identity_t<Parameters>... arguments) {
    if (result_) result_ = launch(kernel, count, stream_, {.block = kBlock, .name = name}, arguments...);
  }
  /// Blocks that the device holds at once, or fewer that have enough to do.
  template <class... Parameters>
  void persistent(const char* name, unsigned block, std::uint64_t most_blocks, void (*kernel)(Parameters...),
                  std::type_identity_t<Parameters>... arguments) {
    if (result_)
      blocks(name, block, std::min<std::uint64_t>(resident(kernel, block), most_blocks), kernel, arguments...);
  }
  template <class T> void fill_bytes(const char* what, T* values, std::uint64_t count, int byte) {
    if (result_ && count != 0)
      result_ = check(hipMemsetAsync(values, byte, count * sizeof(T), stream_), "hipMemsetAsync", what);
  }
  /// What else returns a result.
  template <class Enqueue> void then(const Enqueue& enqueue) {
    if (result_) result_ = enqueue();
  }

 private:
  /// Asked for once: a kernel may be started for every level of a tree.
  template <class... Parameters> unsigned resident(void (*kernel)(Parameters...), unsigned block) {
    const auto* address = reinterpret_cast<const void*>(kernel);
    for (const auto& [known, blocks] : resident_)
      if (known == address) return blocks;
    const auto blocks = persistent_grid(kernel, block);
    if (!blocks) result_ = tl::unexpected(blocks.error());
    return resident_.emplace_back(address, blocks ? *blocks : 1u).second;
  }

  hipStream_t stream_;
  std::vector<std::pair<const void*, unsigned>> resident_;  ///< Blocks of each kernel that the device holds.
  Result<void> result_{};
};

}  // namespace hiprt::gpu
