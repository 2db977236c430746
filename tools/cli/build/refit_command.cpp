#include <tools/cli/build/refit_command.h>

#include <tools/base/interrupt.h>
#include <tools/base/memory_limit.h>
#include <tools/base/output_file.h>
#include <tools/base/parallel.h>
#include <tools/build/build_meshes.h>
#include <tools/build/build_progress.h>
#include <tools/build/shape_geometries.h>
#include <tools/cli/build/build_names.h>
#include <tools/cli/build/mesh_inputs.h>
#include <tools/cli/build/shape_inputs.h>
#include <tools/cli/bvh_file.h>
#include <tools/cli/cli.h>
#include <tools/cli/progress.h>
#include <tools/cli/report.h>

#include <hiprt_build/file.h>
#include <hiprt_build/refit.h>

#include <nlohmann/json.hpp>

#include <iostream>
#include <optional>

namespace hiprt::tools {
namespace {

std::string report_text(const build::RefitStatistics& s) {
  return "SAH cost " + fixed(s.sah_cost, 3) + ", " + fixed(s.sah_cost_built, 3) +
         " when the tree was built: " + fixed(s.cost_ratio, 3) + " times\nexchange slack " +
         fixed(s.exchange_slack, 4) + ", " + fixed(s.exchange_slack_built, 4) + " when the tree was built\n" +
         (s.rebuild_advised ? "a rebuild is advised" : "no rebuild needed") + "\n";
}

nlohmann::json report_json(const RefitCommand& command, const build::RefittedBvh& bvh, NodeLayout layout) {
  const build::RefitStatistics& s = bvh.statistics;
  return {{"file", command.output},
          {"bytes", bvh.buffer.size()},
          {"layout", word_of(kLayouts, layout)},
          {"nodes", s.nodes},
          {"leaves", s.leaves},
          {"sah_cost", {{"built", s.sah_cost_built}, {"now", s.sah_cost}, {"ratio", s.cost_ratio}}},
          {"exchange_slack", {{"built", s.exchange_slack_built}, {"now", s.exchange_slack}}},
          {"rebuild_advised", s.rebuild_advised},
          {"seconds",
           {{"check", s.check_seconds},
            {"write", s.write_seconds},
            {"measure", s.measure_seconds},
            {"refit", s.total_seconds}}}};
}

}  // namespace

build::Result<void> run_refit(const Cli& cli, const RefitCommand& command) {
  const InterruptGuard guard;
  const ThreadLimit limit(command.threads);
  ProgressBar bar;
  std::vector<std::string> inputs = command.moved;
  inputs.push_back(command.file);
  if (auto checked = check_output(command.output, inputs); !checked) return checked;
  const auto file = load_bvh(command.file, command.max_memory, command.threads);
  if (!file) return tl::unexpected(file.error());
  if (file->view.has_instances())
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                       command.file + ": is a scene of instances, which has no triangles of its own"});
  std::vector<std::string> mesh_files, shape_files;
  for (const std::string& input : command.moved) (is_shape_file(input) ? shape_files : mesh_files).push_back(input);
  std::optional<MemoryLimit> reading(std::in_place, command.max_memory);
  const auto meshes = read_meshes(cli, mesh_files, command.output, bar);
  if (!meshes) return tl::unexpected(meshes.error());
  const auto sets = read_shapes(cli, shape_files, command.output, bar);
  if (!sets) return tl::unexpected(sets.error());
  reading.reset();
  const auto shapes = ShapeGeometries::make(pointers(*sets), command.threads);
  if (!shapes) return tl::unexpected(shapes.error());
  const std::vector<build::TriangleMesh> moved = views(*meshes);
  auto bvh = build::refit_copy(file->view.bytes, {moved, shapes->customs()},
                               {.threads = command.threads, .progress = build_progress(bar.sink())});
  bar.clear();
  if (interrupted()) return cancelled();
  if (!bvh) return tl::unexpected(bvh.error());
  if (auto written = build::write_file(command.output, bvh->buffer.bytes()); !written) return written;
  if (cli.json())
    cli.print(report_json(command, *bvh, file->view.layout()));
  else
    std::cout << report_text(bvh->statistics);
  return {};
}

}  // namespace hiprt::tools
