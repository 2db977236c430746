#pragma once
/// Pairs of triangles that the windows of pair_window.h leave single, wherever they lie in the index buffer: the edges
/// of single triangles are filed in a hash table, each triangle finds its neighbours there, and two that prefer each
/// other share a leaf (handshakes, as in a window). The result does not depend on the order of threads. Internal.

#include <hiprt_build/steps/soup_view.h>
#include <hiprt_device/atomic.h>

#include <bit>

namespace hiprt::build {

/// Rounds of handshakes beyond the windows.
inline constexpr unsigned kBeyondRounds = 2;

/// Edge k of a triangle runs from its corner k to the next; number: 4 * triangle (in the numbering of all) + k.
struct PairBeyond {
  /// Slots of the table for each single triangle: its edges fill half of them at most.
  static constexpr std::uint32_t kSlots = 6;
  /// Edges that find no slot among so many stay unfiled. No mesh needs as many but one made for it.
  static constexpr unsigned kMostProbes = 512;

  SoupView soup;
  LeafReference* references;  ///< [primitives]
  std::uint32_t* table;       ///< [kSlots * single triangles], edges or kInvalidId.
  std::uint32_t* partners;    ///< [3 * primitives]: the edge across each edge of a single triangle, or kInvalidId.
  std::uint32_t* choices;     ///< [primitives]: the edge that a single triangle would like to pair across.

  /// Step: files the edges of a single triangle. Of equal ones the lowest stands in the table.
  HIPRT_HD void file(std::uint32_t triangle, std::uint32_t singles) const {
    const TriangleCorners corners = load(triangle);
    for (unsigned k = 0; k < 3; ++k) {
      const Edge edge{corners.v[k], corners.v[k == 2 ? 0 : k + 1], soup.find(triangle)};
      const std::uint32_t number = 4 * triangle + k;
      probe(edge, singles, [&](std::uint32_t& slot) {
        std::uint32_t there = load_shared(&slot);
        if (there == kInvalidId) there = compare_exchange(&slot, kInvalidId, number);
        if (there == kInvalidId) return true;
        if (!same(edge, load_edge(there))) return false;
        lower(&slot, number);
        return true;
      });
    }
  }

  /// Step: the triangles across the edges of a single one. @pre all are filed.
  HIPRT_HD void find_partners(std::uint32_t triangle, std::uint32_t singles) const {
    const TriangleCorners corners = load(triangle);
    for (unsigned k = 0; k < 3; ++k) {
      const Edge wanted{corners.v[k == 2 ? 0 : k + 1], corners.v[k], soup.find(triangle)};
      std::uint32_t found = kInvalidId;
      probe(wanted, singles, [&](const std::uint32_t& slot) {
        if (slot == kInvalidId) return true;
        if (slot >> 2 == triangle || !same(wanted, load_edge(slot))) return false;
        found = slot;
        return true;
      });
      partners[3 * std::uint64_t{triangle} + k] = found;
    }
  }

  /// Step: the neighbour that a single triangle would like to share a leaf with: the one whose box saves most area.
  HIPRT_HD void choose(std::uint32_t triangle) const {
    std::uint32_t choice = kInvalidId, best_edge = kInvalidId;
    float best = 0.0f;
    const LeafReference own = references[triangle];
    for (unsigned k = 0; is_single(own) && k < 3; ++k) {
      const std::uint32_t other = partners[3 * std::uint64_t{triangle} + k];
      if (other == kInvalidId) continue;
      const LeafReference others = references[other >> 2];
      if (!is_single(others)) continue;
      const float gain = half_area(own.box) + half_area(others.box) - half_area(unite(own.box, others.box));
      const std::uint32_t mine = 4 * triangle + k, edge = mine < other ? mine : other;
      if (!(gain > best || (gain == best && edge < best_edge && gain > 0.0f))) continue;
      best = gain;
      best_edge = edge;
      choice = other;
    }
    choices[triangle] = choice;
  }

  /// Step: makes a pair of a triangle and a later one that chose each other. @return whether it did.
  HIPRT_HD bool shake_hands(std::uint32_t triangle) const {
    const std::uint32_t other = choices[triangle];
    if (other == kInvalidId || other >> 2 <= triangle) return false;
    const std::uint32_t mine = choices[other >> 2];
    if (mine == kInvalidId || mine >> 2 != triangle || partners[3 * std::uint64_t{triangle} + (mine & 3u)] != other ||
        partners[3 * std::uint64_t{other >> 2} + (other & 3u)] != mine)
      return false;
    LeafReference &first = references[triangle], &second = references[other >> 2];
    first.group = PackedGroup::make((other >> 2) - triangle, ((mine & 3u) + 2) % 3, ((other & 3u) + 1) % 3);
    first.box = unite(first.box, second.box);
    second.group = PackedGroup::none();
    return true;
  }

  /// Whether a leaf is a triangle alone.
  HIPRT_HD static bool is_single(const LeafReference& leaf) {
    return leaf.group.exists() && !leaf.group.is_pair() && !leaf.group.is_custom();
  }

 private:
  struct Edge {
    Point from, to;
    std::uint32_t geometry;
  };

  HIPRT_HD TriangleCorners load(std::uint32_t triangle) const {
    const GeometryView& mesh = soup.geometries[soup.find(triangle)];
    TriangleCorners corners;
    for (unsigned k = 0; k < 3; ++k) corners.v[k] = corner(mesh, triangle - mesh.first, k);
    return corners;
  }
  HIPRT_HD Edge load_edge(std::uint32_t number) const {
    const std::uint32_t triangle = number >> 2, k = number & 3u, geometry = soup.find(triangle);
    const GeometryView& mesh = soup.geometries[geometry];
    return Edge{corner(mesh, triangle - mesh.first, k), corner(mesh, triangle - mesh.first, k == 2 ? 0 : k + 1),
                geometry};
  }
  HIPRT_HD static bool same(const Edge& a, const Edge& b) {
    return a.geometry == b.geometry && same_position(a.from.x, b.from.x) && same_position(a.to.x, b.to.x);
  }
  HIPRT_HD static std::uint64_t hash(const Edge& edge) {
    std::uint64_t h = edge.geometry;
    for (const Point* p : {&edge.from, &edge.to})
      for (unsigned axis = 0; axis < 3; ++axis) {
        // Zeros are the same with either sign.
        h = (h ^ std::bit_cast<std::uint32_t>(p->x[axis] + 0.0f)) * 0x9e3779b97f4a7c15u;
        h ^= h >> 29;
      }
    return h ^ h >> 32;
  }
  /// visit(slot) from the edge's first slot on, until it says that this is enough.
  template <class Visit> HIPRT_HD void probe(const Edge& edge, std::uint32_t singles, Visit&& visit) const {
    const std::uint32_t slots = kSlots * singles;
    auto slot = static_cast<std::uint32_t>((hash(edge) & 0xffffffffu) * slots >> 32);
    for (unsigned probes = 0; probes < kMostProbes && !visit(table[slot]); ++probes)
      slot = slot + 1 == slots ? 0 : slot + 1;
  }
};

}  // namespace hiprt::build
