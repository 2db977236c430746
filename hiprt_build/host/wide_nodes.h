#pragma once
/// Makes the eight-wide nodes of a file for the host (hiprt_device/format/wide_node.h). Internal.
///
/// Each node's children are joined in pairs, those with the smallest common box first. Over this binary tree dynamic
/// programming finds the eight-wide tree of least cost. Leaves are tested two at a time, so a run of two costs as much
/// as one. Source: Ylitie, Karras, Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs",
/// 2017, section 3.2.

#include <hiprt_build/format/pages.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/format/wide_node.h>

#include <vector>

namespace hiprt::format_detail {

using WideNodes = std::vector<WideNode, build::PageAllocator<WideNode>>;

/// @return the nodes, the root first. Empty if the file has instances, custom primitives, another layout than planes,
/// or no box node. Also if the tree has more levels than builders make, or a ray would need more stack entries than a
/// PrivateStack has. Throws std::bad_alloc.
/// @pre the file is valid
WideNodes make_wide_nodes(const BufferView& file);

}  // namespace hiprt::format_detail
