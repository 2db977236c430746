#include <tools/cli/build/build_report.h>

#include <tools/cli/build/build_names.h>
#include <tools/cli/build/scene_figures.h>
#include <tools/cli/report.h>

#include <hiprt_build/format/view.h>

#include <nlohmann/json.hpp>

#include <sys/resource.h>

namespace hiprt::tools {
namespace {

std::uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

/// Triangles and custom primitives, in millions.
double millions(const build::BuildStatistics& s) { return static_cast<double>(s.triangles + s.customs) * 1e-6; }

double mprimitives_per_second(const build::BuildStatistics& s) {
  return s.total_seconds > 0 ? millions(s) / s.total_seconds : 0.0;
}

double mprimitives_per_second(const BuiltScene& built) {
  return built.object_seconds > 0 ? millions(built.objects) / built.object_seconds : 0.0;
}

std::string speed_text(double mprimitives, const build::BuildStatistics& s) {
  return fixed(mprimitives, 3) + (s.customs == 0 ? " Mtriangles/s" : " Mprimitives/s");
}

void add_customs(Table& table, const build::BuildStatistics& s) {
  if (s.customs == 0) return;
  table.row("spheres and segments of curves", std::to_string(s.customs));
  table.row("pairs of those", std::to_string(s.custom_pairs));
}

std::string dropped_text(const build::BuildStatistics& s) {
  return std::to_string(s.dropped_not_finite) + " not finite, " + std::to_string(s.dropped_degenerate) + " degenerate";
}

nlohmann::json dropped_json(const build::BuildStatistics& s) {
  return {{"not_finite", s.dropped_not_finite}, {"degenerate", s.dropped_degenerate}};
}

}  // namespace

std::string report_text(const std::string& output, const Built& built, const BufferView& view, BuildSeconds seconds) {
  const build::Bvh& bvh = built.bvh;
  const build::BuildStatistics& s = bvh.statistics;
  Table table;
  table.row("file", output);
  table.row("bytes", bytes_text(bvh.buffer.size()));
  add_bytes_per_primitive(table, view);
  table.row("layout", word_of(kLayouts, view.layout()));
  table.row("builder", build::name(s.builder));
  table.row("device", built.on_gpu ? "gpu" : "cpu");
  table.row("geometries", std::to_string(view.geometries.size()));
  table.row("triangles", std::to_string(s.triangles));
  add_customs(table, s);
  table.row("dropped", dropped_text(s));
  table.row("pairs", std::to_string(s.pairs));
  add_tree(table, build::measure_tree(view));
  table.row("time to read", fixed(seconds.read, 3) + " s");
  table.row("time to build", fixed(s.total_seconds, 3) + " s: pair " + fixed(s.pair_seconds, 3) + ", tree " +
                                 fixed(s.tree_seconds, 3) + ", collapse " + fixed(s.collapse_seconds, 3) + ", encode " +
                                 fixed(s.encode_seconds, 3));
  table.row("time to write", fixed(seconds.write, 3) + " s");
  table.row("build speed", speed_text(mprimitives_per_second(s), s));
  table.row("builder's peak memory", bytes_text(s.scratch_bytes_peak));
  table.row("process's peak memory", bytes_text(peak_memory_bytes()));
  return table.text();
}

nlohmann::json report_json(const std::string& output, const Built& built, const BufferView& view,
                           BuildSeconds seconds) {
  const build::Bvh& bvh = built.bvh;
  const build::BuildStatistics& s = bvh.statistics;
  return {{"file", output},
          {"bytes", bvh.buffer.size()},
          {"bytes_per_triangle", bytes_per_primitive(view)},
          {"layout", word_of(kLayouts, view.layout())},
          {"builder", build::name(s.builder)},
          {"device", built.on_gpu ? "gpu" : "cpu"},
          {"geometries", view.geometries.size()},
          {"triangles", s.triangles},
          {"customs", s.customs},
          {"dropped", dropped_json(s)},
          {"pairs", s.pairs},
          {"tree", tree_json(build::measure_tree(view))},
          {"seconds",
           {{"read", seconds.read},
            {"pair", s.pair_seconds},
            {"tree", s.tree_seconds},
            {"collapse", s.collapse_seconds},
            {"encode", s.encode_seconds},
            {"build", s.total_seconds},
            {"write", seconds.write}}},
          {"mtriangles_per_second", mprimitives_per_second(s)},
          {"peak_bytes", {{"builder", s.scratch_bytes_peak}, {"process", peak_memory_bytes()}}}};
}

std::string report_text(const std::string& output, const SceneDescription& description, const BuiltScene& built,
                        const BufferView& view, BuildSeconds seconds) {
  Table table;
  table.row("file", output);
  table.row("bytes", bytes_text(built.file.size()));
  table.row("layout", word_of(kLayouts, view.layout()));
  table.row("builder of objects", build::name(built.builder));
  table.row("device", built.on_gpu ? "gpu" : "cpu");
  table.row("mesh files read", std::to_string(description.files.size()));
  table.row("objects named twice", std::to_string(description.shared_objects));
  if (built.cache.hits + built.cache.misses != 0)
    table.row("cache", std::to_string(built.cache.hits) + " hits, " + std::to_string(built.cache.misses) + " misses");
  add_scene(table, measure_scene(view));
  table.row("dropped", dropped_text(built.objects));
  table.row("pairs", std::to_string(built.objects.pairs));
  add_tree(table, build::measure_tree(view));
  table.row("time to read", fixed(seconds.read, 3) + " s");
  table.row("time to build objects", fixed(built.object_seconds, 3) + " s");
  table.row("time to build trees over instances", fixed(built.instance_seconds, 3) + " s");
  table.row("time to write", fixed(seconds.write, 3) + " s");
  table.row("build speed of objects", speed_text(mprimitives_per_second(built), built.objects));
  table.row("process's peak memory", bytes_text(peak_memory_bytes()));
  return table.text();
}

nlohmann::json report_json(const std::string& output, const SceneDescription& description, const BuiltScene& built,
                           const BufferView& view, BuildSeconds seconds) {
  return {{"file", output},
          {"bytes", built.file.size()},
          {"layout", word_of(kLayouts, view.layout())},
          {"builder", build::name(built.builder)},
          {"device", built.on_gpu ? "gpu" : "cpu"},
          {"mesh_files", description.files.size()},
          {"shared_objects", description.shared_objects},
          {"scene", scene_json(measure_scene(view))},
          {"cache", {{"hits", built.cache.hits}, {"misses", built.cache.misses}, {"damaged", built.cache.damaged}}},
          {"triangles", built.objects.triangles},
          {"customs", built.objects.customs},
          {"dropped", dropped_json(built.objects)},
          {"pairs", built.objects.pairs},
          {"tree", tree_json(build::measure_tree(view))},
          {"seconds",
           {{"read", seconds.read},
            {"objects", built.object_seconds},
            {"instances", built.instance_seconds},
            {"write", seconds.write}}},
          {"mtriangles_per_second", mprimitives_per_second(built)},
          {"peak_bytes", {{"process", peak_memory_bytes()}}}};
}

}  // namespace hiprt::tools
