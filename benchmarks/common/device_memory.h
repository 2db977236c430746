#pragma once
/// Device memory of the benchmark programs.

#include <hiprt_build/gpu/device_buffer.h>

#include <utility>

namespace hiprt::bench {

/// For buffers and arrays that live as long as the program, at most.
inline gpu::Allocator& device_memory() {
  static gpu::DeviceAllocator allocator;
  return allocator;
}

/// Moves results into place. After an error it moves nothing more.
class Keeper {
 public:
  template <class T> void keep(T& to, build::Result<T> made) {
    if (!done_) return;
    if (made)
      to = std::move(*made);
    else
      done_ = tl::unexpected(std::move(made.error()));
  }
  void keep(build::Result<void> done) {
    if (done_) done_ = std::move(done);
  }

  /// The first error, if there was one.
  const build::Result<void>& done() const { return done_; }

 private:
  build::Result<void> done_;
};

}  // namespace hiprt::bench
