/// The table of gpu_policies.h, and which device runs which code.

#include <tools/base/gpu_code.h>
#include <tools/render/tracers/gpu_policies.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::tools;

namespace {

SceneView scene_of(std::uint32_t stack_bound, float box_margin) {
  SceneView scene{};
  scene.stack_bound = stack_bound;
  scene.box_margin = box_margin;
  return scene;
}

bool any_kernel(std::size_t) { return true; }

const GpuPolicy& policy_of(std::string_view architecture, std::uint32_t stack_bound, float box_margin = 0.0f) {
  return kGpuPolicies[choose_gpu_policy(architecture, scene_of(stack_bound, box_margin), any_kernel)];
}

}  // namespace

TEST_CASE("GPU policies: every architecture has a policy for every tree") {
  for (const std::string_view architecture : {"gfx90a", "gfx1030", "gfx1100", "gfx1201", "sm_90", "sm_120"})
    for (const std::uint32_t bound : {0u, 60u, 188u, 189u, 190u, 4096u})
      for (const float margin : {0.0f, 0.5f}) {
        CAPTURE(architecture, bound, margin);
        const std::size_t chosen = choose_gpu_policy(architecture, scene_of(bound, margin), any_kernel);
        REQUIRE(chosen < kGpuPolicies.size());
        const GpuPolicy& policy = kGpuPolicies[chosen];
        CHECK(architecture.starts_with(policy.architectures));
        CHECK((policy.stack == GpuStack::kRolling || bound + kMostPushed <= kGpuPrivateStack));
        CHECK(policy.block % 64 == 0);
        CHECK((policy.boxes == GpuBoxes::kSlabs || (margin > 0 && uses_ray_instruction(architecture))));
      }
  CHECK(choose_gpu_policy("cpu", scene_of(60, 0), any_kernel) == kGpuPolicies.size());
}

TEST_CASE("GPU policies: deep trees get rolling stacks") {
  for (const std::string_view architecture : {"sm_90", "gfx90a", "gfx1100"}) {
    CAPTURE(architecture);
    CHECK(policy_of(architecture, kGpuPrivateStack - kMostPushed).stack == GpuStack::kPrivate);
    CHECK(policy_of(architecture, kGpuPrivateStack - kMostPushed + 1, 0.5f).stack == GpuStack::kRolling);
  }
}

TEST_CASE("GPU policies: AMD's ray instruction is for widened boxes, and GPUs whose descriptor is known") {
  for (const std::string_view architecture : {"gfx1030", "gfx1036", "gfx1100", "gfx1151"}) {
    CAPTURE(architecture);
    CHECK(policy_of(architecture, 60, 0.5f).boxes == GpuBoxes::kRayInstruction);
    CHECK(policy_of(architecture, 60).boxes == GpuBoxes::kSlabs);
  }
  for (const std::string_view architecture : {"gfx90a", "gfx1010", "gfx1200", "sm_103"}) {
    CAPTURE(architecture);
    CHECK(policy_of(architecture, 60, 0.5f).boxes == GpuBoxes::kSlabs);
  }
  // Without a kernel for it the next policy is taken.
  const auto by_slabs = [](std::size_t i) { return kGpuPolicies[i].boxes == GpuBoxes::kSlabs; };
  CHECK(kGpuPolicies[choose_gpu_policy("gfx1030", scene_of(60, 0.5f), by_slabs)].boxes == GpuBoxes::kSlabs);
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
