#include "growth.h"

#include <benchmarks/common/rounds.h>
#include <tests/oracle/odd_meshes.h>
#include <tools/cli/build/build_names.h>

#include <hiprt_build/build.h>

#include <algorithm>
#include <optional>

namespace hiprt::bench {
namespace {

constexpr std::uint64_t kSeed = 1;
/// Small enough that few boxes of a million overlap.
constexpr double kScatteredSize = 0.01;

oracle::Mesh make_mesh(const std::string& name, unsigned triangles) {
  if (name == "soup") return oracle::soup(triangles, 1.0, kSeed);
  if (name == "concentric") return oracle::concentric(triangles, kSeed);
  if (name == "cables") return oracle::cables(triangles, kSeed);
  return oracle::fan(triangles);
}

/// Median over the rounds of times[r] / reference[r].
double median_ratio(const std::vector<double>& times, const std::vector<double>& reference) {
  return median_speed_ratio(reference, times);
}

}  // namespace

build::Result<GrowthCell> measure_growth(const std::string& mesh, unsigned triangles, unsigned rounds) {
  const oracle::Mesh all = make_mesh(mesh, triangles), quarter = make_mesh(mesh, std::max(1u, triangles / 4)),
                     apart = oracle::soup(triangles, kScatteredSize, kSeed);
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
