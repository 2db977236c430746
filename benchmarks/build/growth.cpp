#include "growth.h"

#include <benchmarks/common/overlapping_meshes.h>
#include <benchmarks/common/rounds.h>
#include <tools/cli/build/build_names.h>

#include <hiprt_build/build.h>

#include <algorithm>
#include <optional>

namespace hiprt::bench {
namespace {

/// Median over the rounds of times[r] / reference[r].
double median_ratio(const std::vector<double>& times, const std::vector<double>& reference) {
  return median_speed_ratio(reference, times);
}

}  // namespace

build::Result<GrowthCell> measure_growth(const std::string& mesh, unsigned triangles, unsigned rounds) {
  const oracle::Mesh all = make_overlapping(mesh, triangles),
                     quarter = make_overlapping(mesh, std::max(1u, triangles / 4)),
                     apart = make_overlapping("scattered", triangles);
  std::optional<build::Error> error;
  const auto build_time = [&error](const oracle::Mesh& input, build::Builder builder) {
    const build::TriangleMesh view = input.view();
    return time_of([&] {
      const auto bvh = build::build({&view, 1}, {.builder = builder, .threads = 1});
      if (!bvh) error = bvh.error();
    });
  };
  GrowthCell cell{mesh, triangles, {}};
  for (const auto& [name, builder] : tools::kBuilders) {
    std::vector<Contestant> contestants;
    for (const oracle::Mesh* input : {&all, &quarter, &apart})
      contestants.push_back({std::string(name), [&, input, builder = builder] { return build_time(*input, builder); }});
    const Timings seconds = run_rounds(contestants, rounds);
    if (error) return tl::unexpected(*error);
    cell.entries.push_back({std::string(name), median(seconds[0]), median_ratio(seconds[0], seconds[1]),
                            median_ratio(seconds[0], seconds[2])});
  }
  return cell;
}

}  // namespace hiprt::bench
