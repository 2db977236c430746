#pragma once
/// Global memory for stack entries: a fixed part per thread of a grid, or slots that waves take while they run.

#include <hiprt_device/math/memory.h>
#include <hiprt_device/math/wave.h>
#include <hiprt_device/traverse/stacks/stack.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The entries of one thread, interleaved with its neighbours': entry i is first[i * stride].
struct Spill {
  StackEntry* first = nullptr;
  std::uint32_t stride = 0;
  std::uint32_t capacity = 0;  ///< Number of entries.
};

/// Entries of any kind take as many bytes as a StackEntry.
template <class Entry> HIPRT_HD HIPRT_FORCE_INLINE Entry load_spilled(const Spill& spill, std::uint32_t i) {
  return static_cast<Entry>(load_global(spill.first, static_cast<std::size_t>(i) * spill.stride));
}
HIPRT_HD HIPRT_FORCE_INLINE void store_spilled(const Spill& spill, std::uint32_t i, StackEntry entry) {
  store_global(spill.first, static_cast<std::size_t>(i) * spill.stride, entry);
}

/// For the host: the bytes for a grid of threads with so many entries each.
HIPRT_HD constexpr std::size_t grid_spill_bytes(std::size_t threads, std::uint32_t entries) {
  return threads * entries * sizeof(StackEntry);
}

/// @param memory grid_spill_bytes(threads, entries) bytes.
/// @param thread this thread's number in the grid.
HIPRT_HD HIPRT_FORCE_INLINE Spill grid_spill(StackEntry* memory, std::uint32_t threads, std::uint32_t entries,
                                             std::uint32_t thread) {
  return {memory + thread, threads, entries};
}

/// Slots of global memory, each for one wave. A small value that is passed to kernels.
///
/// As many slots as waves can run at a time are always enough. With fewer slots, waves wait for each other.
struct SpillPool {
  std::uint32_t* locks = nullptr;  ///< One word per slot, zero at first.
  StackEntry* memory = nullptr;
  std::uint32_t slots = 0;
  std::uint32_t entries = 0;  ///< Per lane.
};

/// For the host: the bytes of SpillPool::memory.
/// @param wave lanes of a wave.
HIPRT_HD constexpr std::size_t pool_spill_bytes(std::uint32_t slots, std::uint32_t entries, unsigned wave) {
  return static_cast<std::size_t>(slots) * entries * wave * sizeof(StackEntry);
}

/// A slot of a pool that a wave holds from construction to destruction.
///
/// All lanes that will trace must construct it together, and destroy it together. A wave that has a slot must not wait
/// for a wave that may want one (__syncthreads(), a lock). It may if there are slots for all waves that run at a time.
class WaveSlot {
 public:
  /// @param first_try the slot to try first, for example the block's number. It spreads the waves over the pool.
  HIPRT_HD HIPRT_FORCE_INLINE WaveSlot(const SpillPool& pool, std::uint32_t first_try) : pool_(pool) {
    std::uint32_t slot = first_try % pool.slots;
    if (lanes_before(lanes_) == 0)
      while (!try_lock(pool.locks + slot)) slot = slot + 1 == pool.slots ? 0 : slot + 1;
    slot_ = from_first_lane(lanes_, slot);
  }
  HIPRT_HD HIPRT_FORCE_INLINE ~WaveSlot() {
    // The lanes arrive from their traversals one by one. All must be done with the slot.
    finish_writes();
    group_ballot(lanes_, true);
    if (lanes_before(lanes_) == 0) unlock(pool_.locks + slot_);
  }
  WaveSlot(const WaveSlot&) = delete;
  WaveSlot& operator=(const WaveSlot&) = delete;

  /// The entries of this lane.
  HIPRT_HD HIPRT_FORCE_INLINE Spill spill() const {
    const std::size_t first = static_cast<std::size_t>(slot_) * pool_.entries * wave_size() + lane_index();
    return {pool_.memory + first, wave_size(), pool_.entries};
  }

 private:
  const SpillPool& pool_;
  LaneMask lanes_ = wave_ballot(true);
  std::uint32_t slot_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
