// The library without Embree. check_ranges() refuses its builders.

#include <hiprt_build/embree/embree.h>

namespace hiprt::build {

const char* embree_version() { return ""; }

Result<DepthFirstTree> build_embree(CpuEngine&, Builder, const GeometryTable&, ScratchArray<Reference>, double) {
  return tl::unexpected(Error{ErrorCode::kInvalidInput, "this library was built without Embree"});
}

}  // namespace hiprt::build
