#pragma once
/// Pairs triangles that the windows of pair_window.h leave single, wherever they lie in the index buffer. The edges of
/// single triangles go into a hash table, each triangle finds its neighbours there, and two triangles that prefer each
/// other share a leaf (a handshake, as in a window). The result does not depend on the order of threads. Internal.

#include <hiprt_build/input/leaf.h>
#include <hiprt_device/math/atomic.h>

#include <bit>

namespace hiprt::build {

/// Edge k of a triangle runs from its corner k to the next; number: 4 * triangle (in the numbering of all) + k.
struct EdgeTable {
  /// Slots of the table for each triangle of the geometries: edges fill half of them at most. Few single triangles take
  /// less.
  static constexpr std::uint32_t kSlots = 6, kSlotsOfSingle = 16;
  /// Edges that find no slot among so many stay unfiled. No mesh needs as many but one made for it.
  static constexpr unsigned kMostProbes = 512;

  /// 32 other bits of the edge's hash above its number, so that a look at an edge that is another one seldom needs its
  /// corners.
  using Slot = std::uint64_t;
  static constexpr Slot kEmpty = ~Slot{0};

  GeometryTable geometries;
  Slot* table;  ///< [slots_for(single triangles)], at most kSlots for each primitive; all kEmpty at first.

  HIPRT_HD std::uint32_t slots_for(std::uint32_t singles) const {
    const std::uint32_t most = kSlots * geometries.primitive_count;
    return singles < most / kSlotsOfSingle ? kSlotsOfSingle * singles : most;
  }

  /// Step: files the edges of a single triangle in the table of so many slots. Of equal ones the lowest stands in the
  /// table.
  HIPRT_HD void insert(std::uint32_t triangle, std::uint32_t slots) const {
    const Corners own = load(triangle);
    Probe probe[3];
    Slot there[3];
    // All three at a time: what takes long is memory.
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
  /// that this step writes, so that each thread can also see what its partner chooses.
  /// @param references [primitives] @return whether there is a pair. @pre all single triangles are filed.
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

  /// Whether a leaf is a triangle alone.
  HIPRT_HD static bool is_single(const Reference& leaf) {
    return leaf.contents.exists() && !leaf.contents.is_pair() && !leaf.contents.is_custom();
  }

 private:
  /// The edge across which a triangle would like to pair, and that edge of the other triangle; kInvalidId: none.
  struct Choice {
    std::uint32_t edge, across;
  };

  /// The neighbour that saves most area.
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
      // Values, not elements: a choice of addresses would put the corners into memory.
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
        // Zeros are the same with either sign.
        h = (h ^ std::bit_cast<std::uint32_t>(p->x[axis] + 0.0f)) * 0x9e3779b97f4a7c15u;
        h ^= h >> 29;
      }
    return h ^ h >> 32;
  }

  /// Where an edge is looked for.
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
