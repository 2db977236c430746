#pragma once
/// Words for the modes of bvhrender.

#include <tools/base/names.h>
#include <tools/render/studio/render.h>

namespace hiprt::tools {

inline constexpr Names<RenderMode, 5> kRenderModes{{{"ao", RenderMode::kAo},
                                                    {"primary", RenderMode::kPrimary},
                                                    {"normals", RenderMode::kNormals},
                                                    {"heatmap", RenderMode::kHeatmap},
                                                    {"bvh", RenderMode::kBoxes}}};

}  // namespace hiprt::tools
