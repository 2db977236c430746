/// bench_points: closest points of one thread, by hiprt and by Embree's rtcPointQuery, side by side in one process.
/// Then all kinds of point queries, on one thread and on a GPU.
///
/// Embree calls a function of the program for each triangle. Here it is the usual test of regions in float (Ericson,
/// "Real-Time Collision Detection", 2005, 5.1.5).

#include "gpu_points.h"
#include "kernel.h"
#include "point_variants.h"

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
#include <bit>
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
  unsigned gpu_points = 1'000'000;
  unsigned rounds = 9;
};

constexpr double kDoubt = 1e-5;

/// Where the points are.
constexpr const char* kKinds[] = {"near", "within", "around"};

struct Row {
  std::string scene, kind;
  double embree = 0.0;             ///< Nanoseconds per point.
  double best = 0.0, least = 0.0;  ///< hiprt, by the best and the least instruction set.
  double best_ratio = 0.0, least_ratio = 0.0;
  /// Of distances, in diagonals of the scene: from Embree's, or from the judge's where Embree's are farther off than
  /// kDoubt. Embree's side computes in float.
  double largest_difference = 0.0;
};

/// A kind of query, on one thread and on the GPU.
struct VariantRow {
  std::string scene, kind;
  const char* query;
  double host = 0.0;                                      ///< Nanoseconds per point, by the best instruction set.
  double gpu = std::numeric_limits<double>::quiet_NaN();  ///< The same; NaN: there is no GPU.
  std::size_t different = 0;                              ///< Results that are not the host's, bit by bit.
};

constexpr const char* kQueries[] = {"closest",      "closest, quantized", "closest, double", "8 nearest",
                                    "within 0.2 %", "signed distance",    "cubes of 0.2 %"};
static_assert(std::size(kQueries) == static_cast<std::size_t>(PointVariant::kCount));

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

/// @tparam Vec of floats or doubles.
template <class Vec> Vec closest_in_regions(const Vec& p, const Vec& a, const Vec& b, const Vec& c) {
  using Real = typename Vec::value_type;
  const Vec ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const Real d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap), d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp),
             d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const Real vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const Real scale = 1 / (va + vb + vc);
  return a + vb * scale * ab + vc * scale * ac;
}

/// The distance by a loop over all triangles, in double.
double judge(const tools::Mesh& mesh, const Vec3& point) {
  double least = std::numeric_limits<double>::infinity();
  const glm::dvec3 p(point);
  for (const build::Triangle& t : mesh.triangles) {
    const glm::dvec3 a(vertex(mesh, t[0])), b(vertex(mesh, t[1])), c(vertex(mesh, t[2]));
    // A triangle without an area may give NaN, which is not less.
    least = std::min({least, glm::length(p - a), glm::length(p - b), glm::length(p - c)});
    const double distance = glm::length(p - closest_in_regions(p, a, b, c));
    if (distance < least) least = distance;
  }
  return least;
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

double diagonal_of(const Box& bounds) {
  double diagonal = 0.0;
  for (unsigned k = 0; k < 3; ++k) diagonal = std::hypot(diagonal, double{bounds.max[k]} - bounds.min[k]);
  return diagonal;
}

const Isa& best_isa() {
  const Isa* chosen = &kIsas[0];
  for (const Isa& isa : kIsas)
    if (isa.name == tools::trace_isa()) chosen = &isa;
  return *chosen;
}

Row measure(const Scene& scene, const SceneView& view, RTCScene embree, const std::string& kind,
            const PointOptions& options) {
  const std::vector<Vec3> points = make_points(scene.mesh, view.bounds, kind, options.points);
  std::vector<float> other(points.size());
  std::vector<double> own(points.size());
  const PointJob job{&view, points.data(), own.data(), points.size(), 0.0f, unsigned(PointVariant::kClosest)};
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
  const double diagonal = diagonal_of(view.bounds);
  for (std::size_t i = 0; i < points.size(); ++i) {
    double difference = std::abs(std::sqrt(own[i]) - double{other[i]}) / diagonal;
    if (!(difference < kDoubt)) difference = std::abs(std::sqrt(own[i]) - judge(scene.mesh, points[i])) / diagonal;
    row.largest_difference = std::max(row.largest_difference, difference);
  }
  return row;
}

/// @param file of the layout that the variant needs.
build::Result<VariantRow> measure_variant(const std::string& scene, std::span<const std::byte> file,
                                          const std::string& kind, std::span<const Vec3> points, unsigned variant,
                                          bool on_gpu, const PointOptions& options) {
  const auto opened = open_buffer(file);
  const SceneView view = make_scene_view(*opened);
  const auto reach = static_cast<float>(0.002 * diagonal_of(view.bounds));
  std::vector<double> own(std::min<std::size_t>(points.size(), options.points));
  const PointJob job{&view, points.data(), own.data(), own.size(), reach, variant};
  std::vector<double> times;
  for (unsigned round = 0; round < options.rounds; ++round) times.push_back(time_of([&] { best_isa().run(job); }));
  VariantRow row{scene, kind, kQueries[variant]};
  row.host = median(times) / static_cast<double>(own.size()) * 1e9;
  if (!on_gpu) return row;
  const auto run = ask_gpu(file, points, variant, reach, options.rounds);
  if (!run) return tl::unexpected(run.error());
  row.gpu = median(run->seconds) / static_cast<double>(points.size()) * 1e9;
  for (std::size_t i = 0; i < own.size(); ++i)
    if (std::bit_cast<std::uint64_t>(own[i]) != std::bit_cast<std::uint64_t>(run->results[i])) ++row.different;
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
    summary.markdown +=
        "\n## Point queries on one thread and on a GPU (" + gpu_ + ")\n\n" +
        table<VariantRow>(variants_, {{"scene", [](const VariantRow& r) { return r.scene; }},
                                      {"points", [](const VariantRow& r) { return r.kind; }},
                                      {"query", [](const VariantRow& r) { return std::string(r.query); }},
                                      {"one thread, ns", [](const VariantRow& r) { return format_number(r.host, 0); }},
                                      {"GPU, ns", [](const VariantRow& r) { return number_or_dash(r.gpu, 3); }}});
    for (const VariantRow& row : variants_)
      if (row.different != 0)
        summary.faults.push_back(row.scene + ", " + row.kind + ", " + row.query + ": " + std::to_string(row.different) +
                                 " results of the GPU are not the host's");
    for (const Row& row : rows_)
      if (!(row.largest_difference < kDoubt))
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
    build::BuildOptions quantized;
    quantized.nodes = NodeLayout::kQuantized;
    const auto small = build::build({&input, 1}, quantized);
    if (!small) return state.SkipWithError(small.error().message.c_str());
    // With split triangles a query that reports each triangle once takes a traversal per triangle.
    build::BuildOptions whole;
    whole.builder = build::Builder::kHploc;
    const auto unsplit = build::build({&input, 1}, whole);
    if (!unsplit) return state.SkipWithError(unsplit.error().message.c_str());
    const auto gpu = gpu_name();
    gpu_ = gpu ? *gpu : gpu.error().message;
    const SceneView view = bvh->scene();
    for (auto _ : state)
      for (const char* kind : kKinds) {
        const Row row = measure(*scene, view, embree->get(), kind, options_);
        state.counters[row.kind + ".ratio"] = row.best_ratio;
        state.counters[row.kind + ".base_ratio"] = row.least_ratio;
        state.counters[row.kind + ".ns"] = row.best;
        rows_.push_back(row);
        const std::vector<Vec3> points =
            make_points(scene->mesh, view.bounds, kind, gpu ? options_.gpu_points : options_.points);
        for (unsigned variant = 0; variant < std::size(kQueries); ++variant) {
          const auto query = static_cast<PointVariant>(variant);
          const bool takes_all = query == PointVariant::kWithin || query == PointVariant::kOverlap;
          const auto& tree = query == PointVariant::kQuantized ? small : takes_all ? unsplit : bvh;
          const auto measured =
              measure_variant(name, tree->buffer.bytes(), kind, points, variant, gpu.has_value(), options_);
          if (!measured) return state.SkipWithError(measured.error().message.c_str());
          variants_.push_back(*measured);
        }
      }
  }

  const PointOptions& options_;
  std::vector<Row> rows_;
  std::vector<VariantRow> variants_;
  std::string gpu_;  ///< Its name, or why there is none.
};

std::vector<Flag> flags(PointOptions& options) {
  std::vector<Flag> flags = options.scenes.flags();
  flags.push_back(number_flag("points", "points of each kind", options.points, 1, 100'000'000));
  flags.push_back(number_flag("gpu-points", "points of each kind on a GPU", options.gpu_points, 1, 100'000'000));
  flags.push_back(number_flag("rounds", "rounds in which all run in turn", options.rounds, 1, 10'000));
  return flags;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  using namespace hiprt::bench;
  PointOptions options;
  PointBenchmarks benchmarks(options);
  return run_program(
      {"bench_points",
       "Closest points of one thread: hiprt and Embree's rtcPointQuery, side by side. Then point queries of "
       "all kinds, on one thread and, if there is one, on a GPU.",
       flags(options), [&] { return benchmarks.add(); }, [&] { return benchmarks.summarize(); }},
      argc, argv);
}
