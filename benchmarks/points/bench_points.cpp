/// bench_points: closest points of one thread, by hiprt and by Embree's rtcPointQuery, side by side in one process.
///
/// Embree calls a function of the program for each triangle. Here it is the usual test of regions in float (Ericson,
/// "Real-Time Collision Detection", 2005, 5.1.5).

#include "kernel.h"

#include <benchmarks/common/embree_scene.h>
#include <benchmarks/common/program.h>
#include <benchmarks/common/random.h>
#include <benchmarks/common/rounds.h>
#include <benchmarks/common/scenes.h>
#include <benchmarks/common/summary.h>

#include <hiprt_build/build.h>
#include <hiprt_device/math/vec_functions.h>
#include <tools/render/tracers/tracer.h>

#include <algorithm>
#include <cmath>
#include <iostream>

namespace hiprt::bench {

#define HIPRT_ISA(name) void bench_points_##name(const PointJob& job);
HIPRT_ISA_LIST
#undef HIPRT_ISA

namespace {

struct PointOptions {
  SceneOptions scenes;
  unsigned points = 20'000;
  unsigned rounds = 9;
};

/// Where the points are.
constexpr const char* kKinds[] = {"near", "within", "around"};

struct Row {
  std::string scene, kind;
  double embree = 0.0;             ///< Nanoseconds per point.
  double best = 0.0, least = 0.0;  ///< hiprt, by the best and the least instruction set.
  double best_ratio = 0.0, least_ratio = 0.0;
  double largest_difference = 0.0;  ///< Of distances, in diagonals of the scene.
};

Vec3 vertex(const tools::Mesh& mesh, std::uint32_t i) {
  return {mesh.positions[i][0], mesh.positions[i][1], mesh.positions[i][2]};
}

/// near: 1 % of the diagonal from the surface. within: in the scene's bounds. around: in bounds three times as large.
std::vector<Vec3> make_points(const tools::Mesh& mesh, const Box& bounds, const std::string& kind, unsigned count) {
  const Vec3 low(bounds.min[0], bounds.min[1], bounds.min[2]), high(bounds.max[0], bounds.max[1], bounds.max[2]);
  const Vec3 middle = 0.5f * (low + high), half = 0.5f * (high - low);
  Random random(20261127);
  const auto any = [&] { return static_cast<float>(random.between(-1, 1)); };
  std::vector<Vec3> points(count);
  for (Vec3& point : points) {
    const float x = any(), y = any(), z = any();
    const Vec3 offset(x, y, z);
    if (kind == "near")
      point = vertex(mesh, mesh.triangles[random.below(static_cast<std::uint32_t>(mesh.triangles.size()))][0]) +
              0.01f * glm::length(half) * offset;
    else
      point = middle + (kind == "within" ? 1.0f : 3.0f) * half * offset;
  }
  return points;
}

Vec3 closest_in_regions(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const float d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap), d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp),
              d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const float vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const float scale = 1.0f / (va + vb + vc);
  return a + vb * scale * ab + vc * scale * ac;
}

bool on_triangle(RTCPointQueryFunctionArguments* arguments) {
  const auto& mesh = *static_cast<const tools::Mesh*>(arguments->userPtr);
  const build::Triangle& t = mesh.triangles[arguments->primID];
  const Vec3 p(arguments->query->x, arguments->query->y, arguments->query->z);
  const float distance =
      glm::length(p - closest_in_regions(p, vertex(mesh, t[0]), vertex(mesh, t[1]), vertex(mesh, t[2])));
  if (!(distance < arguments->query->radius)) return false;
  arguments->query->radius = distance;
  return true;
}

void ask_embree(RTCScene scene, const tools::Mesh& mesh, const std::vector<Vec3>& points,
                std::vector<float>& distances) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    RTCPointQuery query{points[i].x, points[i].y, points[i].z, 0.0f, std::numeric_limits<float>::infinity()};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene, &query, &context, on_triangle, const_cast<tools::Mesh*>(&mesh));
    distances[i] = query.radius;
  }
}

struct Isa {
  std::string_view name;
  void (*run)(const PointJob& job);
};
constexpr Isa kIsas[] = {
#define HIPRT_ISA(name) {#name, &bench_points_##name},
    HIPRT_ISA_LIST
#undef HIPRT_ISA
};

const Isa& best_isa() {
  const Isa* chosen = &kIsas[0];
  for (const Isa& isa : kIsas)
    if (isa.name == tools::trace_isa()) chosen = &isa;
  return *chosen;
}

Row measure(const Scene& scene, const SceneView& view, RTCScene embree, const std::string& kind,
            const PointOptions& options) {
  const std::vector<Vec3> points = make_points(scene.mesh, view.bounds, kind, options.points);
  std::vector<float> own(points.size()), other(points.size());
  const PointJob job{&view, points.data(), own.data(), points.size()};
  const auto by = [&](const Isa& isa) { return [&job, &isa] { return time_of([&] { isa.run(job); }); }; };
  const std::vector<Contestant> contestants{
      {"embree", [&] { return time_of([&] { ask_embree(embree, scene.mesh, points, other); }); }},
      {"best", by(best_isa())},
      {"least", by(kIsas[0])}};
  const Timings timings = run_rounds(contestants, options.rounds);
  const auto each = [&](std::size_t i) { return median(timings[i]) / static_cast<double>(points.size()) * 1e9; };
  Row row{scene.name, kind, each(0), each(1), each(2)};
  row.best_ratio = median_speed_ratio(timings[1], timings[0]);
  row.least_ratio = median_speed_ratio(timings[2], timings[0]);
  double diagonal = 0.0;
  for (unsigned k = 0; k < 3; ++k) diagonal = std::hypot(diagonal, double{view.bounds.max[k]} - view.bounds.min[k]);
  for (std::size_t i = 0; i < points.size(); ++i)
    row.largest_difference = std::max(row.largest_difference, std::abs(double{own[i]} - double{other[i]}) / diagonal);
  return row;
}

class PointBenchmarks {
 public:
  explicit PointBenchmarks(const PointOptions& options) : options_(options) {}

  std::string add() {
    const auto scenes = find_scenes(options_.scenes);
    if (!scenes) return scenes.error().message;
    for (const std::string& name : *scenes)
      add_benchmark("points/" + name, [this, name](benchmark::State& state) { run(state, name); });
    return {};
  }

  Summary summarize() const {
    Summary summary;
    summary.markdown =
        "## Closest points of one thread, " + rounds_text(options_.rounds) + "\n\n" +
        table<Row>(rows_,
                   {{"scene", [](const Row& r) { return r.scene; }},
                    {"points", [](const Row& r) { return r.kind; }},
                    {"Embree, ns", [](const Row& r) { return format_number(r.embree, 0); }},
                    {"hiprt, ns (ratio)", [](const Row& r) { return with_ratio(r.best, 0, r.best_ratio, 2); }},
                    {"base level, ns (ratio)", [](const Row& r) { return with_ratio(r.least, 0, r.least_ratio, 2); }}});
    for (const Row& row : rows_)
      if (!(row.largest_difference < 1e-4))
        summary.faults.push_back(row.scene + ", " + row.kind + ": distances differ by " +
                                 std::to_string(row.largest_difference) + " diagonals");
    return summary;
  }

 private:
  void run(benchmark::State& state, const std::string& name) {
    const auto scene = load_scene(options_.scenes, name);
    if (!scene) return state.SkipWithError(scene.error().message.c_str());
    const build::TriangleMesh input = scene->input();
    const auto bvh = build::build({&input, 1});
    if (!bvh) return state.SkipWithError(bvh.error().message.c_str());
    auto embree = EmbreeScene::make(scene->mesh, {});
    if (!embree || !embree->commit()) return state.SkipWithError("Embree builds no scene");
    const SceneView view = bvh->scene();
    for (auto _ : state)
      for (const char* kind : kKinds) {
        const Row row = measure(*scene, view, embree->get(), kind, options_);
        state.counters[row.kind + ".ratio"] = row.best_ratio;
        state.counters[row.kind + ".base_ratio"] = row.least_ratio;
        state.counters[row.kind + ".ns"] = row.best;
        rows_.push_back(row);
      }
  }

  const PointOptions& options_;
  std::vector<Row> rows_;
};

std::vector<Flag> flags(PointOptions& options) {
  std::vector<Flag> flags = options.scenes.flags();
  flags.push_back(number_flag("points", "points of each kind", options.points, 1, 100'000'000));
  flags.push_back(number_flag("rounds", "rounds in which all run in turn", options.rounds, 1, 10'000));
  return flags;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  using namespace hiprt::bench;
  PointOptions options;
  PointBenchmarks benchmarks(options);
  return run_program({"bench_points", "Closest points of one thread: hiprt and Embree's rtcPointQuery, side by side.",
                      flags(options), [&] { return benchmarks.add(); }, [&] { return benchmarks.summarize(); }},
                     argc, argv);
}
