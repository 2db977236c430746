#pragma once
/// Path-traced pictures of a scene in parts as units of work.

#include <tools/render/image/image.h>
#include <tools/render/parts/part_exchange.h>
#include <tools/render/path/path_trace.h>
#include <tools/render/units/picture_work.h>

#include <atomic>
#include <mutex>
#include <vector>

namespace hiprt::tools {

/// How much memory of a process the rays of a picture take, and what fits into it.
struct RayMemory {
  std::size_t paths = 0;   ///< Of a wave.
  std::size_t credit = 0;  ///< Rays on their way to each other process.

  /// Half of the memory is for the waves of this process's threads. The other half is for messages: this process may
  /// get the rays of all others, and has as many rays at all others.
  /// @param levels of the scene.
  /// @return kInvalidInput with the least number of bytes if these are fewer.
  static build::Result<RayMemory> divide(std::uint64_t bytes, unsigned ranks, unsigned workers, std::uint32_t levels);
};

/// An engine of PathWave (path_wave.h) whose rays go through all parts.
class PartPathEngine;

class PartWork : public PictureWork {
 public:
  /// @param scene, exchange must live as long as this. @param scene the same as PartExchange::Setup::shared, with the
  /// settings of the picture. @param workers at most RayMail::kMostSlots - 1.
  PartWork(const PathScene& scene, PartExchange& exchange, std::uint32_t samples, unsigned workers, std::size_t paths);

  std::uint32_t steps() const override { return samples_; }
  std::size_t pixel_bytes() const override { return sizeof(PathSum); }
  unsigned workers() const override { return workers_; }
  /// Lets the calling thread give way to threads that answer other processes.
  build::Result<void> enter() override;
  build::Result<RayCounts> run(const PictureUnit& unit, std::span<std::byte> state) override;
  void stop() override { stopped_ = true; }

  /// A slot of the exchange that no worker uses.
  unsigned other_slot() const { return workers_; }

 private:
  unsigned take_slot();

  const PathScene& scene_;
  PartExchange& exchange_;
  std::uint32_t samples_;
  unsigned workers_;
  std::size_t paths_;
  std::atomic<bool> stopped_ = false;
  std::mutex mutex_;
  std::vector<unsigned> free_slots_;
};

/// Fills the layers of a picture that belong to the rays through the pixels' centres. Costs are left out: they depend
/// on the tree, and parts have trees of their own.
/// @param image of the size of the settings. @param slot, stopped of PartExchange::trace().
build::Result<void> store_part_layers(const PathScene& scene, PartExchange& exchange, unsigned slot,
                                      const std::atomic<bool>& stopped, Image& image);

}  // namespace hiprt::tools
