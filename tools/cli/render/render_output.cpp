#include <tools/cli/render/render_output.h>

#include <tools/base/interrupt.h>
#include <tools/cli/progress.h>
#include <tools/cli/render/picture_options.h>
#include <tools/cli/report.h>
#include <tools/render/image/image.h>
#include <tools/render/image/image_write.h>
#include <tools/render/tracers/tracer.h>

#include <nlohmann/json.hpp>

#include <iostream>

namespace hiprt::tools {
namespace {

ImageAttributes attributes_of(const ToolInfo& info, const RenderCommand& command, const Camera& camera) {
  return {{"software", tool_version(info)},
          {"scene", command.path},
          {"mode", command.mode_text()},
          {"spp", std::to_string(command.render.samples)},
          {"seed", std::to_string(command.render.seed)},
          {"shutter", command.shutter},
          {"camera", to_text(camera)},
          {"comments",
           "N, P, Z, id and cost belong to the ray through the pixel's centre; R, G, B are the mean of spp "
           "samples, linear, sRGB primaries. Z is the distance from the eye along the ray, inf for a miss."}};
}

std::uint64_t rays_of(const Rendering& rendering) {
  return rendering.rays.primary + rendering.rays.secondary + rendering.rays.shadow;
}

double mrays_per_second(const Rendering& rendering) {
  const auto rays = static_cast<double>(rays_of(rendering));
  return rendering.seconds > 0 ? rays / rendering.seconds * 1e-6 : 0.0;
}

std::string ranks_text(int ranks) { return ranks == 1 ? "" : ", " + std::to_string(ranks) + " ranks"; }

void print_text(const RenderReport& report) {
  const RenderOptions& render = report.command.render;
  const Rendering& rendering = report.rendering;
  std::cout << render.width << " x " << render.height << " pixels, " << rendering.samples << " samples, "
            << report.command.mode_text() << ": " << rays_of(rendering) << " rays in " << fixed(rendering.seconds, 2)
            << " s, " << fixed(mrays_per_second(rendering), 2) << " Mrays/s with shading (" << report.device << " "
            << report.device_name << ranks_text(report.ranks) << ")\n";
  if (render.mode == RenderMode::kHeatmap)
    std::cout << fixed(rendering.mean_steps, 1) << " tests and instances per ray\n";
  if (rendering.rays.messages != 0)
    std::cout << rendering.rays.sent << " visits of rays to parts of other ranks, "
              << bytes_text(static_cast<std::size_t>(rendering.rays.bytes)) << " in " << rendering.rays.messages
              << " messages\n";
  for (const WrittenPicture& picture : report.pictures)
    std::cout << picture.path << "  " << bytes_text(picture.bytes) << "\n";
  std::cout << report.command.compare.text();
}

nlohmann::json report_json(const RenderReport& report) {
  const RenderOptions& render = report.command.render;
  const Rendering& rendering = report.rendering;
  nlohmann::json files = nlohmann::json::array();
  for (const WrittenPicture& picture : report.pictures)
    files.push_back({{"path", picture.path}, {"bytes", picture.bytes}});
  return {{"file", report.command.path},
          {"outputs", files},
          {"width", render.width},
          {"height", render.height},
          {"mode", report.command.mode_name()},
          {"spp", rendering.samples},
          {"seed", render.seed},
          {"camera", to_text(report.camera)},
          {"device", report.device},
          {"device_name", report.device_name},
          {"threads", rendering.threads},
          {"ranks", report.ranks},
          {"instruction_set", trace_isa()},
          {"primary_rays", rendering.rays.primary},
          {"secondary_rays", rendering.rays.secondary},
          {"shadow_rays", rendering.rays.shadow},
          {"rays_on_gpu", rendering.rays.on_gpu},
          {"exchange",
           {{"visits_of_other_ranks", rendering.rays.sent},
            {"messages", rendering.rays.messages},
            {"bytes", rendering.rays.bytes}}},
          {"seconds", rendering.seconds},
          {"mrays_per_second", mrays_per_second(rendering)},
          {"comparison", report.command.compare.json()},
          {"steps_per_ray", render.mode == RenderMode::kHeatmap ? nlohmann::json(rendering.mean_steps) : nullptr}};
}

}  // namespace

build::Result<std::vector<WrittenPicture>> write_pictures(const ToolInfo& info, const RenderCommand& command,
                                                          const Camera& camera, const Image& image, bool stops) {
  std::vector<WrittenPicture> written;
  ProgressBar bar;
  for (const std::string& path : command.outputs) {
    const auto progress = [&](double done) {
      bar.update("encode", done);
      return !(stops && interrupted());
    };
    const auto bytes = is_exr(path) ? write_exr(path, image, attributes_of(info, command, camera), progress)
                                    : write_png(path, image, progress);
    if (!bytes) return tl::unexpected(bytes.error());
    written.push_back({path, *bytes});
  }
  return written;
}

void print(const Cli& cli, const RenderReport& report) {
  if (cli.json())
    cli.print(report_json(report));
  else
    print_text(report);
}

}  // namespace hiprt::tools
