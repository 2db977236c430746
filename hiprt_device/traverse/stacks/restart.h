#pragma once
/// A short stack in registers with a restart trail. It uses no memory.

#include <hiprt_device/math/wave.h>
#include <hiprt_device/traverse/stacks/stack.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Keeps the topmost entries in registers and finds lost entries again from the root.
///
/// A full stack loses its bottom entry. The restart trail says for each level of the tree which child the ray has come
/// to (Laine, "Restart trail for stackless BVH traversal", 2010). For wide trees see Vaidyanathan, Woop, Benthin,
/// "Wide BVH traversal with a short stack", 2019.
/// @tparam kEntries number of entries, 0 to 8. More entries mean fewer restarts and more registers.
///
/// The trail relies on children that come in the same order at every visit of their node. Children that an earlier hit
/// has put out of reach may be missing only at the far end. So orders must sort by distance, then by reference. They
/// need not sort if no hit shortens the ray. Trees of more than 64 levels overflow this stack.
template <unsigned kEntries = 4> struct RestartStack {
  static_assert(kEntries <= 8, "hiprt: RestartStack: kEntries must be at most 8, because entries are in registers");
  struct Storage : OverflowCount {};

  template <class Entry> class Backtrack {
   public:
    static constexpr bool kNeedsStableOrder = true;

    HIPRT_HD HIPRT_FORCE_INLINE Backtrack(const Storage&, NodeRef root) : root_(root) {}

    /// Whether the trail has a level left for the children of the current node.
    HIPRT_HD HIPRT_FORCE_INLINE bool reserve() const { return level_ < kLevels; }

    HIPRT_HD HIPRT_FORCE_INLINE void later(Entry entry) {
      passed_[2] = passed_[1];
      passed_[1] = passed_[0];
      passed_[0] = entry;
      ++passed_count_;
    }
    template <class Each> HIPRT_HD HIPRT_FORCE_INLINE void later_some(Each&& each) {
      each([&](Entry entry) HIPRT_FORCE_INLINE_LAMBDA { later(entry); });
    }

    HIPRT_HD HIPRT_FORCE_INLINE NodeRef follow(Entry nearest) {
      const unsigned done = child_index(level_), count = passed_count_ + 1;
      passed_count_ = 0;
      // After a restart, the child on the trail and all children behind it may be out of reach.
      if (done >= count) return pop_at_any_distance();
      const auto push = [&](unsigned i) HIPRT_FORCE_INLINE_LAMBDA {
        if (i > done && i < count) push_entry(passed_[i - 1], i + 1 == count);
      };
      push(3);
      push(2);
      push(1);
      set_more(level_, done + 1 < count);
      ++level_;
      return entry_ref(done == 0 ? nearest : done == 1 ? passed_[0] : done == 2 ? passed_[1] : passed_[2]);
    }

    HIPRT_HD HIPRT_FORCE_INLINE NodeRef pop(float limit) {
      for (;;) {
        const std::uint64_t pending = more_ & below(level_);
        if (pending == 0) return kInvalidRef;
        const unsigned parent = highest_bit(pending);
        step_at(parent);
        if (held_ == 0) {
          level_ = 0;
          return root_;
        }
        level_ = parent + 1;
        bool last = false;
        const Entry entry = pop_entry(last);
        if (last) set_more(parent, false);
        if (entry_distance(entry) <= limit) return entry_ref(entry);
      }
    }

   private:
    static constexpr unsigned kLevels = 64;

    HIPRT_HD HIPRT_FORCE_INLINE NodeRef pop_at_any_distance() { return pop(std::numeric_limits<float>::infinity()); }

    /// Bits [0, level).
    HIPRT_HD static HIPRT_FORCE_INLINE std::uint64_t below(unsigned level) {
      return level >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << level) - 1;
    }
    HIPRT_HD HIPRT_FORCE_INLINE void set_more(unsigned level, bool more) {
      const std::uint64_t bit = std::uint64_t{1} << level;
      more_ = more ? more_ | bit : more_ & ~bit;
    }
    HIPRT_HD HIPRT_FORCE_INLINE unsigned child_index(unsigned level) const {
      return static_cast<unsigned>(index_[0] >> level & 1u) | static_cast<unsigned>(index_[1] >> level & 1u) << 1;
    }
    /// Steps to the next child at this level and forgets the levels below.
    HIPRT_HD HIPRT_FORCE_INLINE void step_at(unsigned level) {
      const std::uint64_t keep = below(level + 1), bit = std::uint64_t{1} << level;
      index_[1] = (index_[1] ^ (index_[0] & bit)) & keep;
      index_[0] = (index_[0] ^ bit) & keep;
      more_ &= keep;
    }

    HIPRT_HD HIPRT_FORCE_INLINE void push_entry(Entry entry, bool last) {
      if constexpr (kEntries != 0) {
        for (unsigned i = kEntries - 1; i > 0; --i) held_entries_[i] = held_entries_[i - 1];
        held_entries_[0] = entry;
        last_ = last_ << 1 | (last ? 1u : 0u);
        held_ = held_ < kEntries ? held_ + 1 : kEntries;
      }
    }
    HIPRT_HD HIPRT_FORCE_INLINE Entry pop_entry(bool& last) {
      const Entry top = held_entries_[0];
      if constexpr (kEntries > 1)
        for (unsigned i = 0; i + 1 < kEntries; ++i) held_entries_[i] = held_entries_[i + 1];
      last = (last_ & 1u) != 0;
      last_ >>= 1;
      --held_;
      return top;
    }

    NodeRef root_;
    unsigned level_ = 0;           ///< Level of the current node; the root's is 0.
    std::uint64_t index_[2] = {};  ///< Per level: bits 0 and 1 of the visiting number (0 to 3) of the child on the
                                   ///< trail.
    std::uint64_t more_ = 0;       ///< Bit per level: children behind that one are still to be visited.
    Entry passed_[3] = {};         ///< Entries of later() since the last follow(), the nearest first.
    unsigned passed_count_ = 0;
    Entry held_entries_[kEntries == 0 ? 1 : kEntries] = {};  ///< The top of the stack first.
    std::uint32_t last_ = 0;  ///< Bit i: entry i was the last child in reach of its node when it was pushed.
    unsigned held_ = 0;
  };
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
