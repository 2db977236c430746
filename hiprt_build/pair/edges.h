#pragma once
/// Finds for every half-edge of a mesh the one it can be paired across. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/input.h>
#include <hiprt_build/input/leaf.h>

#include <algorithm>
#include <atomic>

namespace hiprt::build {

/// Edge k of a triangle runs from its corner k to corner (k + 1) % 3. Number: triangle * 4 + k.
using HalfEdge = std::uint32_t;

/// The corners of a triangle, and what its leaf would save by taking in a neighbour.
struct EdgeGain {
  static Float4 to_float4(const Position& p) { return Float4{p[0], p[1], p[2], 0.0f}; }

  const TriangleMesh& mesh;
  Float4 corners[3];
  SimdBox box;

  EdgeGain(const TriangleMesh& mesh_in, std::size_t triangle) : mesh(mesh_in) {
    for (unsigned k = 0; k < 3; ++k) box.add(corners[k] = to_float4(mesh.positions[mesh.triangles[triangle][k]]));
  }

  /// @return the half area that one box saves for this triangle and that of @p other. @p other is the triangle's edge k
  /// in the other direction, so its ends are known.
  float across(unsigned k, HalfEdge other) const {
    SimdBox others;
    others.add(corners[k]);
    others.add(corners[k == 2 ? 0 : k + 1]);
    const unsigned opposite = (other & 3u) == 0 ? 2 : (other & 3u) - 1;
    others.add(to_float4(mesh.positions[mesh.triangles[other >> 2][opposite]]));
    const float apart = half_area(box) + half_area(others);
    others.add(box);
    return apart - half_area(others);
  }
};

/// A half-edge filed under its end with the lower welded number.
struct ListedEdge {
  std::uint32_t far_end_and_direction;  ///< Welded number of the other end * 2, + 1 if the edge runs towards the lower.
  HalfEdge edge;
};

/// Step: files the half-edges of triangle i. Run once with entries empty to count, then again to write.
struct ListEdgesStep {
  const TriangleMesh& mesh;
  std::span<const std::uint32_t> welded;
  std::span<const std::uint8_t> dropped;
  std::span<std::uint32_t> cursor;  ///< Per vertex: number of edges (counting), or where its next one goes (writing).
  std::span<ListedEdge> entries;

  void operator()(std::size_t i) const {
    if (dropped[i] != 0) return;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t from = welded[mesh.triangles[i][k]], to = welded[mesh.triangles[i][k == 2 ? 0 : k + 1]];
      const std::uint32_t near = std::min(from, to);
      const std::uint32_t slot = std::atomic_ref(cursor[near]).fetch_add(1, std::memory_order_relaxed);
      if (!entries.empty())
        entries[slot] = {std::max(from, to) * 2 + (to < from ? 1u : 0u), static_cast<HalfEdge>(i * 4 + k)};
    }
  }
};

/// Step: partner of every half-edge filed under vertex i: opposite direction, same ends, most area saved.
/// @param ends ends[i]: one past vertex i's last entry.
struct MatchEdgesStep {
  Monitor& monitor;
  const TriangleMesh& mesh;
  std::span<const std::uint32_t> ends;
  std::span<ListedEdge> entries;
  std::span<HalfEdge> partner;  ///< [triangle * 3 + k], kInvalidId where there is none.

  /// More edges than this between two vertices are matched in order, not by area: keeps hostile input linear.
  static constexpr std::size_t kSmallFan = 4;
  /// They take about a millisecond.
  static constexpr std::size_t kComparisons = 1u << 16;

  void operator()(std::size_t i) const {
    const std::span<ListedEdge> mine = entries.subspan(i == 0 ? 0 : ends[i - 1], ends[i] - (i == 0 ? 0 : ends[i - 1]));
    // One vertex can have all the edges of a mesh.
    std::size_t compared = 0;
    std::sort(mine.begin(), mine.end(), [&](const ListedEdge& a, const ListedEdge& b) {
      if (++compared % kComparisons == 0) monitor.check();
      return a.far_end_and_direction != b.far_end_and_direction ? a.far_end_and_direction < b.far_end_and_direction
                                                                : a.edge < b.edge;
    });
    for (std::size_t begin = 0; begin < mine.size();) {
      const std::uint32_t far_end = mine[begin].far_end_and_direction >> 1;
      std::size_t middle = begin, end = begin;
      while (end < mine.size() && mine[end].far_end_and_direction >> 1 == far_end) {
        if ((mine[end].far_end_and_direction & 1u) == 0) middle = end + 1;
        ++end;
      }
      match(mine.subspan(begin, middle - begin), mine.subspan(middle, end - middle));
      begin = end;
    }
  }

  void match(std::span<const ListedEdge> forward, std::span<const ListedEdge> backward) const {
    if (std::max(forward.size(), backward.size()) > kSmallFan) {
      for (std::size_t i = 0; i < std::min(forward.size(), backward.size()); ++i)
        link(forward[i].edge, backward[i].edge);
      return;
    }
    for (const ListedEdge& edge : forward) choose(edge.edge, backward);
    for (const ListedEdge& edge : backward) choose(edge.edge, forward);
  }

  /// Whether they are of two triangles that one leaf can name.
  static bool may_pair(HalfEdge a, HalfEdge b) {
    const std::uint32_t first = std::min(a, b) >> 2, second = std::max(a, b) >> 2;
    return first != second && second - first <= LeafContents::kMaxDistance;
  }

  void link(HalfEdge a, HalfEdge b) const {
    if (!may_pair(a, b)) return;
    partner[std::size_t{a >> 2} * 3 + (a & 3u)] = b;
    partner[std::size_t{b >> 2} * 3 + (b & 3u)] = a;
  }

  void choose(HalfEdge edge, std::span<const ListedEdge> others) const {
    float best = 0.0f;
    for (const ListedEdge& other : others) {
      if (!may_pair(edge, other.edge)) continue;
      const float gain = others.size() == 1 ? 1.0f : EdgeGain(mesh, edge >> 2).across(edge & 3u, other.edge);
      if (!(gain > best)) continue;
      best = gain;
      partner[std::size_t{edge >> 2} * 3 + (edge & 3u)] = other.edge;
    }
  }
};

/// Partners of all half-edges of a mesh, [triangle * 3 + k].
/// @param dropped per triangle, non-zero: has no edges.
ScratchArray<HalfEdge> find_partners(CpuEngine& engine, const TriangleMesh& mesh,
                                     std::span<const std::uint8_t> dropped);

}  // namespace hiprt::build
