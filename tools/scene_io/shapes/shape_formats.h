#pragma once
/// One reader per format of shapes, over the bytes of a whole file. For load_shapes(), which adds the path to messages
/// and turns exceptions into errors; readers may throw std::bad_alloc.

#include <tools/base/interrupt.h>
#include <tools/scene_io/shapes/shape_import.h>

namespace hiprt::tools {

build::Result<ShapeSet> read_hair(std::span<const std::byte> bytes);
build::Result<ShapeSet> read_xyzr(std::span<const std::byte> bytes);

}  // namespace hiprt::tools
