#include <tools/cli/render/parts_engine.h>

#include <tools/base/errors.h>
#include <tools/base/memory_limit.h>
#include <tools/base/parallel.h>
#include <tools/base/read_input.h>
#include <tools/cli/bvh_file.h>
#include <tools/parts/part_data.h>
#include <tools/parts/part_owners.h>
#include <tools/render/scene/trace_limits.h>

#include <algorithm>
#include <new>
#include <utility>

namespace hiprt::tools {
namespace {

build::Result<void> check_options(const RenderCommand& command) {
  const auto wrong = [&](const std::string& what) {
    return invalid_input(command.path + " is a scene in parts: " + what);
  };
  if (!command.paths.chosen()) return wrong("only --integrator path renders it");
  if (command.ranks.broadcast) return wrong("each rank reads its own files, --broadcast has none to send");
  if (command.ranks.lossy) return wrong("parts of it are gone with a lost rank, so --lossy-ranks cannot go on");
  return {};
}

/// A part's BVH file and its data, both checked.
struct PartFiles {
  BvhFile bvh;
  PartData data;
};

build::Result<void> check_sum(const std::string& path, const PartFile& file, std::span<const std::byte> bytes) {
  const std::string found = to_text(digest_of(bytes));
  if (found == file.checksum) return {};
  return invalid_input(path + ": the checksum is " + found + ", the manifest says " + file.checksum +
                       "; build the parts again");
}

build::Result<PartData> load_data(const std::string& path, const PartFile& file, const BufferView& bvh,
                                  unsigned threads, std::uint64_t max_memory) {
  const MemoryLimit reading(max_memory);
  // The limit lives on where the error names it.
  try {
    const auto bytes = read_input(path, threads);
    if (!bytes) return tl::unexpected(bytes.error());
    if (auto checked = check_sum(path, file, bytes->bytes()); !checked)
      return tl::unexpected(std::move(checked.error()));
    auto data = decode_part_data(bytes->bytes(), bvh);
    if (!data) return fail(data.error().code, path + ": " + data.error().message);
    return data;
  } catch (const std::bad_alloc& failure) {
    return tl::unexpected(not_enough_memory(path, "to read it", failure));
  }
}

build::Result<PartFiles> load_part(const PartManifest& manifest, const ScenePart& part, unsigned threads,
                                   std::uint64_t max_memory) {
  PartFiles files;
  const std::string bvh_path = manifest.path_of(part.bvh), data_path = manifest.path_of(part.data);
  auto bvh = load_bvh(bvh_path, max_memory, threads);
  if (!bvh) return tl::unexpected(std::move(bvh.error()));
  files.bvh = std::move(*bvh);
  if (auto checked = check_sum(bvh_path, part.bvh, std::as_const(files.bvh.buffer).bytes()); !checked)
    return tl::unexpected(std::move(checked.error()));
  if (auto checked = check_traceable(bvh_path, files.bvh.view); !checked)
    return tl::unexpected(std::move(checked.error()));
  const std::uint32_t levels = files.bvh.view.header->levels;
  if (levels == 0 || levels > manifest.levels)
    return invalid_input(bvh_path + ": it has " + std::to_string(levels) +
                         " levels of instances, the manifest says 1 to " + std::to_string(manifest.levels));
  auto data = load_data(data_path, part.data, files.bvh.view, threads, max_memory);
  if (!data) return tl::unexpected(std::move(data.error()));
  files.data = std::move(*data);
  return files;
}

}  // namespace

build::Result<PartScene> read_part_scene(const RenderCommand& command) {
  if (auto checked = check_options(command); !checked) return tl::unexpected(std::move(checked.error()));
  auto bytes = read_input(command.path);
  if (!bytes) return tl::unexpected(std::move(bytes.error()));
  return part_scene_of(command, std::move(*bytes));
}

build::Result<PartScene> part_scene_of(const RenderCommand& command, build::Buffer bytes) {
  const auto raw = std::as_const(bytes).bytes();
  auto manifest = parse_part_manifest({reinterpret_cast<const char*>(raw.data()), raw.size()}, command.path);
  if (!manifest) return tl::unexpected(std::move(manifest.error()));
  if (manifest->levels > kTraceLevels)
    return fail(build::ErrorCode::kTooLarge, command.path + ": " + std::to_string(manifest->levels) +
                                                 " levels of instances, the limit is " + std::to_string(kTraceLevels));
  return PartScene{std::move(bytes), std::move(*manifest)};
}

build::Result<std::unique_ptr<PartsEngine>> PartsEngine::make(const RenderCommand& command, const PartScene& scene,
                                                              const Camera& camera, Ranks& ranks,
                                                              const GpuChoice& gpus) {
  std::unique_ptr<PartsEngine> engine(new PartsEngine(command, scene, ranks));
  const PathOptions options = command.paths.options(command.render);
  const PathSettings settings = settings_of(options, camera);
  const auto size = static_cast<unsigned>(ranks.size()), rank = static_cast<unsigned>(ranks.rank());
  const unsigned threads = ThreadLimit(options.threads).threads();
  // While one wave waits for answers, another one is worked on.
  const unsigned workers = std::min(size == 1 ? threads : 2 * threads, RayMail::kMostSlots - 1);
  const auto memory = RayMemory::divide(command.ranks.ray_memory, size, workers, scene.manifest.levels);
  if (!memory) return tl::unexpected(memory.error());
  PartExchange::Setup setup;
  setup.manifest = &scene.manifest;
  setup.owner = owners_of(scene.manifest.parts, size);
  setup.credit = memory->credit;
  setup.servers = threads;
  if (size > 1) setup.mail = &engine->mail_;
  if (auto loaded = engine->load_shared(settings, setup); !loaded) return tl::unexpected(std::move(loaded.error()));
  for (std::size_t i = 0; i < scene.manifest.parts.size(); ++i) {
    auto& tracer = setup.tracers.emplace_back();
    if (setup.owner[i] != rank) continue;
    auto loaded = engine->load_own(i, settings, gpus);
    if (!loaded) return tl::unexpected(std::move(loaded.error()));
    tracer = std::move(*loaded);
  }
  engine->exchange_ = std::make_unique<PartExchange>(std::move(setup));
  engine->work_ =
      std::make_unique<PartWork>(*engine->shared_, *engine->exchange_, options.samples, workers, memory->paths);
  return engine;
}

build::Result<void> PartsEngine::load_shared(const PathSettings& settings, PartExchange::Setup& setup) {
  std::optional<PartData> data;
  SceneView view;
  if (scene_.manifest.shared) {
    auto files = load_part(scene_.manifest, *scene_.manifest.shared, command_.render.threads, command_.max_memory);
    if (!files) return tl::unexpected(std::move(files.error()));
    shared_file_ = std::move(files->bvh);
    data = std::move(files->data);
    view = shared_host_.scene(shared_file_.view);
    setup.shared_numbers = PathNumbers(shared_file_.view, std::move(data->groups));
  }
  const PathData& sky = command_.paths.data();
  const Shutter& shutter = settings.shutter;
  auto arrays = make_path_data(shared_file_.view, data && data->surfaces ? &*data->surfaces : nullptr,
                               {sky.sky, sky.sky_rows, sky.sky_columns}, sky.backdrop,
                               0.5f * shutter.open + 0.5f * shutter.close);
  if (!arrays) return tl::unexpected(std::move(arrays.error()));
  shared_data_ = std::move(*arrays);
  shared_ = PathScene{view, views(shared_data_), settings};
  setup.shared = &*shared_;
  setup.shared_alpha_cutout = has_alpha_cutout(shared_data_);
  return {};
}

build::Result<std::unique_ptr<PartTracer>> PartsEngine::load_own(std::size_t number, const PathSettings& settings,
                                                                 const GpuChoice& gpus) {
  const ScenePart& part = scene_.manifest.parts[number];
  auto files = load_part(scene_.manifest, part, command_.render.threads, command_.max_memory);
  if (!files) return tl::unexpected(std::move(files.error()));
  auto tracer =
      PartTracer::make(std::move(files->bvh.buffer), std::move(files->data), scene_.manifest.levels, settings);
  if (!tracer) return fail(tracer.error().code, scene_.manifest.path_of(part.bvh) + ": " + tracer.error().message);
  auto gpu = choose_device(value_of(kDeviceChoices, command_.device), (*tracer)->view(), {}, gpus);
  if (!gpu) return tl::unexpected(std::move(gpu.error()));
  if (!*gpu) return tracer;
  gpu_name_ = (*gpu)->device_name();
  if (auto moved = (*tracer)->move_to(std::move(**gpu)); !moved) return tl::unexpected(std::move(moved.error()));
  return tracer;
}

build::Result<Image> PartsEngine::layers() {
  Image image(command_.render.width, command_.render.height);
  image.has_instances = true;
  if (!command_.render.layers) return image;
  if (auto stored = store_part_layers(*shared_, *exchange_, work_->other_slot(), layers_stopped_, image); !stored)
    return tl::unexpected(std::move(stored.error()));
  return image;
}

}  // namespace hiprt::tools
