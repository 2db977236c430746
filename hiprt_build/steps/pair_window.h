#pragma once
/// Pairs of triangles among 32 that lie next to each other in the index buffer: as pair.h pairs them, without looking
/// further. Internal.

#include <hiprt_build/steps/soup_view.h>

#include <bit>

namespace hiprt::build {

inline constexpr unsigned kPairWindow = 32;
/// Rounds of handshakes.
inline constexpr unsigned kPairRounds = 4;
/// As kCustomPairArea (pair.h).
inline constexpr float kPairedBoxArea = 1.25f;

/// @tparam Group the lanes that work on a window: see exec/group.h.
template <class Group> struct PairWindow {
  static constexpr unsigned kEdges = 3 * kPairWindow;
  static constexpr std::uint8_t kNone = 0xff;

  /// Shared by the lanes of a group. Edge 3 i + k runs from corner k of triangle i.
  struct Shared {
    std::uint64_t key[kEdges];                            ///< Of the edge, direction included; 0: cannot be paired.
    float gain[kEdges];                                   ///< Area saved by pairing across it.
    std::uint8_t partner[kEdges];                         ///< The edge of another triangle, or kNone.
    std::uint8_t choice[kPairWindow], mate[kPairWindow];  ///< Edges of the triangle, and of the other one.
  };

  SoupView soup;
  bool pair;

  /// emit(primitive, geometry, fate, group) for each of the window's primitives; group.exists() for those that are the
  /// lower of their leaf.
  template <class Emit>
  HIPRT_HD void operator()(const Group& group, Shared& shared, std::uint32_t window, Emit&& emit) const {
    const std::uint32_t begin = window * kPairWindow;
    const std::uint32_t left = soup.primitives - begin, size = left < kPairWindow ? left : kPairWindow;
    group.for_each(kPairWindow, [&](unsigned i) { file(shared, begin, i, size); });
    group.sync();
    if (pair) {
      group.for_each(kEdges, [&](unsigned e) { find_partner(shared, begin, e); });
      group.sync();
      for (unsigned round = 0; round < kPairRounds; ++round) {
        group.for_each(kPairWindow, [&](unsigned i) { choose(shared, i); });
        group.sync();
        group.for_each(kPairWindow, [&](unsigned i) { shake_hands(shared, i); });
        group.sync();
      }
    }
    group.for_each(size, [&](unsigned i) {
      const std::uint32_t g = soup.find(begin + i);
      const PrimitiveFate fate = classify(soup.geometries[g], begin + i - soup.geometries[g].first);
      emit(begin + i, g, fate, fate == PrimitiveFate::kKept ? make(shared, begin, i, size, g) : PackedGroup{});
    });
    group.sync();
  }

 private:
  HIPRT_HD static std::uint64_t hash(const Point& p) {
    std::uint64_t h = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      h = (h ^ std::bit_cast<std::uint32_t>(p.x[axis])) * 0x9e3779b97f4a7c15u;
      h ^= h >> 29;
    }
    return h;
  }
  /// Not symmetric in its ends.
  HIPRT_HD static std::uint64_t edge_key(const Point& from, const Point& to) {
    return (hash(from) * 3 + hash(to)) | 1u;
  }

  HIPRT_HD void file(Shared& shared, std::uint32_t begin, unsigned i, unsigned size) const {
    shared.mate[i] = kNone;
    for (unsigned k = 0; k < 3; ++k) {
      shared.key[3 * i + k] = 0;
      shared.partner[3 * i + k] = kNone;
    }
    if (!pair || i >= size) return;
    const GeometryView& mesh = soup.geometries[soup.find(begin + i)];
    const std::uint32_t triangle = begin + i - mesh.first;
    if (mesh.is_custom() || classify_triangle(mesh, triangle) != PrimitiveFate::kKept) return;
    const Point a = corner(mesh, triangle, 0), b = corner(mesh, triangle, 1), c = corner(mesh, triangle, 2);
    shared.key[3 * i] = edge_key(a, b);
    shared.key[3 * i + 1] = edge_key(b, c);
    shared.key[3 * i + 2] = edge_key(c, a);
  }

  HIPRT_HD void find_partner(Shared& shared, std::uint32_t begin, unsigned e) const {
    const unsigned i = e / 3, k = e % 3;
    if (shared.key[e] == 0) return;
    const std::uint32_t g = soup.find(begin + i);
    const GeometryView& mesh = soup.geometries[g];
    const std::uint32_t mine = begin + i - mesh.first;
    const Point from = corner(mesh, mine, k), to = corner(mesh, mine, k == 2 ? 0 : k + 1);
    const std::uint64_t wanted = edge_key(to, from);
    for (unsigned other = 0; other < kEdges; ++other) {
      if (shared.key[other] != wanted || other / 3 == i || soup.find(begin + other / 3) != g) continue;
      const std::uint32_t triangle = begin + other / 3 - mesh.first;
      const unsigned j = other % 3;
      if (!same(corner(mesh, triangle, j), to) || !same(corner(mesh, triangle, j == 2 ? 0 : j + 1), from)) continue;
      shared.partner[e] = static_cast<std::uint8_t>(other);
      shared.gain[e] = shared_area(mesh, mine, triangle);
      return;
    }
  }

  HIPRT_HD static Box triangle_box(const GeometryView& mesh, std::uint32_t triangle) {
    Box box = empty_box();
    for (unsigned k = 0; k < 3; ++k) grow(box, corner(mesh, triangle, k));
    return box;
  }
  HIPRT_HD static float shared_area(const GeometryView& mesh, std::uint32_t a, std::uint32_t b) {
    const Box box_a = triangle_box(mesh, a), box_b = triangle_box(mesh, b);
    return half_area(box_a) + half_area(box_b) - half_area(unite(box_a, box_b));
  }

  HIPRT_HD void choose(Shared& shared, unsigned i) const {
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

  HIPRT_HD void shake_hands(Shared& shared, unsigned i) const {
    const unsigned edge = shared.choice[i];
    if (edge == kNone) return;
    const unsigned other = shared.partner[edge];
    if (shared.choice[other / 3] == other && shared.partner[other] == edge)
      shared.mate[i] = static_cast<std::uint8_t>(other);
  }

  HIPRT_HD PackedGroup make(const Shared& shared, std::uint32_t begin, unsigned i, unsigned size,
                            std::uint32_t geometry) const {
    const GeometryView& mesh = soup.geometries[geometry];
    if (mesh.is_custom()) return make_custom(mesh, begin + i - mesh.first, i + 1 < size, i > 0);
    const unsigned other = shared.mate[i];
    if (other == kNone) return PackedGroup::make(0, 0, 0);
    if (other / 3 < i) return PackedGroup{};
    const unsigned own = shared.partner[other] % 3;
    return PackedGroup::make(other / 3 - i, (own + 2) % 3, (other % 3 + 1) % 3);
  }

  HIPRT_HD bool share_leaf(const GeometryView& customs, std::uint32_t first) const {
    if (!pair || first + 1 >= customs.primitives) return false;
    const Box &a = customs.boxes[first], &b = customs.boxes[first + 1];
    if (classify_box(a) != PrimitiveFate::kKept || classify_box(b) != PrimitiveFate::kKept) return false;
    return half_area(unite(a, b)) <= kPairedBoxArea * (half_area(a) + half_area(b));
  }
  /// 2 i and 2 i + 1, if both are in the window.
  HIPRT_HD PackedGroup make_custom(const GeometryView& customs, std::uint32_t i, bool next_here, bool last_here) const {
    if (i % 2 == 1 && last_here && share_leaf(customs, i - 1)) return PackedGroup{};
    const bool paired = i % 2 == 0 && next_here && share_leaf(customs, i);
    return PackedGroup::make(paired ? 1 : 0, PackedGroup::kCustom, 0);
  }
};

}  // namespace hiprt::build
