#pragma once
/// A build in steps, for little memory: after each step the host reads what has been counted, and the next one gets
/// memory of that size. enqueue_build() needs no such pauses and reserves for the worst case.
///
///     auto steps = hiprt::gpu::BuildSteps::make({&mesh, 1}, {});
///     hiprt::gpu::DeviceBuffer scene;
///     while (steps && !steps->done()) {
///       auto output = hiprt::gpu::DeviceBuffer::make(steps->sizes().output, stream, allocator);
///       auto scratch = hiprt::gpu::DeviceBuffer::make(steps->sizes().scratch, stream, allocator);
///       if (!output || !scratch || !steps->enqueue(output->data(), scratch->data(), stream) || !steps->wait()) break;
///       scene = std::move(*output);
///     }
///     trace<<<...>>>(steps->report().view, ...);

#include <hiprt_build/gpu/build.h>

#include <memory>

namespace hiprt::gpu {

/// The steps: leaves of one or two primitives; spatial splits if there are any; the binary tree; the scene. Each reads
/// the output of the one before. The last output is the scene: the file that compact() makes.
class BuildSteps {
 public:
  /// Copies the array @p geometries; the arrays on the device must live until the last step is done.
  /// @return kInvalidInput or kTooLarge with the number and its limit, or the runtime's error.
  static Result<BuildSteps> make(std::span<const DeviceGeometry> geometries, const BuildOptions& options = {});
  BuildSteps(BuildSteps&&) noexcept;
  BuildSteps& operator=(BuildSteps&&) noexcept;
  ~BuildSteps();

  /// Bytes that the next step needs. Both may be 0. @pre !done()
  BuildSizes sizes() const;

  /// Starts the next step on the stream and returns. Waits only if options.progress is set.
  /// @param output sizes().output bytes on the device, aligned to 256; needed until the step after it is done.
  /// @param scratch sizes().scratch bytes on the device, aligned to 256; needed until wait() returns.
  /// @return kInvalidInput if the memory is not aligned or it is not the time for a step; the errors of launches; or
  /// kCancelled. After an error of a launch and after kCancelled the build cannot go on.
  Result<void> enqueue(std::byte* output, std::byte* scratch, hipStream_t stream);

  /// Waits for the step on its stream.
  /// @return kTooLarge if a file or a stack cannot hold the scene, kInvalidInput if layout quantized cannot or no step
  /// was started, or the runtime's error. After these errors the build cannot go on.
  Result<void> wait();

  bool done() const;  ///< Whether the scene is complete.
  /// @pre done()
  const BuildReport& report() const;

 private:
  struct State;
  explicit BuildSteps(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace hiprt::gpu
