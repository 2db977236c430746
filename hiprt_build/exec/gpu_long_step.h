#pragma once
/// Asks whether to go on, between the launches of a step that takes long. Internal.

#include <hiprt_build/build.h>
#include <hiprt_build/gpu/error.h>

#include <algorithm>
#include <cstdint>

namespace hiprt::gpu {

/// References that a GPU processes in a few milliseconds.
inline constexpr std::uint64_t kUnaskedWork = std::uint64_t{1} << 22;

class LongStep {
 public:
  /// Nobody is asked.
  LongStep() = default;
  /// @param progress empty: nobody is asked. It must outlive this.
  /// @param begin, end of the step, as fractions of the build.
  /// @param unasked references that launches process between two questions.
  LongStep(const build::ProgressCallback& progress, const char* name, double begin, double end,
           std::uint64_t unasked = kUnaskedWork)
      : progress_(progress ? &progress : nullptr), name_(name), begin_(begin), end_(end), unasked_(unasked) {}

  /// The number of launches for so many references, with a progress callback after each. 1 if nobody is asked.
  std::uint32_t parts(std::uint64_t references) const {
    constexpr std::uint64_t kMost = 256;
    if (progress_ == nullptr) return 1;
    return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(references / unasked_, 1, kMost));
  }
  /// Behind launches that process so many references. Waits for the device if it asks.
  /// @param part of the step that these launches end, 0 to 1.
  Result<void> done(hipStream_t stream, std::uint64_t references, double part) {
    if (progress_ == nullptr) return {};
    work_ += references;
    if (work_ < unasked_) return {};
    work_ = 0;
    if (auto waited = check(hipStreamSynchronize(stream), "hipStreamSynchronize", name_); !waited) return waited;
    if ((*progress_)(build::Progress{name_, begin_ + (end_ - begin_) * part})) return {};
    return fail(ErrorCode::kCancelled, "the build was cancelled in step ", name_);
  }

 private:
  const build::ProgressCallback* progress_ = nullptr;
  const char* name_ = "";
  double begin_ = 0.0, end_ = 1.0;
  std::uint64_t unasked_ = kUnaskedWork, work_ = 0;
};

}  // namespace hiprt::gpu
