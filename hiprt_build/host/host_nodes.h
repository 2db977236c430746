#pragma once
/// Makes the eight-wide nodes of a file for the host (host_node.h). Internal.
///
/// Each node's children are joined in pairs, those with the smallest common box first. Over this binary tree dynamic
/// programming finds the eight-wide tree of least cost. Leaves are tested two at a time, so a run of two costs as much
/// as one. Source: Ylitie, Karras, Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs",
/// 2017, section 3.2.

#include <hiprt_build/format/pages.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/host/host_node.h>

#include <vector>

namespace hiprt::format_detail {

using HostNodes = std::vector<HostNode, build::PageAllocator<HostNode>>;

/// @return the nodes, the root first. Empty if the file has instances, custom primitives, another layout than planes,
/// or no box node. Also if the tree has more levels than builders make, or a ray would need more than kHostStack
/// entries. Throws std::bad_alloc.
/// @pre the file is valid
HostNodes make_host_nodes(const BufferView& file);

}  // namespace hiprt::format_detail
