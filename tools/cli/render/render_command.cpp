#include <tools/cli/render/render_command.h>

#include <tools/base/errors.h>
#include <tools/base/read_input.h>
#include <tools/base/text.h>
#include <tools/cli/cli.h>
#include <tools/cli/render/picture_options.h>
#include <tools/cli/render/render_names.h>
#include <tools/cli/trace_device.h>
#include <tools/render/scene/shutter.h>

#include <CLI/CLI.hpp>

#include <filesystem>

namespace hiprt::tools {
namespace {

constexpr unsigned kDefaultLevel = 3;

// CLI11 validators return an empty string, or what is wrong.

bool names_camera_file(const std::string& text) {
  std::error_code error;
  return has_extension(text, ".cam") || std::filesystem::is_regular_file(text, error);
}

std::string check_distance(const std::string& text) {
  const auto distance = parse_real<float>(text);
  return distance && *distance > 0.0f ? std::string() : in_quotes(text) + " is not a distance above 0";
}

/// Camera files are read later, when the whole command line has been checked.
std::string check_camera(const std::string& text) {
  if (names_camera_file(text)) return {};
  const auto camera = parse_camera(text);
  return camera ? std::string() : camera.error();
}

void add_file_options(CLI::App& app, RenderCommand& command) {
  app.add_option("FILE", command.path, "BVH file to render")->required()->type_name("")->group(kInputGroup);
  app.add_option("-o,--output", command.outputs, "Picture to write, .exr or .png. May be given several times")
      ->required()
      ->check(CLI::Validator(check_picture_name, ""))
      ->allow_extra_args(false)
      ->type_name("FILE")
      ->group(kOutputGroup);
  app.add_option("--size", command.size, "Width and height in pixels")
      ->check(CLI::Validator(check_size, ""))
      ->type_name("WxH")
      ->capture_default_str()
      ->group(kOutputGroup);
}

void add_picture_options(CLI::App& app, RenderCommand& command) {
  constexpr const char* kGroup = "Picture";
  app.add_option("--spp", command.render.samples, "Samples per pixel. 1: one ray through the pixel's centre")
      ->check(CLI::Range(1u, 65536u))
      ->type_name("N")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--camera", command.camera,
                 "\"ex,ey,ez/ax,ay,az/ux,uy,uz/fov\" (eye, at, up, vertical degrees) or a .cam file. Default: a "
                 "camera that sees the whole scene")
      ->check(CLI::Validator(check_camera, ""))
      ->type_name("CAMERA")
      ->group(kGroup);
  app.add_option("--mode", command.mode, "What to draw")
      ->check(CLI::IsMember(words(kRenderModes)))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--ao-distance", command.render.ao_distance,
                 "ao: farther surfaces cast no shadow. Default: all surfaces do")
      ->check(CLI::Validator(check_distance, ""))
      ->type_name("D")
      ->group(kGroup);
  app.add_option("--level", command.level,
                 "bvh: level of the tree whose boxes are drawn. 0: the scene's box, 1: the root's children, and so on "
                 "(default: " +
                     std::to_string(kDefaultLevel) + ")")
      ->check(CLI::Range(0u, 100000u))
      ->type_name("K")
      ->group(kGroup);
  app.add_option("--shutter", command.shutter, "Times at which the shutter opens and closes, for scenes that move")
      ->check(CLI::Validator(check_shutter, ""))
      ->type_name("OPEN,CLOSE")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--seed", command.render.seed, "Seed of the random numbers: another seed gives other noise")
      ->type_name("N")
      ->capture_default_str()
      ->group(kGroup);
}

/// Text of the camera, from the command line or from its file.
build::Result<std::string> camera_text(const RenderCommand& command, bool file) {
  if (!file) return command.camera;
  const auto bytes = read_input(command.camera);
  if (!bytes) return fail(build::ErrorCode::kIo, "camera file: " + bytes.error().message);
  return std::string(reinterpret_cast<const char*>(bytes->bytes().data()), bytes->size());
}

build::Result<Camera> whole_view(const RenderCommand& command, const Box& bounds) {
  const double aspect = static_cast<double>(command.render.width) / command.render.height;
  const auto camera = checked(automatic_camera(bounds, aspect));
  if (camera) return *camera;
  return invalid_input(command.path + ": no camera sees the whole scene (" + camera.error() +
                       "); give one with --camera");
}

}  // namespace

void RenderCommand::finish() {
  const PictureSize pixels = *parse_size(size);
  render.width = pixels.width;
  render.height = pixels.height;
  render.shutter = *parse_shutter(shutter);
  render.mode = value_of(kRenderModes, mode);
  render.layers = false;
  for (const std::string& output : outputs) render.layers |= is_exr(output);
}

unsigned RenderCommand::tree_level() const { return level.value_or(kDefaultLevel); }

std::string RenderCommand::mode_name() const { return paths.chosen() ? "path" : mode; }

std::string RenderCommand::mode_text() const {
  if (paths.chosen() || render.mode != RenderMode::kBoxes) return mode_name();
  return mode + ", level " + std::to_string(tree_level());
}

void add_render_options(CLI::App& app, RenderCommand& command) {
  add_file_options(app, command);
  add_picture_options(app, command);
  command.paths.add_options(app);
  command.compare.add_options(app);
  add_resume_options(app, command.resume,
                     "Keep finished parts of the picture in this file, and go on from them if it exists. The file is "
                     "removed when the picture is written. The picture is the same");
  add_rank_options(app, command.ranks);
  app.add_option("--ray-memory", command.ranks.ray_memory,
                 "Scenes in parts: memory of each process for rays and their messages, for example 64M or 1G")
      ->transform(CLI::AsSizeValue(/*kb_is_1000=*/false))
      ->type_name("SIZE")
      ->default_str("256M")
      ->group(kRanksGroup);
  add_device_option(app, command.device);
  add_threads_option(app, command.render.threads);
  add_memory_option(app, command.max_memory);
  app.callback([&app, &command] {
    if (command.level && value_of(kRenderModes, command.mode) != RenderMode::kBoxes)
      throw CLI::ValidationError("--level is of --mode bvh");
    command.paths.check(app);
  });
}

build::Result<Camera> choose_camera(const RenderCommand& command, const Box& bounds) {
  if (command.camera.empty()) return whole_view(command, bounds);
  const bool file = names_camera_file(command.camera);
  const auto text = camera_text(command, file);
  if (!text) return tl::unexpected(text.error());
  const auto camera = parse_camera(*text);
  if (camera) return *camera;
  return invalid_input("camera " + (file ? command.camera + ": " : "") + camera.error());
}

}  // namespace hiprt::tools
