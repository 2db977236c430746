/// Vulkan's builds on any device, also on a CPU. Without a device the test skips itself.

#include "vulkan_builds.h"

#include <benchmarks/common/procedural.h>

#include <algorithm>
#include <iostream>

namespace hiprt::bench {
namespace {

int faults = 0;

void expect(bool good, const std::string& what) {
  if (good) return;
  std::cout << "FAILED: " << what << "\n";
  ++faults;
}

void check(const std::string& name, const build::Result<VulkanBuilds>& builds, bool compacted) {
  if (!builds) return expect(false, name + ": " + builds.error().message);
  constexpr std::size_t kRepeats = 3;
  const VulkanBytes& bytes = builds->bytes;
  const auto positive = [](double ms) { return ms > 0; };
  expect(builds->bottom_ms.size() == kRepeats && builds->top_ms.size() == kRepeats, name + ": one time per repeat");
  expect(std::all_of(builds->bottom_ms.begin(), builds->bottom_ms.end(), positive), name + ": build times");
  expect(builds->compaction_ms.size() == (compacted ? kRepeats : 0), name + ": times of compaction");
  expect(bytes.scratch > 0 && bytes.built > 0 && bytes.now > 0, name + ": bytes");
  expect(compacted ? bytes.now <= bytes.built : bytes.now == bytes.built, name + ": bytes after compaction");
}

int run() {
  VulkanOptions options{.modes = vulkan_modes(), .device = {}, .calls = "query"};
  const auto machine = open_chosen(options, false);
  if (!machine) {
    std::cout << "SKIPPED: " << machine.error().message << "\n";
    return 77;
  }
  const tools::Mesh mesh = procedural_mesh(20000), larger = procedural_mesh(40000);
  const build::TriangleMesh input{.positions = mesh.positions, .triangles = mesh.triangles};
  const build::TriangleMesh more{.positions = larger.positions, .triangles = larger.triangles};
  for (const std::string& mode : vulkan_modes())
    for (const bool compacted : {false, true})
      check(mode + (compacted ? ", compacted" : ""), measure_vulkan(**machine, input, mode, compacted, 3), compacted);
  const auto few = measure_vulkan(**machine, input, "fast_trace", true, 1);
  const auto many = measure_vulkan(**machine, more, "fast_trace", true, 1);
  expect(few && many && few->bytes.now < many->bytes.now, "more triangles need more bytes");
  std::cout << faults << " faults\n";
  return faults == 0 ? 0 : 1;
}

}  // namespace
}  // namespace hiprt::bench

int main() { return hiprt::bench::run(); }
