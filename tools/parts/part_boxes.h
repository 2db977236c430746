#pragma once
/// Boxes that together hold a part of a scene.

#include <hiprt_build/format/view.h>

#include <cstddef>
#include <vector>

namespace hiprt::tools {

/// Boxes of the file's tree, and of the trees of its objects where instances put them. Together they enclose everything
/// that can be hit, at all times. So a ray with a hit passes the traversal's box test of one of them.
/// @param file whose content is valid. @param most at least 1.
/// @return the largest boxes are opened, until there are no more than @p most. Empty for an empty tree.
std::vector<Box> boxes_near_root(const BufferView& file, std::size_t most);

}  // namespace hiprt::tools
