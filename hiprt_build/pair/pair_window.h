#pragma once
/// Pairs of triangles among 32 that lie next to each other in the index buffer: as pair.h pairs them, without looking
/// further. Internal.

#include <hiprt_build/input/leaf.h>
#include <hiprt_build/pair/custom_pair.h>
#include <hiprt_device/math/atomic.h>

#include <bit>

namespace hiprt::build {

inline constexpr unsigned kPairWindow = 32;
/// Rounds of handshakes.
inline constexpr unsigned kPairRounds = 4;

/// What became of a primitive.
struct PairedPrimitive {
  std::uint32_t primitive, geometry;
  DropReason dropped;
  LeafContents contents;  ///< Exists for the lower primitive of a leaf.
  Box box;                ///< Of the group.
};

/// @tparam Group the lanes that work on a window: see exec/group.h.
template <class Group> struct PairWindow {
  static constexpr unsigned kEdges = 3 * kPairWindow;
  static constexpr std::uint8_t kNone = 0xff;
  static constexpr unsigned kSlots = 256;  ///< Three of eight are used.

  /// Shared by the lanes of a group. Edge 3 i + k runs from corner k of triangle i.
  struct Shared {
    Point corner[kEdges];
    std::uint32_t key[kEdges];                            ///< Of the edge, direction included; 0: cannot be paired.
    std::uint32_t slot[kSlots];                           ///< Hash table of edges by their keys.
    float gain[kEdges];                                   ///< Area saved by pairing across it.
    std::uint32_t geometry[kPairWindow];                  ///< Of the primitive.
    std::uint8_t partner[kEdges];                         ///< The edge of another triangle, or kNone.
    std::uint8_t choice[kPairWindow], mate[kPairWindow];  ///< Edges of the triangle, and of the other one.
    std::uint8_t dropped[kPairWindow];                    ///< DropReason
  };

  GeometryTable geometries;
  bool pair;

  /// emit(PairedPrimitive) for each of the window's primitives.
  template <class Emit>
  HIPRT_HD void operator()(const Group& group, Shared& shared, std::uint32_t window, Emit&& emit) const {
    const std::uint32_t begin = window * kPairWindow;
    const std::uint32_t left = geometries.primitive_count - begin, size = left < kPairWindow ? left : kPairWindow;
    group.for_each(kPairWindow, [&](unsigned i) { file(shared, begin, i, size); });
    if (pair) group.for_each(kSlots, [&](unsigned i) { shared.slot[i] = kNone; });
    group.sync();
    if (pair) {
      group.for_each(kEdges, [&](unsigned e) { insert(shared, e); });
      group.sync();
      group.for_each(kPairWindow, [&](unsigned i) { find_partners(shared, i); });
      group.sync();
      for (unsigned round = 0; round < kPairRounds; ++round) {
        group.for_each(kPairWindow, [&](unsigned i) { choose(shared, i); });
        group.sync();
        group.for_each(kPairWindow, [&](unsigned i) { shake_hands(shared, i); });
        group.sync();
      }
    }
    group.for_each(size, [&](unsigned i) { emit(make(shared, begin, i, size)); });
    group.sync();
  }

 private:
  HIPRT_HD static std::uint32_t hash(const Point& p) {
    std::uint32_t h = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      h = (h ^ std::bit_cast<std::uint32_t>(p.x[axis])) * 0x9e3779b1u;
      h ^= h >> 15;
    }
    return h;
  }
  /// Not symmetric in its ends, given by their hashes.
  HIPRT_HD static std::uint32_t edge_key(std::uint32_t from, std::uint32_t to) {
    return (from * 0x85ebca6bu + to) | 1u;
  }

  /// What the other lanes need of primitive i.
  HIPRT_HD void file(Shared& shared, std::uint32_t begin, unsigned i, unsigned size) const {
    shared.mate[i] = kNone;
    for (unsigned e = 3 * i; e < 3 * i + 3; ++e) {
      shared.key[e] = 0;
      shared.partner[e] = kNone;
    }
    if (i >= size) return;
    const std::uint32_t g = geometries.find(begin + i);
    const GeometryView& mesh = geometries[g];
    shared.geometry[i] = g;
    if (mesh.is_custom()) {
      shared.dropped[i] = drop_reason(mesh.box(begin + i - mesh.first));
      return;
    }
    TriangleCorners corners;
    const DropReason reason = load_triangle(mesh, begin + i - mesh.first, corners);
    shared.dropped[i] = reason;
    if (reason != kKept) return;
    std::uint32_t hashes[3];
    for (unsigned k = 0; k < 3; ++k) {
      shared.corner[3 * i + k] = corners.v[k];
      hashes[k] = hash(corners.v[k]);
    }
    if (mesh.given_pairs) return;
    for (unsigned k = 0; k < 3; ++k) shared.key[3 * i + k] = edge_key(hashes[k], hashes[k == 2 ? 0 : k + 1]) + 2 * g;
  }

  HIPRT_HD static unsigned next_corner(unsigned e) { return e % 3 == 2 ? e - 2 : e + 1; }

  HIPRT_HD static unsigned slot_of(std::uint32_t key) { return (key * 0x9e3779b1u) >> 24; }
  /// Takes a slot for edge e. @return the edge that has it already, or kNone.
  HIPRT_HD static std::uint32_t claim(std::uint32_t& slot, std::uint32_t e) {
    std::uint32_t there = kNone;
#if HIPRT_DEVICE_CODE
    there = atomicCAS(&slot, there, e);
#else
    __atomic_compare_exchange_n(&slot, &there, e, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
#endif
    return there;
  }
  /// Of equal edges the table keeps the lowest.
  HIPRT_HD static void insert(Shared& shared, unsigned e) {
    const std::uint32_t key = shared.key[e];
    if (key == 0) return;
    for (unsigned slot = slot_of(key);; slot = (slot + 1) % kSlots) {
      const std::uint32_t there = claim(shared.slot[slot], e);
      if (there == kNone) return;
      if (shared.key[there] != key) continue;
      lower(&shared.slot[slot], e);
      return;
    }
  }
  /// @return the lowest edge with this key, or kNone.
  HIPRT_HD static unsigned find(const Shared& shared, std::uint32_t key) {
    for (unsigned slot = slot_of(key);; slot = (slot + 1) % kSlots) {
      const std::uint32_t there = shared.slot[slot];
      if (there == kNone || shared.key[there] == key) return there;
    }
  }

  HIPRT_HD void find_partners(Shared& shared, unsigned i) const {
    if (shared.key[3 * i] == 0) return;
    std::uint32_t wanted[3];
    for (unsigned k = 0; k < 3; ++k)
      wanted[k] = edge_key(hash(shared.corner[next_corner(3 * i + k)]), hash(shared.corner[3 * i + k])) +
                  2 * shared.geometry[i];
    unsigned found[3];
    for (unsigned k = 0; k < 3; ++k) found[k] = find(shared, wanted[k]);
    for (unsigned k = 0; k < 3; ++k)
      if (found[k] != kNone) link(shared, 3 * i + k, found[k]);
  }
  /// If the edges are one, in both directions, of two triangles of a mesh.
  HIPRT_HD static void link(Shared& shared, unsigned e, unsigned other) {
    if (e / 3 == other / 3 || shared.geometry[e / 3] != shared.geometry[other / 3]) return;
    if (!same_position(shared.corner[e].x, shared.corner[next_corner(other)].x) ||
        !same_position(shared.corner[next_corner(e)].x, shared.corner[other].x))
      return;
    const Box mine = triangle_box(shared, e / 3), others = triangle_box(shared, other / 3);
    shared.gain[e] = half_area(mine) + half_area(others) - half_area(unite(mine, others));
    shared.partner[e] = static_cast<std::uint8_t>(other);
  }
  HIPRT_HD static Box triangle_box(const Shared& shared, unsigned i) {
    Box box = empty_box();
    for (unsigned k = 0; k < 3; ++k) grow(box, shared.corner[3 * i + k]);
    return box;
  }

  HIPRT_HD static void choose(Shared& shared, unsigned i) {
    shared.choice[i] = kNone;
    if (shared.mate[i] != kNone) return;
    float best = 0.0f;
    unsigned best_edge = kEdges;
    for (unsigned e = 3 * i; e < 3 * i + 3; ++e) {
      const unsigned other = shared.partner[e];
      if (other == kNone || shared.mate[other / 3] != kNone) continue;
      const float gain = shared.gain[e];
      const unsigned edge = e < other ? e : other;
      if (!(gain > best || (gain == best && edge < best_edge && gain > 0.0f))) continue;
      best = gain;
      best_edge = edge;
      shared.choice[i] = static_cast<std::uint8_t>(e);
    }
  }

  HIPRT_HD static void shake_hands(Shared& shared, unsigned i) {
    const unsigned edge = shared.choice[i];
    if (edge == kNone) return;
    const unsigned other = shared.partner[edge];
    if (shared.choice[other / 3] == other && shared.partner[other] == edge)
      shared.mate[i] = static_cast<std::uint8_t>(other);
  }

  HIPRT_HD PairedPrimitive make(const Shared& shared, std::uint32_t begin, unsigned i, unsigned size) const {
    PairedPrimitive result{begin + i, shared.geometry[i], static_cast<DropReason>(shared.dropped[i]),
                           LeafContents::none(), empty_box()};
    if (result.dropped != kKept) return result;
    const GeometryView& geometry = geometries[result.geometry];
    if (geometry.is_custom()) {
      const std::uint32_t first = begin + i - geometry.first;
      result.contents = make_custom(geometry, first, i + 1 < size, i > 0);
      if (result.contents.exists()) result.box = leaf_box(geometry, first, result.contents);
      return result;
    }
    const unsigned other = shared.mate[i];
    if (other != kNone && other / 3 < i) return result;
    result.box = triangle_box(shared, i);
    if (other == kNone) {
      result.contents = LeafContents::make(0, 0, 0);
      return result;
    }
    grow(result.box, triangle_box(shared, other / 3));
    const unsigned own = shared.partner[other] % 3;
    result.contents = LeafContents::make(other / 3 - i, (own + 2) % 3, (other % 3 + 1) % 3);
    return result;
  }

  HIPRT_HD bool joins_next(const GeometryView& customs, std::uint32_t first) const {
    if (!pair || first + 1 >= customs.primitive_count) return false;
    const Box a = customs.box(first), b = customs.box(first + 1);
    return drop_reason(a) == kKept && drop_reason(b) == kKept && share_leaf(a, b);
  }
  /// 2 i and 2 i + 1, if both are in the window.
  HIPRT_HD LeafContents make_custom(const GeometryView& customs, std::uint32_t i, bool next_here,
                                    bool last_here) const {
    if (i % 2 == 1 && last_here && joins_next(customs, i - 1)) return LeafContents::none();
    const bool paired = i % 2 == 0 && next_here && joins_next(customs, i);
    return LeafContents::make(paired ? 1 : 0, LeafContents::kCustom, 0);
  }
};

}  // namespace hiprt::build
