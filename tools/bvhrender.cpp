/// bvhrender: a picture of a BVH file.

#include <tools/cli/bvh_file.h>
#include <tools/cli/cli.h>
#include <tools/cli/compare_command.h>
#include <tools/cli/path_command.h>
#include <tools/cli/progress.h>
#include <tools/cli/report.h>
#include <tools/cli/trace_device.h>
#include <tools/cli/trace_names.h>
#include <tools/render/studio/render.h>
#include <tools/render/studio/shutter.h>
#include <tools/scene_io/text.h>

#include <hiprt_build/file.h>
#include <hiprt_build/format/view.h>

#include <charconv>
#include <chrono>
#include <iostream>
#include <optional>
#include <tuple>

namespace {

using namespace hiprt;
using namespace hiprt::tools;

constexpr ToolInfo kInfo{
    "bvhrender",
    "Renders a picture of a BVH file, as OpenEXR or PNG. The BVH file is validated first.\n"
    "EXR layers: R G B linear colour; of the ray through the pixel's centre N (unit normal facing the camera),\n"
    "P (position), Z (distance along the ray, inf: a miss), id.geometry and id.primitive (4294967295: a miss),\n"
    "cost.boxes, cost.leaves and cost.triangles (tests: four boxes; a leaf; its one or two triangles), cost.steps "
    "(both\n"
    "kinds of tests, and instances), cost.fill (part of the tested leaves' places for triangles that is used). Of a "
    "scene of\n"
    "instances also id.instance (the scene's own, by number) and cost.instances (those that the ray came to); "
    "geometry\n"
    "and primitive are then those of the object that was hit.\n"
    "PNG: 8-bit sRGB; colours above 1 are compressed (Reinhard, extended).\n"
    "Modes: ao (clay below a soft sky), primary (lit from the eye), normals (0.5 + 0.5 n), heatmap (tests per ray, "
    "and\n"
    "the instances that it came to, with a histogram), bvh (the boxes --level steps below the scene's, and leaves "
    "above;\n"
    "id.primitive is then the box; those of instances' objects stand as their instances do, at the shutter's middle).\n"
    "The picture depends on the seed, never on the device or the number of threads. Tests are counted on the CPU: for\n"
    "the cost layers of an EXR file the rays through the centres are traced there, and all rays of heatmap.",
    "  bvhrender bunny.bvh -o bunny.png\n"
    "  bvhrender bunny.bvh -o bunny.exr -o bunny.png --size 1920x1080 --spp 256\n"
    "  bvhrender bunny.bvh -o bunny.png --spp 1024 --device gpu\n"
    "  bvhrender bunny.bvh -o cost.png --mode heatmap\n"
    "  bvhrender bunny.bvh -o boxes.png --mode bvh --level 4\n"
    "  bvhrender sponza.bvh -o sponza.png --camera sponza.cam --ao-distance 30\n"
    "  bvhrender scene.bvh -o view.png --camera '0,1,5/0,1,0/0,1,0/40'\n"
    "  bvhrender wheel.bvh -o blurred.png --shutter 0,0.02 --spp 256\n"
    "  bvhrender house.bvh -o house.exr --integrator path --materials house.glb --environment sky.exr --spp 1024\n"
    "  bvhrender bunny.bvh -o bunny.png --spp 16 --compare bunny.exr --difference flip.png\n"};

constexpr unsigned kDefaultLevel = 3;

struct Options {
  std::string path;
  std::vector<std::string> outputs;
  std::string size = "1024x768", camera, mode = "ao", device = "auto", shutter = "0,0";
  std::optional<unsigned> level;  ///< Of --mode bvh.
  RenderOptions render;
  CompareCommand compare;
  PathCommand paths;
};

bool has_extension(const std::string& path, std::string_view extension) {
  std::string found = std::filesystem::path(path).extension().string();
  for (char& c : found) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return found == extension;
}

/// CLI11 validators: an empty string, or what is wrong.
std::string check_extension(const std::string& path) {
  if (has_extension(path, ".exr") || has_extension(path, ".png")) return {};
  return "'" + path + "' ends neither in .exr nor in .png";
}

/// "800x600"; nothing when it is malformed or too large.
std::optional<std::pair<std::uint32_t, std::uint32_t>> parse_size(std::string_view text) {
  std::pair<std::uint32_t, std::uint32_t> size;
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.first);
  if (width.ec != std::errc() || width.ptr == end || *width.ptr != 'x') return std::nullopt;
  const auto height = std::from_chars(width.ptr + 1, end, size.second);
  if (height.ec != std::errc() || height.ptr != end) return std::nullopt;
  if (size.first < 1 || size.second < 1 || size.first > kMaxSide || size.second > kMaxSide) return std::nullopt;
  if (std::uint64_t{size.first} * size.second > kMaxPixels) return std::nullopt;
  return size;
}

std::string check_size(const std::string& text) {
  if (parse_size(text)) return {};
  return "'" + text + "' is not WIDTHxHEIGHT, each 1 to 32768 and 134217728 pixels at most";
}

bool names_camera_file(const std::string& text) {
  std::error_code error;
  return has_extension(text, ".cam") || std::filesystem::is_regular_file(text, error);
}

std::string check_distance(const std::string& text) {
  const auto distance = parse_real<float>(text);
  return distance && *distance > 0.0f ? std::string() : in_quotes(text) + " is not a distance above 0";
}

/// Files are read when the command line makes sense.
std::string check_camera(const std::string& text) {
  if (names_camera_file(text)) return {};
  const auto camera = parse_camera(text);
  return camera ? std::string() : camera.error();
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("FILE", options.path, "The BVH file")->required()->type_name("");
  app.add_option("-o,--output", options.outputs, "The picture, .exr or .png; may be given again")
      ->required()
      ->check(CLI::Validator(check_extension, ""))
      ->allow_extra_args(false)
      ->type_name("FILE");
  app.add_option("--size", options.size, "Pixels")
      ->check(CLI::Validator(check_size, ""))
      ->type_name("WxH")
      ->capture_default_str();
  app.add_option("--spp", options.render.samples, "Samples per pixel; 1: one ray through the pixel's centre")
      ->check(CLI::Range(1u, 65536u))
      ->type_name("N")
      ->capture_default_str();
  app.add_option("--camera", options.camera,
                 "\"ex,ey,ez/ax,ay,az/ux,uy,uz/fov\" (eye, at, up, vertical degrees) or a .cam file; without it the "
                 "whole scene is seen")
      ->check(CLI::Validator(check_camera, ""))
      ->type_name("CAMERA");
  app.add_option("--mode", options.mode, "What is drawn")
      ->check(CLI::IsMember(words(kRenderModes)))
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--level", options.level,
                 "bvh: whose boxes are drawn; 0: the scene's, 1: those of the root's children, and so on (default: " +
                     std::to_string(kDefaultLevel) + ")")
      ->check(CLI::Range(0u, 100000u))
      ->type_name("K");
  add_device_option(app, options.device);
  add_threads_option(app, options.render.threads);
  app.add_option("--seed", options.render.seed, "Another seed, other noise")->type_name("N")->capture_default_str();
  app.add_option("--shutter", options.shutter,
                 "Times from which and until which the picture is taken, of scenes that move")
      ->check(CLI::Validator(check_shutter, ""))
      ->type_name("OPEN,CLOSE")
      ->capture_default_str();
  app.add_option("--ao-distance", options.render.ao_distance,
                 "ao: surfaces farther away cast no shadow; without it all do")
      ->check(CLI::Validator(check_distance, ""))
      ->type_name("D");
  options.compare.add_options(app);
  options.paths.add_options(app);
}

tl::unexpected<build::Error> fail(build::ErrorCode code, std::string message) {
  return tl::unexpected(build::Error{code, std::move(message)});
}

/// @return the scene's own camera when the command line names none.
build::Result<Camera> choose_camera(const Options& options, const Box& bounds) {
  if (options.camera.empty()) {
    const double aspect = static_cast<double>(options.render.width) / options.render.height;
    const auto camera = checked(automatic_camera(bounds, aspect));
    if (camera) return *camera;
    return fail(build::ErrorCode::kInvalidInput, options.path + ": no camera sees the whole scene (" + camera.error() +
                                                     "); please give one by --camera");
  }
  std::string text = options.camera;
  const bool file = names_camera_file(text);
  if (file) {
    const auto bytes = build::map_file(options.camera);
    if (!bytes) return fail(build::ErrorCode::kIo, "camera file: " + bytes.error().message);
    text.assign(reinterpret_cast<const char*>(bytes->bytes().data()), bytes->size());
  }
  const auto camera = parse_camera(text);
  if (camera) return *camera;
  return fail(build::ErrorCode::kInvalidInput, "camera " + (file ? options.camera + ": " : "") + camera.error());
}

/// @return the GPU that traces, or none.
build::Result<std::optional<GpuTracer>> choose_tracer(const Options& options, const BufferView& view) {
  const DeviceChoice choice = value_of(kDeviceChoices, options.device);
  if (options.render.mode != RenderMode::kHeatmap) return choose_device(choice, view);
  if (choice == DeviceChoice::kGpu)
    return fail(build::ErrorCode::kInvalidInput,
                "--mode heatmap counts tests, which only the CPU does: --device auto or cpu, please");
  return std::nullopt;
}

/// "ao", or "bvh, level 3".
std::string described_mode(const Options& options) {
  if (options.paths.chosen()) return "path";
  if (options.render.mode != RenderMode::kBoxes) return options.mode;
  return options.mode + ", level " + std::to_string(options.level.value_or(kDefaultLevel));
}

ImageAttributes attributes_of(const Options& options, const Camera& camera) {
  return {{"software", tool_version(kInfo)},
          {"scene", options.path},
          {"mode", described_mode(options)},
          {"spp", std::to_string(options.render.samples)},
          {"seed", std::to_string(options.render.seed)},
          {"shutter", options.shutter},
          {"camera", to_text(camera)},
          {"comments",
           "N, P, Z, id and cost belong to the ray through the pixel's centre; R, G, B are the mean of spp "
           "samples, linear, sRGB primaries. Z is the distance from the eye along the ray, inf for a miss."}};
}

/// What is looked at: the scene, or the boxes of its tree.
struct Subject {
  std::optional<TreeBoxes> boxes;
  build::Buffer buffer;  ///< Of their BVH.
  BufferView view;
};

build::Result<Subject> choose_subject(const Options& options, const BufferView& scene) {
  Subject subject{{}, {}, scene};
  if (options.render.mode != RenderMode::kBoxes) return subject;
  const Shutter& shutter = options.render.shutter;
  auto boxes = boxes_of_level(scene, options.level.value_or(kDefaultLevel), 0.5f * shutter.open + 0.5f * shutter.close);
  if (!boxes) return fail(boxes.error().code, options.path + ": " + boxes.error().message);
  subject.boxes = std::move(*boxes);
  ProgressBar bar;
  const build::TriangleMesh mesh{.positions = subject.boxes->corners, .triangles = subject.boxes->triangles};
  build::BuildOptions how{.builder = build::Builder::kHploc, .threads = options.render.threads};
  how.progress = [&](const build::Progress& progress) {
    bar.update("boxes", progress.fraction);
    return !interrupted();
  };
  auto bvh = build::build({&mesh, 1}, how);
  if (!bvh) return tl::unexpected(std::move(bvh.error()));
  subject.buffer = std::move(bvh->buffer);
  const auto view = open_buffer(std::as_const(subject.buffer).bytes());
  if (!view) return fail(build::ErrorCode::kInvalidInput, to_string(view.error()));
  subject.view = *view;
  return subject;
}

struct Written {
  std::string path;
  std::size_t bytes;
};

/// @param stops whether interrupted() ends it.
build::Result<std::vector<Written>> write_all(const Options& options, const Camera& camera, const Image& image,
                                              bool stops) {
  std::vector<Written> written;
  ProgressBar bar;
  for (const std::string& path : options.outputs) {
    const auto progress = [&](double done) {
      bar.update("encode", done);
      return !(stops && interrupted());
    };
    const auto bytes = has_extension(path, ".exr") ? write_exr(path, image, attributes_of(options, camera), progress)
                                                   : write_png(path, image, progress);
    if (!bytes) return tl::unexpected(bytes.error());
    written.push_back({path, *bytes});
  }
  return written;
}

build::Result<Rendering> render_with_bar(const Options& options, const BufferView& view, const Camera& camera,
                                         std::optional<GpuTracer>& gpu) {
  ProgressBar bar;
  GpuTracer* const tracer = gpu ? &*gpu : nullptr;
  if (options.paths.chosen()) {
    // What cannot be written now is told of at the end.
    const auto keep = [&](const Rendering& so_far) {
      static_cast<void>(write_all(options, camera, so_far.image, /*stops=*/true));
    };
    return options.paths.render(view, camera, options.render, tracer, bar, keep);
  }
  const auto progress = [&](double done) { bar.update("render", done); };
  return render(make_scene_view(view), camera, options.render, progress, tracer);
}

std::uint64_t rays_of(const Rendering& rendering) {
  return rendering.rays.primary + rendering.rays.secondary + rendering.rays.shadow;
}

double mrays_per_second(const Rendering& rendering) {
  const auto rays = static_cast<double>(rays_of(rendering));
  return rendering.seconds > 0 ? rays / rendering.seconds * 1e-6 : 0.0;
}

void print(const Cli& cli, const Options& options, const Camera& camera, const Rendering& rendering,
           const std::optional<GpuTracer>& gpu, const std::vector<Written>& outputs) {
  const RenderOptions& render = options.render;
  if (!cli.json()) {
    std::cout << render.width << " x " << render.height << " pixels, " << rendering.samples << " samples, "
              << described_mode(options) << ": " << rays_of(rendering) << " rays in " << fixed(rendering.seconds, 2)
              << " s, " << fixed(mrays_per_second(rendering), 2) << " Mrays/s with shading (" << device_word(gpu) << " "
              << device_name(gpu) << ")\n";
    if (render.mode == RenderMode::kHeatmap)
      std::cout << fixed(rendering.mean_steps, 1) << " tests and instances per ray\n";
    for (const Written& output : outputs) std::cout << output.path << "  " << bytes_text(output.bytes) << "\n";
    std::cout << options.compare.text();
    return;
  }
  nlohmann::json files = nlohmann::json::array();
  for (const Written& output : outputs) files.push_back({{"path", output.path}, {"bytes", output.bytes}});
  cli.print({{"file", options.path},
             {"outputs", files},
             {"width", render.width},
             {"height", render.height},
             {"mode", options.paths.chosen() ? "path" : options.mode},
             {"spp", rendering.samples},
             {"seed", render.seed},
             {"camera", to_text(camera)},
             {"device", device_word(gpu)},
             {"device_name", device_name(gpu)},
             {"threads", rendering.threads},
             {"instruction_set", trace_isa()},
             {"primary_rays", rendering.rays.primary},
             {"secondary_rays", rendering.rays.secondary},
             {"shadow_rays", rendering.rays.shadow},
             {"rays_on_gpu", rendering.rays.on_gpu},
             {"seconds", rendering.seconds},
             {"mrays_per_second", mrays_per_second(rendering)},
             {"comparison", options.compare.json()},
             {"steps_per_ray", render.mode == RenderMode::kHeatmap ? nlohmann::json(rendering.mean_steps) : nullptr}});
}

build::Result<void> run(const Cli& cli, Options& options) {
  const InterruptGuard guard;
  std::tie(options.render.width, options.render.height) = *parse_size(options.size);
  options.render.shutter = *parse_shutter(options.shutter);
  options.render.mode = value_of(kRenderModes, options.mode);
  options.render.layers = false;
  for (const std::string& path : options.outputs) options.render.layers |= has_extension(path, ".exr");
  for (const std::string& output : options.outputs)
    if (auto checked = check_output(output, std::span(&options.path, 1)); !checked) return checked;
  if (auto ready = options.compare.prepare(options.render.width, options.render.height, options.path, options.outputs);
      !ready)
    return ready;
  const auto file = load_bvh(options.path, options.render.threads);
  if (!file) return tl::unexpected(file.error());
  if (options.render.mode != RenderMode::kBoxes)
    if (auto checked = check_traceable(options.path, file->view); !checked) return checked;
  const auto camera = choose_camera(options, file->view.header->bounds);
  if (!camera) return tl::unexpected(camera.error());
  const auto subject = choose_subject(options, file->view);
  if (!subject) return tl::unexpected(subject.error());
  if (subject->boxes) options.render.boxes = &*subject->boxes;
  auto gpu = choose_tracer(options, subject->view);
  if (!gpu) return tl::unexpected(gpu.error());
  if (options.paths.chosen())
    if (auto ready = options.paths.prepare(subject->view, *camera, options.render, options.outputs); !ready)
      return ready;
  const auto rendering = render_with_bar(options, subject->view, *camera, *gpu);
  if (!rendering) return tl::unexpected(rendering.error());
  const bool whole = rendering->samples == options.render.samples;
  const auto outputs = write_all(options, *camera, rendering->image, whole);
  if (!outputs) return tl::unexpected(outputs.error());
  if (!whole)
    return fail(build::ErrorCode::kCancelled, "cancelled: " + options.outputs[0] + " has " +
                                                  std::to_string(rendering->samples) + " of " +
                                                  std::to_string(options.render.samples) + " samples");
  if (auto compared = options.compare.run(rendering->image, options.render.threads); !compared) return compared;
  print(cli, options, *camera, *rendering, *gpu, *outputs);
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  Cli cli(kInfo);
  add_options(cli.app(), options);
  cli.app().callback([&] {
    if (options.level && value_of(kRenderModes, options.mode) != RenderMode::kBoxes)
      throw CLI::ValidationError("--level is of --mode bvh");
    options.paths.check(cli.app());
  });
  return cli.run(argc, argv, [&] { return run(cli, options); });
}
