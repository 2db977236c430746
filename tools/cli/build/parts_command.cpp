#include <tools/cli/build/parts_command.h>

#include <tools/base/interrupt.h>
#include <tools/base/memory_limit.h>
#include <tools/cli/build/build_command.h>
#include <tools/cli/build/build_warnings.h>
#include <tools/cli/cli.h>
#include <tools/cli/progress.h>
#include <tools/cli/report.h>
#include <tools/parts/build_parts.h>
#include <tools/scene_io/scene/surface_load.h>

#include <hiprt_build/exec/stopwatch.h>

#include <nlohmann/json.hpp>

#include <iostream>
#include <optional>

namespace hiprt::tools {
namespace {

struct PartsSeconds {
  double read, objects, parts;
};

nlohmann::json json_of(const ScenePart& part) {
  return {{"file", part.bvh.name}, {"bytes", part.bytes()}, {"instances", part.instances}};
}

nlohmann::json report_json(const PartManifest& manifest, const PartsSeconds& seconds) {
  nlohmann::json parts = nlohmann::json::array();
  for (const ScenePart& part : manifest.parts) parts.push_back(json_of(part));
  return {{"output", manifest.path},
          {"instances", manifest.instances},
          {"levels", manifest.levels},
          {"materials", manifest.materials},
          {"parts", parts},
          {"shared", manifest.shared ? json_of(*manifest.shared) : nlohmann::json()},
          {"seconds", {{"read", seconds.read}, {"objects", seconds.objects}, {"parts", seconds.parts}}}};
}

void print_text(const PartManifest& manifest, const PartsSeconds& seconds) {
  const auto line = [](const ScenePart& part) {
    std::cout << part.bvh.name << "  " << part.instances << " instances, " << bytes_text(part.bytes()) << "\n";
  };
  std::cout << manifest.path << ": " << manifest.parts.size() << " parts of " << manifest.instances << " instances, "
            << fixed(seconds.read + seconds.objects + seconds.parts, 2) << " s\n";
  for (const ScenePart& part : manifest.parts) line(part);
  if (manifest.shared) line(*manifest.shared);
}

/// @return the surfaces of the scene's objects; nothing if all are clay.
build::Result<std::optional<SceneSurfaces>> read_surfaces(const Cli& cli, const BuildCommand& command,
                                                          std::span<const build::Buffer> files) {
  const MemoryLimit reading(command.max_memory);
  auto surfaces = load_surfaces(command.inputs, files, command.output);
  if (!surfaces) return tl::unexpected(std::move(surfaces.error()));
  for (const std::string& warning : surfaces->warnings) cli.warn(warning);
  if (is_plain_clay(*surfaces)) return std::nullopt;
  return std::move(*surfaces);
}

}  // namespace

build::Result<void> run_parts(const Cli& cli, const BuildCommand& command, SceneDescription& scene,
                              const BuildRequest& request, double read_seconds, ProgressBar& bar) {
  PartsSeconds seconds{read_seconds, 0.0, 0.0};
  BuiltScene built;
  const auto files = build_objects(scene, request, bar.sink(), built);
  bar.clear();
  if (!files) return tl::unexpected(files.error());
  warn_scene(cli, scene, built);
  seconds.objects = built.object_seconds;
  build::Stopwatch watch;
  const auto surfaces = read_surfaces(cli, command, *files);
  if (!surfaces) return tl::unexpected(surfaces.error());
  seconds.read += watch.lap();
  const PartsOptions options{command.parts, command.output, built.on_gpu};
  const auto manifest = build_parts(scene, *files, *surfaces ? &**surfaces : nullptr, options, request, bar.sink());
  bar.clear();
  if (!manifest) return tl::unexpected(manifest.error());
  seconds.parts = watch.lap();
  if (cli.json())
    cli.print(report_json(*manifest, seconds));
  else if (command.stats)
    print_text(*manifest, seconds);
  return {};
}

}  // namespace hiprt::tools
