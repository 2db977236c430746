#pragma once
/// Pairs triangles that the windows of pair_window.h leave single, wherever they lie in the index buffer. The edges of
/// single triangles go into a hash table, in which each triangle finds its neighbours. Two triangles that prefer each
/// other share a leaf (a handshake, as in a window). The result does not depend on the order of threads. Internal.

#include <hiprt_build/input/leaf.h>
#include <hiprt_device/math/atomic.h>

#include <bit>

namespace hiprt::build {

/// Edge k of a triangle runs from its corner k to the next. Its number is 4 * triangle + k, with triangles numbered
/// over all geometries.
struct EdgeTable {
  /// Slots of the table per primitive of all geometries: edges fill at most half of them. If few triangles are single,
  /// the table is smaller: it has kSlotsOfSingle slots per single triangle.
  static constexpr std::uint32_t kSlots = 6, kSlotsOfSingle = 16;
  /// An edge that finds no slot after so many probes is not stored. Only a mesh made for this purpose needs as many.
  static constexpr unsigned kMostProbes = 512;

  /// The number of an edge, and above it 32 bits of its hash that do not choose the slot. With them, edges that differ
  /// are seldom compared by their corners.
  using Slot = std::uint64_t;
  static constexpr Slot kEmpty = ~Slot{0};

  GeometryTable geometries;
  Slot* table;  ///< [slots_for(single triangles)], at most kSlots for each primitive; all kEmpty at first.

  HIPRT_HD std::uint32_t slots_for(std::uint32_t singles) const {
    const std::uint32_t most = kSlots * geometries.primitive_count;
    return singles < most / kSlotsOfSingle ? kSlotsOfSingle * singles : most;
  }

  /// Step: stores the edges of a single triangle in a table with @p slots slots. Of equal edges the table keeps the one
  /// with the lowest number.
  HIPRT_HD void insert(std::uint32_t triangle, std::uint32_t slots) const {
    const Corners own = load(triangle);
    Probe probe[3];
    Slot there[3];
    // All three at once, because memory latency dominates.
    for (unsigned k = 0; k < 3; ++k) {
      probe[k] = Probe(own.edge(k), slots);
      there[k] = compare_exchange(&table[probe[k].slot], kEmpty, probe[k].entry(4 * triangle + k));
    }
    for (unsigned k = 0; k < 3; ++k) {
      Probe& here = probe[k];
      for (unsigned probes = 1; there[k] != kEmpty; ++probes) {
        if (here.may_be(there[k]) && same(own.edge(k), load_edge(number(there[k])))) {
          lower(&table[here.slot], here.entry(4 * triangle + k));
          break;
        }
        if (probes == kMostProbes) break;
        here.next(slots);
        there[k] = compare_exchange(&table[here.slot], kEmpty, here.entry(4 * triangle + k));
      }
    }
  }

  /// Step: makes a pair of a single triangle and a later one if they choose each other. A choice depends on nothing
  /// that this step writes, so each thread can also compute the choice of its partner.
  /// @param references [primitives] @return whether it made a pair. @pre the edges of all single triangles are stored.
  HIPRT_HD bool shake_hands(std::uint32_t triangle, std::uint32_t slots, Reference* references) const {
    const Choice mine = choose(triangle, slots);
    if (mine.across == kInvalidId || mine.across >> 2 <= triangle) return false;
    const Choice others = choose(mine.across >> 2, slots);
    if (others.across != mine.edge || others.edge != mine.across) return false;
    Reference &first = references[triangle], &second = references[mine.across >> 2];
    first.contents =
        LeafContents::make((mine.across >> 2) - triangle, ((mine.edge & 3u) + 2) % 3, ((mine.across & 3u) + 1) % 3);
    first.box = unite(first.box, second.box);
    second.contents = LeafContents::none();
    return true;
  }

  /// @return whether a leaf holds exactly one triangle.
  HIPRT_HD static bool is_single(const Reference& leaf) {
    return leaf.contents.exists() && !leaf.contents.is_pair() && !leaf.contents.is_custom();
  }

 private:
  /// The edge across which a triangle prefers to pair, and the number of the same edge in the other triangle;
  /// kInvalidId: none.
  struct Choice {
    std::uint32_t edge, across;
  };

  /// Chooses the neighbour that saves the most area.
  HIPRT_HD Choice choose(std::uint32_t triangle, std::uint32_t slots) const {
    const Corners own = load(triangle);
    const Box own_box = box_of(own);
    Probe probe[3];
    Slot there[3];
    for (unsigned k = 0; k < 3; ++k) {
      probe[k] = Probe(own.edge(k).reversed(), slots);
      there[k] = table[probe[k].slot];
    }
    Choice choice{kInvalidId, kInvalidId};
    float best = 0.0f;
    for (unsigned k = 0; k < 3; ++k) {
      Probe& here = probe[k];
      for (unsigned probes = 1; there[k] != kEmpty; ++probes) {
        const std::uint32_t other = number(there[k]), mine = 4 * triangle + k;
        if (here.may_be(there[k]) && other >> 2 != triangle) {
          const Corners others = load(other >> 2);
          if (same(own.edge(k).reversed(), others.edge(other & 3u))) {
            const Box box = box_of(others);
            const float gain = half_area(own_box) + half_area(box) - half_area(unite(own_box, box));
            const std::uint32_t edge = mine < other ? mine : other;
            const std::uint32_t best_edge = choice.edge < choice.across ? choice.edge : choice.across;
            if (gain > best || (gain == best && edge < best_edge && gain > 0.0f)) {
              best = gain;
              choice = {mine, other};
            }
            break;
          }
        }
        if (probes == kMostProbes) break;
        here.next(slots);
        there[k] = table[here.slot];
      }
    }
    return choice;
  }

  HIPRT_HD static std::uint32_t number(Slot slot) { return static_cast<std::uint32_t>(slot); }

  struct Edge {
    Point from, to;
    std::uint32_t geometry;

    HIPRT_HD Edge reversed() const { return Edge{to, from, geometry}; }
  };
  struct Corners {
    Point v[3];
    std::uint32_t geometry;

    HIPRT_HD Edge edge(unsigned k) const {
      // Selects values, not elements: a choice of addresses would put the corners into memory.
      const Point from = k == 0 ? v[0] : k == 1 ? v[1] : v[2], to = k == 0 ? v[1] : k == 1 ? v[2] : v[0];
      return Edge{from, to, geometry};
    }
  };

  HIPRT_HD Corners load(std::uint32_t triangle) const {
    Corners corners;
    corners.geometry = geometries.find(triangle);
    const GeometryView& mesh = geometries[corners.geometry];
    for (unsigned k = 0; k < 3; ++k) corners.v[k] = corner(mesh, triangle - mesh.first, k);
    return corners;
  }
  HIPRT_HD Edge load_edge(std::uint32_t edge) const { return load(edge >> 2).edge(edge & 3u); }
  HIPRT_HD static Box box_of(const Corners& corners) {
    Box box = empty_box();
    for (const Point& v : corners.v) grow(box, v);
    return box;
  }
  HIPRT_HD static bool same(const Edge& a, const Edge& b) {
    return a.geometry == b.geometry && same_position(a.from.x, b.from.x) && same_position(a.to.x, b.to.x);
  }
  HIPRT_HD static std::uint64_t hash(const Edge& edge) {
    std::uint64_t h = edge.geometry;
    for (const Point* p : {&edge.from, &edge.to})
      for (unsigned axis = 0; axis < 3; ++axis) {
        // Adding 0 makes -0 and +0 equal.
        h = (h ^ std::bit_cast<std::uint32_t>(p->x[axis] + 0.0f)) * 0x9e3779b97f4a7c15u;
        h ^= h >> 29;
      }
    return h ^ h >> 32;
  }

  /// The slot at which the search for an edge is.
  struct Probe {
    std::uint32_t slot, tag;

    Probe() = default;
    HIPRT_HD Probe(const Edge& edge, std::uint32_t slots) {
      const std::uint64_t h = hash(edge);
      slot = static_cast<std::uint32_t>((h & 0xffffffffu) * slots >> 32);
      tag = static_cast<std::uint32_t>(h >> 32);
    }
    HIPRT_HD Slot entry(std::uint32_t edge) const { return Slot{tag} << 32 | edge; }
    HIPRT_HD bool may_be(Slot there) const { return there >> 32 == tag; }
    HIPRT_HD void next(std::uint32_t slots) { slot = slot + 1 == slots ? 0 : slot + 1; }
  };
};

}  // namespace hiprt::build
