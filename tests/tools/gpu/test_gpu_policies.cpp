/// The table of gpu_policies.h, and which device runs which code.

#include <tools/base/gpu_code.h>
#include <tools/render/tracers/gpu_policies.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::tools;

TEST_CASE("GPU policies: every architecture has a policy for every tree") {
  for (const std::string_view architecture : {"gfx90a", "gfx1030", "gfx1100", "sm_90", "sm_120"})
    for (const std::uint32_t bound : {0u, 60u, 189u, 190u, 4096u}) {
      CAPTURE(architecture, bound);
      const std::size_t chosen = choose_gpu_policy(architecture, bound);
      REQUIRE(chosen < kGpuPolicies.size());
      const GpuPolicy& policy = kGpuPolicies[chosen];
      CHECK(architecture.starts_with(policy.architectures));
      CHECK((policy.stack == GpuStack::kRolling || bound + kMostPushed <= kGpuPrivateStack));
      CHECK(policy.block % 64 == 0);
    }
  CHECK(choose_gpu_policy("cpu", 60) == kGpuPolicies.size());
}

TEST_CASE("GPU policies: an H200 uses private stacks, and rolling stacks for deep trees; AMD uses rolling stacks") {
  CHECK(kGpuPolicies[choose_gpu_policy("sm_90", 189)].stack == GpuStack::kPrivate);
  CHECK(kGpuPolicies[choose_gpu_policy("sm_90", 190)].stack == GpuStack::kRolling);
  CHECK(kGpuPolicies[choose_gpu_policy("gfx1100", 10)].stack == GpuStack::kRolling);
}

TEST_CASE("GPU policies: AMD devices run code of their own architecture, NVIDIA's of lower minor versions too") {
  CHECK(runs_code_for_one_of("gfx1030", "gfx1030"));
  CHECK(runs_code_for_one_of("gfx1030", "gfx90a gfx1030 gfx1100"));
  CHECK_FALSE(runs_code_for_one_of("gfx1031", "gfx90a gfx1030 gfx1100"));
  CHECK_FALSE(runs_code_for_one_of("gfx90", "gfx90a"));
  CHECK_FALSE(runs_code_for_one_of("gfx90c", "gfx90a"));
  CHECK(runs_code_for_one_of("sm_90", "sm_80 sm_90"));
  CHECK(runs_code_for_one_of("sm_86", "sm_80"));
  CHECK_FALSE(runs_code_for_one_of("sm_80", "sm_86"));
  CHECK_FALSE(runs_code_for_one_of("sm_90", "sm_80"));
  CHECK_FALSE(runs_code_for_one_of("sm_90", "sm_9"));
  CHECK(runs_code_for_one_of("sm_90", "sm_90a"));
  CHECK_FALSE(runs_code_for_one_of("sm_91", "sm_90a"));
  CHECK(runs_code_for_one_of("sm_121", "sm_120"));
  CHECK_FALSE(runs_code_for_one_of("sm_120", "sm_100"));
  CHECK_FALSE(runs_code_for_one_of("sm_90", ""));
}
