#pragma once
/// A picture as units of work: which pixels and samples are computed together, and by whom, changes no bit.
///
/// A step is a sample of a pixel, or a pass of the studio. The state of a pixel after n steps depends on its state
/// after n - 1 steps and on nothing else. So the steps of a pixel are computed in order, each once, by any processor.

#include <tools/render/studio/render.h>

#include <hiprt_build/error.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace hiprt::tools {

/// Steps [first, first + steps) of a rectangle of pixels.
struct PictureUnit {
  std::uint32_t left, top, width, height;
  std::uint32_t first, steps;

  std::uint64_t pixels() const { return std::uint64_t{width} * height; }
  friend bool operator==(const PictureUnit&, const PictureUnit&) = default;
};

/// A picture of one scene, camera and set of options.
class PictureWork {
 public:
  PictureWork() = default;
  PictureWork(const PictureWork&) = delete;
  PictureWork& operator=(const PictureWork&) = delete;
  virtual ~PictureWork() = default;

  /// Steps of every pixel.
  virtual std::uint32_t steps() const = 0;
  /// Bytes of the state of a pixel.
  virtual std::size_t pixel_bytes() const = 0;
  /// Threads that may call run() at the same time.
  virtual unsigned workers() const = 0;

  /// Called once by every thread before it calls run().
  virtual build::Result<void> enter() { return {}; }
  /// Computes a unit. When interrupted() becomes true it returns early and leaves a state of no use.
  /// @param state of the unit's pixels, row by row: after `first` steps on entry, after `first + steps` on return. It
  /// is not read if `first` is 0.
  /// @return the numbers of traced rays; kInvalidInput if the tracer refuses the scene; errors of the GPU.
  virtual build::Result<RayCounts> run(const PictureUnit& unit, std::span<std::byte> state) = 0;
  /// Called when nobody needs the results of run(): calls that wait for other processes return soon.
  virtual void stop() {}
};

}  // namespace hiprt::tools
