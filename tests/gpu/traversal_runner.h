#pragma once
/// Runs one kernel of the traversal test. Guard words surround its memory.

#include <hiprt_build/gpu/gpu.h>
#include <tests/gpu/random_scene.h>
#include <tests/gpu/results.h>
#include <tests/gpu/traversal_job.h>

#include <algorithm>
#include <vector>

namespace hiprt::checks {

struct Run {
  std::vector<QueryResult> results;
  std::uint32_t failed_rays;    ///< As the stacks counted them.
  std::uint32_t broken_guards;  ///< Of any stack memory.
};

/// Device memory of stack entries between guard words.
class GuardedEntries {
 public:
  GuardedEntries(std::size_t count, hipStream_t stream, gpu::Allocator& allocator)
      : memory_(must(gpu::DeviceArray<StackEntry>::from(std::vector<StackEntry>(count + 2 * kGuard, kGuardEntry),
                                                        stream, allocator))) {
    must(gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize"));
  }
  StackEntry* begin() { return memory_.data() + kGuard; }
  /// Waits for the stream.
  std::uint32_t broken(hipStream_t stream) const {
    const auto entries = must(memory_.to_vector(stream));
    const auto differs = [](StackEntry entry) { return entry != kGuardEntry; };
    return static_cast<std::uint32_t>(std::count_if(entries.begin(), entries.begin() + kGuard, differs) +
                                      std::count_if(entries.end() - kGuard, entries.end(), differs));
  }

 private:
  gpu::DeviceArray<StackEntry> memory_;
};

/// Device memory that all runs share.
class Runner {
 public:
  Runner() : wave_(must(gpu::current_device()).wave_size) {}

  /// @param entries per thread, of grid and pool memory. @param source of the scene's custom primitives, or none.
  Run run(const Variant& variant, const SceneView& scene, const std::vector<Ray>& rays, std::uint32_t entries,
          const SceneSource& source = {}) {
    const auto count = static_cast<std::uint32_t>(rays.size());
    const unsigned blocks = variant.batch ? kBatchBlocks : (count + kBlock - 1) / kBlock;
    const std::vector<std::uint32_t> zeros(3 + kSlots, 0);
    auto words = must(gpu::DeviceArray<std::uint32_t>::from(zeros, nullptr, allocator_));
    const auto device_rays = must(gpu::DeviceArray<Ray>::from(rays, nullptr, allocator_));
    const auto spheres = must(gpu::DeviceArray<Sphere>::from(source.spheres, nullptr, allocator_));
    const auto hair = must(gpu::DeviceArray<CurveVertex>::from(source.hair, nullptr, allocator_));
    const auto segments = must(gpu::DeviceArray<std::uint32_t>::from(segments_of(source.hair), nullptr, allocator_));
    auto results = must(gpu::DeviceArray<QueryResult>::make(count, nullptr, allocator_));
    must(results.fill(std::byte{0x5a}, nullptr));
    GuardedEntries spill(std::size_t{blocks} * kBlock * entries, nullptr, allocator_);
    GuardedEntries slots(pool_spill_bytes(kSlots, entries, wave_) / sizeof(StackEntry), nullptr, allocator_);
    std::uint32_t* const word = words.data();
    const SpillPool pool{word + 3, slots.begin(), kSlots, entries};
    const Job job{scene,
                  device_rays.data(),
                  results.data(),
                  count,
                  word,
                  word + 1,
                  word + 2,
                  spill.begin(),
                  entries,
                  pool,
                  Customs{SphereSet{spheres.data()}, RoundCurveSet{hair.data(), segments.data()}}};
    must(gpu::launch(variant.kernel, gpu::Grid{blocks}, nullptr, {.block = kBlock, .name = variant.name}, job));
    Run result{must(results.to_vector(nullptr)), 0, 0};
    const auto after = must(words.to_vector(nullptr));
    result.failed_rays = after[1];
    result.broken_guards = after[2] + spill.broken(nullptr) + slots.broken(nullptr);
    CHECK(std::count(after.begin() + 3, after.end(), 0u) == kSlots);
    return result;
  }

 private:
  static constexpr unsigned kBatchBlocks = 4;
  /// Fewer than there are waves, so that these wait for each other.
  static constexpr std::uint32_t kSlots = 5;

  unsigned wave_;
  gpu::DeviceAllocator allocator_;
};

}  // namespace hiprt::checks
