#include <tools/cli/render/path_command.h>

#include <tools/base/errors.h>
#include <tools/base/output_file.h>
#include <tools/cli/progress.h>
#include <tools/render/image/image_read.h>
#include <tools/render/path/gpu_path_tracer.h>
#include <tools/render/path/path_trace.h>
#include <tools/render/studio/studio.h>
#include <tools/scene_io/scene/surface_load.h>

#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/host/host_part.h>

#include <CLI/CLI.hpp>

#include <utility>

namespace hiprt::tools {
namespace {

/// Side of the sky's picture without --environment. The light of the studio is smooth.
constexpr std::uint32_t kStudioSky = 256;

constexpr const char* kPathGroup = "Path tracing (--integrator path)";

std::vector<Vec3> backdrop(std::uint32_t height) {
  std::vector<Vec3> rows;
  for (std::uint32_t y = 0; y < height; ++y)
    rows.push_back(Studio::backdrop(1.0f - (static_cast<float>(y) + 0.5f) / static_cast<float>(height)));
  return rows;
}

}  // namespace

void PathCommand::add_options(CLI::App& app) {
  app.add_option(
         "--integrator", integrator_,
         "path: path tracing with materials, instead of a --mode. The picture is saved from time to time; press "
         "Ctrl-C to stop and keep the picture rendered so far")
      ->check(CLI::IsMember({"path"}))
      ->type_name("NAME")
      ->group(kPathGroup);
  app.add_option("--bounces", bounces_, "Most surfaces between the first one and a light")
      ->check(CLI::Range(0u, 1024u))
      ->type_name("N")
      ->capture_default_str()
      ->group(kPathGroup);
  app.add_option("--materials", materials_,
                 "Files that bvhbuild was given, in the same order, for their materials. Without them everything is "
                 "clay. Spheres and curves are always clay")
      ->type_name("FILE...")
      ->group(kPathGroup);
  app.add_option("--environment", environment_,
                 "The sky, an equirectangular OpenEXR picture, +y up. Default: the light of a studio")
      ->type_name("FILE")
      ->group(kPathGroup);
}

void PathCommand::check(const CLI::App& app) const {
  if (!chosen()) {
    for (const char* option : {"--bounces", "--materials", "--environment"})
      if (app.count(option) != 0) throw CLI::ValidationError(std::string(option) + " is of --integrator path");
    return;
  }
  for (const char* option : {"--mode", "--ao-distance"})
    if (app.count(option) != 0) throw CLI::ValidationError(std::string(option) + " is not of --integrator path");
}

build::Result<void> PathCommand::prepare(const BufferView& bvh, const Camera& camera, const RenderOptions& options,
                                         const std::vector<std::string>& outputs,
                                         const std::function<void(const std::string&)>& warn) {
  std::vector<std::string> inputs = materials_;
  if (!environment_.empty()) inputs.push_back(environment_);
  for (const std::string& output : outputs)
    if (auto checked = check_output(output, inputs); !checked) return checked;
  PathSky sky;
  std::vector<Vec3> behind;
  if (auto read = read_sky(camera, options, sky, behind); !read) return read;
  std::optional<SceneSurfaces> surfaces;
  if (!materials_.empty()) {
    auto loaded = load_surfaces(materials_, bvh, outputs.front());
    if (!loaded) return tl::unexpected(std::move(loaded.error()));
    surfaces = std::move(*loaded);
    for (const std::string& warning : surfaces->warnings) warn(warning);
  }
  const Shutter& shutter = options.shutter;
  auto data = make_path_data(bvh, surfaces ? &*surfaces : nullptr, std::move(sky), std::move(behind),
                             0.5f * shutter.open + 0.5f * shutter.close);
  if (!data) return tl::unexpected(std::move(data.error()));
  data_ = std::move(*data);
  return {};
}

build::Result<void> PathCommand::read_sky(const Camera& camera, const RenderOptions& options, PathSky& sky,
                                          std::vector<Vec3>& behind) const {
  if (environment_.empty()) {
    const Studio studio(camera);
    sky = make_sky([&](const Vec3& direction) { return studio.sky(direction); }, kStudioSky);
    behind = backdrop(options.height);
    return {};
  }
  const auto picture = read_exr_colors(environment_);
  if (!picture) return tl::unexpected(picture.error());
  sky = make_sky(picture->colors, picture->width, picture->height);
  return {};
}

build::Result<void> PathCommand::prepare_sky(const Camera& camera, const RenderOptions& options,
                                             const std::vector<std::string>& outputs) {
  if (!materials_.empty())
    return invalid_input("--materials: a scene in parts has the materials that bvhbuild --parts found");
  if (!environment_.empty())
    for (const std::string& output : outputs)
      if (auto checked = check_output(output, std::span(&environment_, 1)); !checked) return checked;
  PathSky sky;
  PathData data;
  if (auto read = read_sky(camera, options, sky, data.backdrop); !read) return read;
  data.sky = std::move(sky.radiance);
  data.sky_rows = std::move(sky.rows);
  data.sky_columns = std::move(sky.columns);
  data_ = std::move(data);
  return {};
}

PathOptions PathCommand::options(const RenderOptions& options) const {
  return {options.width, options.height, options.samples, options.seed, bounces_, options.shutter, options.threads};
}

build::Result<Image> PathCommand::layers(const SceneView& scene, const Camera& camera, RenderOptions options,
                                         const std::function<void(double)>& progress) const {
  if (!options.layers) {
    Image image(options.width, options.height);
    image.has_instances = scene.instances != nullptr;
    return image;
  }
  const PathOptions of_paths = this->options(options);
  options.mode = RenderMode::kPrimary;
  options.samples = 1;
  auto rendering = tools::render(scene, camera, options, progress);
  if (!rendering) return tl::unexpected(std::move(rendering.error()));
  if (auto stored = store_surfaces(scene, *data_, camera, of_paths, rendering->image); !stored)
    return tl::unexpected(std::move(stored.error()));
  return std::move(rendering->image);
}

void PathCommand::take(const PathPicture& picture, bool on_gpu, Rendering& rendering) {
  store(picture, rendering.image);
  const PathRayCounts& rays = picture.rays;
  const std::uint64_t all = rays.camera + rays.secondary + rays.shadow;
  rendering.rays = {rays.camera, rays.shadow, on_gpu ? all : 0, rays.secondary};
  rendering.threads = picture.threads;
  rendering.seconds = picture.seconds;
  rendering.samples = picture.samples;
}

build::Result<Rendering> PathCommand::render(const BufferView& bvh, const Camera& camera, const RenderOptions& options,
                                             GpuTracer* gpu, ProgressBar& bar,
                                             const std::function<void(const Rendering&)>& keep) const {
  const HostPart host;
  const SceneView scene = gpu != nullptr ? make_scene_view(bvh) : host.scene(bvh);
  const PathOptions of_paths = this->options(options);
  auto image = layers(scene, camera, options, [&](double done) { bar.update("layers", done); });
  if (!image) return tl::unexpected(std::move(image.error()));
  std::optional<GpuPathTracer> on_gpu;
  if (gpu != nullptr) {
    auto made = GpuPathTracer::make(*gpu, *data_, settings_of(of_paths, camera));
    if (!made) return tl::unexpected(std::move(made.error()));
    on_gpu = std::move(*made);
  }
  Rendering rendering{std::move(*image), {}, 0, 0.0, 0, 0.0};
  double next = 1.0;
  const PathProgress progress{[&](double done) { bar.update("render", done); },
                              [&](const PathPicture& picture) {
                                if (picture.seconds < next) return;
                                next = 2.0 * picture.seconds;
                                take(picture, gpu != nullptr, rendering);
                                keep(rendering);
                              }};
  const auto picture = trace_paths(scene, *data_, camera, of_paths, progress, on_gpu ? &*on_gpu : nullptr);
  if (!picture) return tl::unexpected(picture.error());
  if (picture->samples == 0)
    return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "cancelled, nothing was written"});
  take(*picture, gpu != nullptr, rendering);
  return rendering;
}

}  // namespace hiprt::tools
