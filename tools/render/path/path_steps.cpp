#include <tools/render/path/path_steps.h>

#include <hiprt_build/host/isa.h>

#include <string_view>

namespace hiprt::tools {

#define HIPRT_ISA(name) \
  void run_step_##name(PathStage stage, const PathJob& job, std::uint32_t count, const PathSurface* told);
HIPRT_ISA_LIST
#undef HIPRT_ISA

namespace {

struct Isa {
  std::string_view name;
  void (*run)(PathStage stage, const PathJob& job, std::uint32_t count, const PathSurface* told);
};

/// Worst first.
constexpr Isa kIsas[] = {
#define HIPRT_ISA(name) {#name, &run_step_##name},
    HIPRT_ISA_LIST
#undef HIPRT_ISA
};

}  // namespace

void run_step(PathStage stage, const PathJob& job, std::uint32_t count, const PathSurface* told) {
  static const Isa& chosen = format_detail::best_isa(kIsas);
  chosen.run(stage, job, count, told);
}

}  // namespace hiprt::tools
