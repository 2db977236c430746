/// bench_hair: the cost of hair on the CPU. The strands of make_scene's head are one geometry of round curves,
/// built by several builders. Alternatively each strand is a BVH of triangles in a scene of instances.

#include "../common/flags.h"
#include "../common/hair.h"
#include "../common/markdown.h"
#include "../common/rounds.h"

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/shapes.h>
#include <tools/base/parallel.h>
#include <tools/cli/build/build_names.h>
#include <tools/render/tracers/tracer.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <ctime>
#include <fstream>
#include <iostream>
#include <string>
#include <utility>

namespace hiprt::bench {
namespace {

/// Few rays: a ray through 4 million strands enters tens of thousands of their boxes.
constexpr std::uint32_t kWidth = 128, kHeight = 128;

struct Options {
  unsigned strands = 100'000, batch_strands = 0, threads = 0;
  std::vector<std::string> builders{"lbvh", "ploc"};
  std::string scene;
};

/// Resets the peak memory of the process (Linux: proc(5), clear_refs).
void forget_peak_memory() { std::ofstream("/proc/self/clear_refs") << "5"; }

/// @return bytes; 0 if the system does not report them.
std::uint64_t peak_memory() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmHWM:", 0) == 0) return std::stoull(line.substr(6)) * 1024;
  return 0;
}

/// CPU time of all threads. It does not depend on other programs.
double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

std::string mib(std::uint64_t bytes) { return format_number(static_cast<double>(bytes) * 0x1p-20, 0); }

/// Traces the pixels of a square picture. @return microseconds of one thread per ray.
double trace_picture(const SceneView& scene, const tools::ThreadLimit& limit, std::size_t& hits) {
  const tools::CameraRays camera(hair_camera(), kWidth, kHeight);
  std::vector<Ray> rays;
  for (std::uint32_t y = 0; y < kHeight; ++y)
    for (std::uint32_t x = 0; x < kWidth; ++x) rays.push_back(camera.ray(x + 0.5, y + 0.5));
  std::vector<Hit> found(rays.size());
  const auto trace_batch = [&](std::size_t begin, std::size_t end) {
    tools::trace(scene, tools::Query::kClosest, {}, std::span(rays).subspan(begin, end - begin),
                 std::span(found).subspan(begin, end - begin));
  };
  std::vector<double> seconds;
  for (unsigned round = 0; round < 3; ++round) {
    const double before = cpu_seconds();
    tools::parallel_batches(rays.size(), 256, limit, trace_batch);
    seconds.push_back(cpu_seconds() - before);
  }
  hits = static_cast<std::size_t>(std::count_if(found.begin(), found.end(), [](const Hit& h) { return h.found(); }));
  return median(seconds) / static_cast<double>(rays.size()) * 1e6;
}

/// Builds one BVH of round curves over all strands. @return a row of the table.
build::Result<std::vector<std::string>> build_curves(const Options& options, const Hair& hair,
                                                     const std::string& builder) {
  const tools::ThreadLimit limit(options.threads);
  forget_peak_memory();
  const double cpu_before = cpu_seconds();
  std::vector<std::uint32_t> segments;
  build::Result<std::vector<Box>> boxes{};
  build::Shapes shapes{ShapeKind::kCurves, hair.points, {}};
  const double box_seconds = time_of([&] {
    segments = build::strand_segments(hair.strands);
    shapes.segments = segments;
    boxes = build::shape_boxes(shapes, options.threads);
  });
  if (!boxes) return tl::unexpected(boxes.error());
  const build::CustomGeometry geometry{.boxes = *boxes, .shapes = shapes};
  const auto bvh = build::build(build::SceneInput{{}, {&geometry, 1}},
                                {.builder = tools::value_of(tools::kBuilders, builder), .threads = options.threads});
  if (!bvh) return tl::unexpected(bvh.error());
  const std::uint64_t peak = peak_memory();
  const double cpu = cpu_seconds() - cpu_before;
  bool valid = false;
  const double check_seconds = time_of([&] { valid = validate(bvh->buffer.bytes()).has_value(); });
  if (!valid) return tl::unexpected(build::Error{build::ErrorCode::kBackend, "the file is not valid"});
  std::size_t hits = 0;
  const double ray_time = trace_picture(make_scene_view(*open_buffer(bvh->buffer.bytes())), limit, hits);
  if (hits == 0) return tl::unexpected(build::Error{build::ErrorCode::kBackend, "no ray meets the hair"});
  const auto count = static_cast<double>(segments.size());
  return std::vector<std::string>{"curves, " + builder,
                                  std::to_string(segments.size()) + " segments",
                                  format_number(box_seconds + bvh->statistics.total_seconds, 2),
                                  format_number(cpu, 2),
                                  mib(bvh->buffer.size()),
                                  format_number(static_cast<double>(bvh->buffer.size()) / count, 1),
                                  mib(bvh->statistics.scratch_bytes_peak),
                                  mib(peak),
                                  format_number(check_seconds, 2),
                                  format_number(ray_time, 1)};
}

/// Two triangles per segment, with the width of the strand.
struct Ribbon {
  std::array<build::Position, 2 * kHairPoints> positions;
  std::array<build::Triangle, 2 * (kHairPoints - 1)> triangles;

  explicit Ribbon(std::span<const ShapePoint> points) {
    for (std::uint32_t i = 0; i < kHairPoints; ++i) {
      const auto& [p, radius] = points[i];
      positions[2 * i] = {p[0] - radius, p[1], p[2]};
      positions[2 * i + 1] = {p[0] + radius, p[1], p[2]};
    }
    for (std::uint32_t i = 0; i + 1 < kHairPoints; ++i) {
      triangles[2 * i] = {2 * i, 2 * i + 1, 2 * i + 3};
      triangles[2 * i + 1] = {2 * i, 2 * i + 3, 2 * i + 2};
    }
  }
};

/// Builds a BVH per strand, each by one thread, and a scene with an instance of each.
build::Result<std::vector<std::string>> build_strands(const Options& options, const Hair& hair) {
  const tools::ThreadLimit limit(options.threads);
  const std::size_t strands = std::min<std::size_t>(options.batch_strands, hair.strands.size());
  std::vector<build::Buffer> files(strands);
  std::atomic<std::uint64_t> faults = 0;
  const auto build_part = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Ribbon ribbon(std::span(hair.points).subspan(i * kHairPoints, kHairPoints));
      const build::TriangleMesh mesh{.positions = ribbon.positions, .triangles = ribbon.triangles};
      auto bvh = build::build({&mesh, 1}, {.builder = build::Builder::kLbvh, .threads = 1});
      if (bvh)
        files[i] = std::move(bvh->buffer);
      else
        ++faults;
    }
  };
  forget_peak_memory();
  const double cpu_before = cpu_seconds();
  double seconds = time_of([&] { tools::parallel_batches(strands, 256, limit, build_part); });
  if (faults != 0)
    return tl::unexpected(build::Error{build::ErrorCode::kBackend, std::to_string(faults) + " strands failed"});
  std::vector<std::span<const std::byte>> objects;
  objects.reserve(strands);
  for (const build::Buffer& file : files) objects.push_back(file.bytes());
  std::vector<build::Instance> instances(strands);
  for (std::size_t i = 0; i < strands; ++i) instances[i].object = static_cast<std::uint32_t>(i);
  build::InstanceOptions how;
  how.tree.threads = options.threads;
  build::Result<build::Bvh> scene{};
  seconds += time_of([&] { scene = build::build_instances(objects, instances, how); });
  if (!scene) return tl::unexpected(scene.error());
  const double cpu = cpu_seconds() - cpu_before;
  const std::uint64_t peak = peak_memory();
  files.clear();
  const std::span<const std::byte> bytes = std::as_const(scene->buffer).bytes();
  if (!options.scene.empty())
    if (auto written = build::write_file(options.scene, bytes); !written) return tl::unexpected(written.error());
  bool valid = false;
  const double check_seconds = time_of([&] { valid = validate(bytes).has_value(); });
  if (!valid) return tl::unexpected(build::Error{build::ErrorCode::kBackend, "the scene's file is not valid"});
  std::size_t hits = 0;
  const double ray_time = trace_picture(make_scene_view(*open_buffer(bytes)), limit, hits);
  if (hits == 0) return tl::unexpected(build::Error{build::ErrorCode::kBackend, "no ray meets the strands"});
  const double triangles = static_cast<double>(strands) * 2 * (kHairPoints - 1);
  return std::vector<std::string>{"a BVH per strand, lbvh",
                                  std::to_string(strands) + " BVHs and instances",
                                  format_number(seconds, 2),
                                  format_number(cpu, 2),
                                  mib(bytes.size()),
                                  format_number(static_cast<double>(bytes.size()) / triangles, 1),
                                  "",
                                  mib(peak),
                                  format_number(check_seconds, 2),
                                  format_number(ray_time, 1)};
}

int run(const Options& options) {
  Hair strands;
  const double seconds = time_of([&] { strands = hair(options.strands); });
  std::cout << options.strands << " strands of " << kHairPoints << " points, made in " << format_number(seconds, 2)
            << " s: " << mib(strands.points.size() * sizeof(ShapePoint)) << " MiB; rays: " << kWidth << " x " << kHeight
            << ", closest hits; " << tools::ThreadLimit(options.threads).threads() << " threads\n\n";
  MarkdownTable table({"structure", "content", "build, s", "CPU, s", "file, MiB", "bytes per primitive",
                       "builder's memory, MiB", "process' peak, MiB", "validate(), s", "CPU per ray, us"});
  const auto add = [&](const build::Result<std::vector<std::string>>& row) {
    if (row) table.add(*row);
    if (!row) std::cerr << "bench_hair: " << row.error().message << "\n";
    return row.has_value();
  };
  for (const std::string& builder : options.builders)
    if (!add(build_curves(options, strands, builder))) return 1;
  if (options.batch_strands != 0 && !add(build_strands(options, strands))) return 1;
  std::cout << table.text();
  return 0;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  using namespace hiprt::bench;
  Options options;
  const std::vector<Flag> flags{
      number_flag("strands", "strands of the head", options.strands, 1, 500'000'000),
      number_flag("batch_strands", "strands with a BVH of their own; 0: none", options.batch_strands, 0, 500'000'000),
      text_flag("scene", "FILE", "writes the scene of these BVHs", options.scene),
      number_flag("threads", "threads; 0: all", options.threads, 0, 1024),
      list_flag("builders", "NAMES", "builders of the BVH over all strands", options.builders)};
  std::string fault = take_flags(argc, argv, flags);
  const auto known = hiprt::tools::words(hiprt::tools::kBuilders);
  for (const std::string& builder : options.builders)
    if (std::find(known.begin(), known.end(), builder) == known.end())
      fault = "--builders: no builder '" + builder + "'";
  const bool help = argc == 2 && std::string(argv[1]) == "--help";
  if (help) std::cout << "bench_hair [flags]\n" << describe(flags);
  if (help) return 0;
  if (fault.empty() && argc > 1) fault = std::string("unknown argument '") + argv[1] + "' (see --help)";
  if (fault.empty()) return run(options);
  std::cerr << "bench_hair: " << fault << "\n";
  return 2;
}
