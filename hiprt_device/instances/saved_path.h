#pragma once
/// A path of instances that a search remembers: that of its hit, or of the hit before.

#include <hiprt_device/instances/levels.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace levels_detail {

template <unsigned kLevels> struct SavedPathState {
  std::uint32_t* instance;
  std::uint32_t depth = 0;
};
template <> struct SavedPathState<1> { std::uint32_t instance = kInvalidId; };
template <> struct SavedPathState<0> {};

}  // namespace levels_detail

/// @tparam kLevels more than 1: the path lies in memory of the stack's Storage.
template <unsigned kLevels> class SavedPath {
 public:
  /// @param number 1 or 2: the path's number in that memory.
  template <class Storage>
  HIPRT_HD HIPRT_FORCE_INLINE SavedPath([[maybe_unused]] const Storage& storage, [[maybe_unused]] unsigned number) {
    if constexpr (kLevels > 1) state_.instance = storage.path_memory->instance + number * kLevels;
  }

  template <bool kMoves, class Real>
  HIPRT_HD HIPRT_FORCE_INLINE void save([[maybe_unused]] const Levels<kLevels, kMoves, Real>& levels) {
    if constexpr (kLevels == 1) state_.instance = levels.instance(0);
    if constexpr (kLevels > 1) {
      state_.depth = levels.depth();
      for (unsigned i = 0; i < state_.depth; ++i) state_.instance[i] = levels.instance(i);
    }
  }
  HIPRT_HD HIPRT_FORCE_INLINE void save([[maybe_unused]] const SavedPath& other) {
    if constexpr (kLevels == 1) state_.instance = other.state_.instance;
    if constexpr (kLevels > 1) {
      state_.depth = other.state_.depth;
      for (unsigned i = 0; i < state_.depth; ++i) state_.instance[i] = other.state_.instance[i];
    }
  }

  HIPRT_HD HIPRT_FORCE_INLINE InstancePath<kLevels> path() const {
    InstancePath<kLevels> path;
    if constexpr (kLevels == 1)
      if (state_.instance != kInvalidId) path = {1, {state_.instance}};
    if constexpr (kLevels > 1) {
      return path_of<kLevels>(state_.depth, state_.instance);
    }
    return path;
  }

  /// Compares in the order of paths: negative if this path comes first, 0 if both are the same.
  template <bool kMoves, class Real>
  HIPRT_HD HIPRT_FORCE_INLINE int compare(const Levels<kLevels, kMoves, Real>& levels) const {
    static_assert(kLevels != 0);
    if constexpr (kLevels == 1) {
      const std::uint32_t other = levels.instance(0);
      return state_.instance < other ? -1 : state_.instance > other ? 1 : 0;
    } else {
      const std::uint32_t depth = levels.depth();
      for (unsigned i = 0; i < state_.depth && i < depth; ++i)
        if (state_.instance[i] != levels.instance(i)) return state_.instance[i] < levels.instance(i) ? -1 : 1;
      return state_.depth < depth ? -1 : state_.depth > depth ? 1 : 0;
    }
  }

 private:
  levels_detail::SavedPathState<kLevels> state_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
