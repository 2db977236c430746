/// The steps of a wave of paths. Compiled once per instruction set (HIPRT_ISA_NAME).

#include <tools/render/path/path_steps.h>

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)
#define HIPRT_RUN_STEP HIPRT_JOIN(run_step_, HIPRT_ISA_NAME)

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {
namespace {

template <class Step> void for_all(std::uint32_t count, const Step& step) {
  for (std::uint32_t i = 0; i < count; ++i) step(i);
}

}  // namespace
}  // namespace HIPRT_ISA_NAMESPACE

void HIPRT_RUN_STEP(PathStage stage, const PathJob& job, std::uint32_t count, const PathSurface* told);

void HIPRT_RUN_STEP(PathStage stage, const PathJob& job, std::uint32_t count, const PathSurface* told) {
  switch (stage) {
    case PathStage::kBegin:
      return for_all(count, BeginPaths(job));
    case PathStage::kShade:
      return told == nullptr ? for_all(count, ShadePaths(job)) : for_all(count, Shade<ToldSurfaces>(job, {told}));
    case PathStage::kAddLight:
      return for_all(count, AddLight(job));
    case PathStage::kSum:
      return for_all(count, SumPaths(job));
  }
}

}  // namespace hiprt::tools
