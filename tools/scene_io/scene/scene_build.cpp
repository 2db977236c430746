#include <tools/scene_io/scene/scene_build.h>

#include <tools/cli/build_meshes.h>
#include <tools/cli/mesh_inputs.h>
#include <tools/cli/shape_inputs.h>
#include <tools/scene_io/parallel.h>

#include <hiprt_build/exec/stopwatch.h>

#include <atomic>
#include <charconv>
#include <mutex>

namespace hiprt::tools {
namespace {

/// Smaller objects are built by one thread each: more would wait for each other.
constexpr std::uint64_t kSmallObject = 1u << 17;

std::uint64_t primitives_of(const SceneDescription& scene, const SceneObject& object) {
  std::uint64_t sum = 0;
  for (const std::size_t mesh : object.meshes) sum += scene.meshes[mesh].triangles.size();
  for (const std::size_t set : object.shapes) sum += scene.shapes[set].size();
  return sum;
}

std::vector<build::TriangleMesh> views_of(const SceneDescription& scene, const SceneObject& object) {
  std::vector<build::TriangleMesh> result;
  for (const std::size_t i : object.meshes) {
    const Mesh& mesh = scene.meshes[i];
    result.push_back({mesh.positions, mesh.triangles, 0xffffffffu, mesh.name});
  }
  return result;
}

build::Result<ShapeGeometries> shapes_of(const SceneDescription& scene, const SceneObject& object, unsigned threads) {
  std::vector<const ShapeSet*> sets;
  for (const std::size_t i : object.shapes) sets.push_back(&scene.shapes[i]);
  return ShapeGeometries::make(sets, threads);
}

void add(build::BuildStatistics& sum, const build::BuildStatistics& s) {
  sum.triangles += s.triangles;
  sum.customs += s.customs;
  sum.dropped_not_finite += s.dropped_not_finite;
  sum.dropped_degenerate += s.dropped_degenerate;
  sum.pairs += s.pairs;
  sum.custom_pairs += s.custom_pairs;
  sum.nodes += s.nodes;
  sum.leaves += s.leaves;
  sum.scratch_bytes_peak = std::max(sum.scratch_bytes_peak, s.scratch_bytes_peak);
}

/// All objects' files; what fails first, by number, is the error.
class ObjectBuilder {
 public:
  ObjectBuilder(const SceneDescription& scene, const BuildCommand& command, std::string_view tool, ProgressBar& bar)
      : scene_(scene),
        command_(command),
        tool_(tool),
        bar_(bar),
        limit_(command.threads),
        files_(scene.objects.size()) {}

  build::Result<std::vector<build::Buffer>> run(BuiltScene& result) {
    std::vector<std::size_t> small;
    const bool one_by_one = may_use_gpu(command_) || limit_.threads() == 1;
    for (std::size_t i = 0; i < files_.size() && !failed_; ++i) {
      if (!one_by_one && primitives_of(scene_, scene_.objects[i]) < kSmallObject)
        small.push_back(i);
      else
        build_one(i, command_.threads);
    }
    const auto build_small = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end && !failed_; ++i) build_one(small[i], 1);
    };
    parallel_batches(small.size(), 1, limit_, build_small);
    bar_.clear();
    if (interrupted()) return tl::unexpected(cancelled());
    if (failed_) return tl::unexpected(std::move(error_));
    result.objects = statistics_;
    result.builder = builder_;
    result.on_gpu = on_gpu_;
    result.other_builder = other_builder_;
    result.built_objects = files_.size();
    return std::move(files_);
  }

 private:
  void build_one(std::size_t i, unsigned threads) {
    const SceneObject& object = scene_.objects[i];
    build::BuildOptions options = build_options(command_, tool_, [](const build::Progress&) { return !interrupted(); });
    options.threads = threads;
    auto built = build_object(object, options);
    const std::lock_guard lock(reporting_);
    if (!built) {
      if (failed_ && i > failed_object_) return;
      failed_object_ = i;
      error_ = {built.error().code, scene_.path + ": " + object.name + ": " + built.error().message};
      failed_ = true;
      return;
    }
    add(statistics_, built->bvh.statistics);
    builder_ = built->builder;
    on_gpu_ = on_gpu_ || built->on_gpu;
    other_builder_ += built->bvh.statistics.builder != built->builder ? 1 : 0;
    files_[i] = std::move(built->bvh.buffer);
    bar_.update("objects", static_cast<double>(++done_) / static_cast<double>(files_.size()));
  }

  build::Result<Built> build_object(const SceneObject& object, const build::BuildOptions& options) const {
    const auto shapes = shapes_of(scene_, object, options.threads);
    if (!shapes) return tl::unexpected(shapes.error());
    const std::vector<build::TriangleMesh> meshes = views_of(scene_, object);
    return build_meshes({meshes, shapes->customs()}, command_, options);
  }

  const SceneDescription& scene_;
  const BuildCommand& command_;
  std::string_view tool_;
  ProgressBar& bar_;
  ThreadLimit limit_;
  std::vector<build::Buffer> files_;
  std::mutex reporting_;  ///< For all below.
  std::atomic<bool> failed_ = false;
  std::size_t failed_object_ = 0, done_ = 0, other_builder_ = 0;
  build::Error error_{};
  build::BuildStatistics statistics_{};
  build::Builder builder_{};
  bool on_gpu_ = false;
};

/// "group 2, instance 5: ..." of the library, with the description's words for the place.
std::string in_description(const SceneDescription& scene, const std::string& message) {
  std::string whole = scene.path + ": " + message;
  std::string_view rest = message;
  const auto number_after = [&](std::string_view word, std::size_t& number) {
    if (!rest.starts_with(word)) return false;
    rest.remove_prefix(word.size());
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return error == std::errc{};
  };
  std::size_t group = 0, instance = 0;
  if (!number_after("group ", group) || group >= scene.groups.size()) return whole;
  std::string place = scene.path + ": " + scene.groups[group].place;
  if (number_after(", instance ", instance)) {
    const auto way = scene.merged ? scene.merged->way_of(static_cast<std::uint32_t>(instance), group)
                                  : std::vector{static_cast<std::uint32_t>(instance)};
    for (const std::uint32_t step : way) place += "[" + std::to_string(step) + "]";
  }
  return place + (rest.starts_with(' ') ? ":" : "") + std::string(rest);
}

build::Result<build::Bvh> join(const SceneDescription& scene, std::span<const build::Buffer> files,
                               const BuildCommand& command, std::string_view tool, ProgressBar& bar) {
  std::vector<std::span<const std::byte>> objects;
  std::vector<std::span<const build::Instance>> groups;
  for (const build::Buffer& file : files) objects.push_back(file.bytes());
  for (const SceneGroup& group : scene.groups) groups.emplace_back(group.instances);
  build::InstanceOptions options;
  options.opening_budget = command.opening_budget;
  options.bounds = value_of(kInstanceBounds, command.instance_bounds);
  const build::BuildOptions of_objects = build_options(command, tool, {});
  // Who waits for the best trees of objects waits for the best trees over instances.
  if (of_objects.builder == build::Builder::kHq)
    options.tree = {.builder = build::Builder::kSah, .reinsertion_rounds = 32};
  options.tree.nodes = of_objects.nodes;
  options.tree.threads = command.threads;
  options.tree.tool = tool;
  options.tree.progress = shown_by(bar);
  auto bvh = build::build_instances(build::InstancedScene{objects, groups}, options);
  bar.clear();
  if (interrupted()) return tl::unexpected(cancelled());
  if (!bvh) return tl::unexpected(build::Error{bvh.error().code, in_description(scene, bvh.error().message)});
  return bvh;
}

}  // namespace

build::Result<BuiltScene> build_scene(SceneDescription& scene, const BuildCommand& command, std::string_view tool,
                                      ProgressBar& bar) {
  BuiltScene result;
  build::Stopwatch watch;
  const auto files = ObjectBuilder(scene, command, tool, bar).run(result);
  if (!files) return tl::unexpected(files.error());
  scene.meshes.clear();
  scene.shapes.clear();
  result.object_seconds = watch.lap();
  auto bvh = join(scene, *files, command, tool, bar);
  if (!bvh) return tl::unexpected(std::move(bvh.error()));
  result.file = std::move(bvh->buffer);
  result.instance_seconds = watch.lap();
  return result;
}

}  // namespace hiprt::tools
