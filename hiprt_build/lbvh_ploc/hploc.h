#pragma once
/// Merges clusters while climbing the hierarchy of Morton codes. Internal.
///
/// Benthin, Meister, Barczak, Mehalwal, Tsakok, Kensler, "H-PLOC: Hierarchical parallel locally-ordered clustering for
/// bounding volume hierarchy construction", 2024. A node of the hierarchy with more than 16 leaves takes up to 16
/// clusters of either half and joins the nearest of them until 16 are left. The root joins all.

#include <hiprt_build/lbvh_ploc/climb.h>
#include <hiprt_build/lbvh_ploc/cluster.h>

namespace hiprt::build {

inline constexpr unsigned kHplocKept = 16;
inline constexpr unsigned kHplocClusters = 2 * kHplocKept;
static_assert(kHplocClusters <= 32, "short_nearness()");

/// Where clusters are kept between nodes: those of a range of leaves from its first leaf's position on.
struct KeptCluster {
  LinkedRef ref;  ///< kInvalidId: none, nor behind it.
  std::uint32_t free;
};

/// @tparam Group the lanes that work on a node together: see exec/group.h.
/// @tparam Tree a LinkedTree.
template <class Group, class Tree> struct Hploc {
  /// Shared by the lanes of a group.
  struct Shared {
    typename Group::template Array<Cluster, kHplocClusters> clusters;
    std::uint32_t nearest[kHplocClusters];
  };

  Tree tree;
  std::uint32_t leaves;
  const std::uint8_t* levels;
  std::uint32_t* met;
  KeptCluster* kept;
  std::uint32_t radius;  ///< Places to either side in which a cluster looks for its nearest.

  /// Climbs from leaf i; all lanes of the group call it together. @param i leaves or more: only helps.
  HIPRT_HD void operator()(const Group& group, Shared& shared, std::uint32_t i) const {
    Climb climb(i);
    bool climbs = i < leaves;
    if (climbs && leaves == 1) *tree.root = kLinkedLeaf;
    climbs = climbs && leaves > 1;
    while (group.any(climbs)) {
      std::uint32_t boundary = kInvalidId;
      if (climbs) boundary = climb.up(leaves, levels, met, [](std::uint32_t, bool) {});
      climbs = boundary != kInvalidId;
      const bool root = climbs && climb.count() == leaves;
      group.for_lanes_with(root || (climbs && climb.count() > kHplocKept), [&](unsigned lane) {
        merge(group, shared, group.from(lane, climb.first), group.from(lane, boundary), group.from(lane, climb.last));
      });
      climbs = climbs && !root;
    }
  }

 private:
  HIPRT_HD void merge(const Group& group, Shared& shared, std::uint32_t first, std::uint32_t boundary,
                      std::uint32_t last) const {
    unsigned count = load(group, shared, first, boundary, 0);
    count += load(group, shared, boundary + 1, last, count);
    group.sync();
    const bool root = last - first + 1 == leaves;
    const unsigned wanted = root ? 1 : kHplocKept;
    while (count > wanted) {
      find_nearest(group, shared, count);
      count = join(group, shared, count);
    }
    if (root) {
      group.for_each(1, [&](unsigned) { *tree.root = shared.clusters[0].ref; });
      return;
    }
    group.for_each(kHplocKept, [&](unsigned k) {
      kept[first + k] = k < count ? KeptCluster{shared.clusters[k].ref, shared.clusters[k].free}
                                  : KeptCluster{kInvalidId, kInvalidId};
    });
    group.sync();
  }

  /// The clusters of leaves [first, last]. @return how many they are, at most kHplocKept.
  HIPRT_HD unsigned load(const Group& group, Shared& shared, std::uint32_t first, std::uint32_t last,
                         unsigned to) const {
    const std::uint32_t size = last - first + 1;
    return group.count(size < kHplocKept ? size : kHplocKept, [&](unsigned k) {
      // Ranges that have never been merged keep every leaf.
      const KeptCluster cluster =
          size <= kHplocKept ? KeptCluster{(first + k) | kLinkedLeaf, first + k} : kept[first + k];
      if (cluster.ref == kInvalidId) return false;
      shared.clusters[to + k] = Cluster{tree.box(cluster.ref), cluster.ref, cluster.free};
      return true;
    });
  }

  HIPRT_HD void find_nearest(const Group& group, Shared& shared, unsigned count) const {
    group.for_each(count, [&](unsigned i) { shared.nearest[i] = 0xffffffffu; });
    group.sync();
    group.for_each(count, [&](unsigned i) {
      const Box box = shared.clusters[i].box;
      for (unsigned j = i + 1; j < count && j <= i + radius; ++j) {
        const std::uint32_t key = short_nearness(box, shared.clusters[j].box, i, j);
        group.lower(shared.nearest[i], key);
        group.lower(shared.nearest[j], key);
      }
    });
    group.sync();
  }

  /// Joins clusters that chose each other. @return how many clusters are left.
  HIPRT_HD unsigned join(const Group& group, Shared& shared, unsigned count) const {
    const unsigned left = group.compact(count, shared.clusters, [&](unsigned i, Cluster& cluster) {
      const unsigned j = i ^ (shared.nearest[i] & (kHplocClusters - 1));
      if ((shared.nearest[j] & (kHplocClusters - 1)) != (i ^ j)) return true;
      if (j < i) return false;
      cluster = build::join(tree, cluster, shared.clusters[j]);
      return true;
    });
    group.sync();
    return left;
  }
};

}  // namespace hiprt::build
