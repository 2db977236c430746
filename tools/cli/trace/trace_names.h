#pragma once
/// Words for the choices of a tracer on command lines.

#include <tools/base/names.h>
#include <tools/render/tracers/tracer.h>

namespace hiprt::tools {

inline constexpr Names<Query, 2> kQueries{{{"closest", Query::kClosest}, {"any", Query::kAny}}};
inline constexpr Names<TriangleTestKind, 3> kTriangleTests{{{"watertight", TriangleTestKind::kWatertight},
                                                            {"fast", TriangleTestKind::kFast},
                                                            {"reference", TriangleTestKind::kReference}}};
inline constexpr Names<BoxTestKind, 2> kBoxTests{
    {{"conservative", BoxTestKind::kConservative}, {"plain", BoxTestKind::kPlain}}};

}  // namespace hiprt::tools
