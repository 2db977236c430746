#include <tools/build/build_scene.h>

#include <tools/base/interrupt.h>
#include <tools/base/parallel.h>
#include <tools/build/build_meshes.h>
#include <tools/build/build_progress.h>
#include <tools/build/bvh_cache.h>
#include <tools/build/gpu_builder.h>
#include <tools/build/shape_geometries.h>

#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/format/view.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <mutex>

namespace hiprt::tools {
namespace {

/// Objects with fewer primitives are built by one thread each: the threads of one build would wait for each other.
constexpr std::uint64_t kSmallObject = 1u << 17;

std::uint64_t primitives_of(const SceneDescription& scene, const SceneObject& object) {
  std::uint64_t sum = 0;
  for (const std::size_t mesh : object.meshes) sum += scene.meshes[mesh].triangles.size();
  for (const std::size_t set : object.shapes) sum += scene.shapes[set].size();
  return sum;
}

std::vector<build::TriangleMesh> views_of(const SceneDescription& scene, const SceneObject& object) {
  std::vector<build::TriangleMesh> result;
  for (const std::size_t i : object.meshes) result.push_back(view_of(scene.meshes[i]));
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

void add(CacheCounts& sum, const CacheCounts& counts) {
  sum.hits += counts.hits;
  sum.misses += counts.misses;
  sum.damaged += counts.damaged;
  if (sum.first_damage.empty()) sum.first_damage = counts.first_damage;
  if (sum.first_not_stored.empty()) sum.first_not_stored = counts.first_not_stored;
}

/// Builds the files of all objects. If several objects fail, the error is that of the lowest number.
class ObjectBuilder {
 public:
  ObjectBuilder(const SceneDescription& scene, const BuildRequest& request, const ProgressSink& progress)
      : scene_(scene),
        request_(request),
        progress_(progress),
        limit_(request.options.threads),
        files_(scene.objects.size()) {
    request_.options.progress = [](const build::Progress&) { return !interrupted(); };
  }

  build::Result<std::vector<build::Buffer>> run(BuiltScene& result) {
    std::vector<std::size_t> small;
    const bool one_by_one = request_.device != DeviceChoice::kCpu || limit_.threads() == 1;
    for (std::size_t i = 0; i < files_.size() && !failed_; ++i) {
      if (!one_by_one && primitives_of(scene_, scene_.objects[i]) < kSmallObject)
        small.push_back(i);
      else
        build_one(i, request_.options.threads);
    }
    const auto build_small = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end && !failed_; ++i) build_one(small[i], 1);
    };
    parallel_batches(small.size(), 1, limit_, build_small);
    if (interrupted()) return cancelled();
    if (failed_) return tl::unexpected(std::move(error_));
    result.objects = statistics_;
    result.builder = builder_;
    result.on_gpu = on_gpu_;
    result.other_builder = other_builder_;
    result.built_objects = files_.size();
    result.cache = cache_;
    return std::move(files_);
  }

 private:
  void build_one(std::size_t i, unsigned threads) {
    const SceneObject& object = scene_.objects[i];
    BuildRequest request = request_;
    request.options.threads = threads;
    CacheCounts cache;
    auto built = build_object(object, request, cache);
    const std::lock_guard lock(reporting_);
    add(cache_, cache);
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
    progress_("objects", static_cast<double>(++done_) / static_cast<double>(files_.size()));
  }

  build::Result<Built> build_object(const SceneObject& object, const BuildRequest& request, CacheCounts& cache) const {
    const auto shapes = shapes_of(scene_, object, request.options.threads);
    if (!shapes) return tl::unexpected(shapes.error());
    const std::vector<build::TriangleMesh> meshes = views_of(scene_, object);
    return build_or_reuse({meshes, shapes->customs()}, request, cache);
  }

  const SceneDescription& scene_;
  BuildRequest request_;
  const ProgressSink& progress_;
  ThreadLimit limit_;
  std::vector<build::Buffer> files_;
  std::mutex reporting_;  ///< Guards all members below.
  std::atomic<bool> failed_ = false;
  std::size_t failed_object_ = 0, done_ = 0, other_builder_ = 0;
  build::Error error_{};
  build::BuildStatistics statistics_{};
  CacheCounts cache_{};
  build::Builder builder_{};
  bool on_gpu_ = false;
};

/// A scene as the library takes it, and where its groups and instances are in the description.
struct LibraryScene {
  std::vector<std::span<const std::byte>> objects;
  std::vector<std::span<const build::Instance>> groups;
  const SceneSelection* selection = nullptr;  ///< nullptr: the numbers are the description's.

  std::size_t group_in_description(std::size_t group) const {
    return selection != nullptr ? selection->groups[group].original : group;
  }
  std::size_t instance_in_description(std::size_t group, std::size_t instance) const {
    if (selection == nullptr || instance >= selection->groups[group].instances.size()) return instance;
    return selection->groups[group].instances[instance];
  }
};

/// Replaces the numbers of a message of the library, "group 2, instance 5: ...", by the description's location of it.
std::string in_description(const SceneDescription& scene, const LibraryScene& built, const std::string& message) {
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
  if (!number_after("group ", group) || group >= built.groups.size()) return whole;
  const bool has_instance = number_after(", instance ", instance);
  instance = built.instance_in_description(group, instance);
  group = built.group_in_description(group);
  std::string location = scene.path + ": " + scene.groups[group].location;
  if (has_instance) {
    const auto path = scene.merged ? scene.merged->path_of(static_cast<std::uint32_t>(instance), group)
                                   : std::vector{static_cast<std::uint32_t>(instance)};
    for (const std::uint32_t step : path) location += "[" + std::to_string(step) + "]";
  }
  return location + (rest.starts_with(' ') ? ":" : "") + std::string(rest);
}

/// Whether the GPU makes the trees over instances: of one level without motion, opened instances and shapes.
bool joins_on_gpu(const LibraryScene& scene, const build::InstanceOptions& options) {
  if (scene.groups.size() != 1 || options.opening_budget > 1.0 ||
      options.bounds == build::InstanceBounds::kPrimitives || options.tree.builder > build::Builder::kHq)
    return false;
  const auto moves = [](const build::Instance& instance) { return instance.motion != nullptr; };
  const auto has_shapes = [](std::span<const std::byte> file) {
    const auto view = open_buffer(file);
    return !view || !view->shapes.empty();
  };
  const auto& instances = scene.groups[0];
  return std::none_of(instances.begin(), instances.end(), moves) &&
         std::none_of(scene.objects.begin(), scene.objects.end(), has_shapes);
}

/// @param on_gpu whether the GPU has built the objects.
build::Result<build::Bvh> join(const SceneDescription& description, const LibraryScene& scene, bool on_gpu,
                               const BuildRequest& request, const ProgressSink& progress) {
  build::InstanceOptions options = request.instances;
  // The best trees over instances go with the best trees of objects.
  if (request.options.builder == build::Builder::kHq)
    options.tree = {.builder = build::Builder::kSah, .reinsertion_rounds = 32};
  options.tree.nodes = request.options.nodes;
  options.tree.threads = request.options.threads;
  options.tree.tool = request.options.tool;
  options.tree.progress = build_progress(progress);
  const bool by_gpu = on_gpu && joins_on_gpu(scene, options);
  auto bvh = by_gpu ? join_on_gpu(scene.objects, scene.groups[0], options)
                    : build::build_instances(build::InstancedScene{scene.objects, scene.groups}, options);
  if (interrupted()) return cancelled();
  if (!bvh && by_gpu && bvh.error().message.starts_with("instance ")) bvh.error().message.insert(0, "group 0, ");
  if (!bvh)
    return tl::unexpected(build::Error{bvh.error().code, in_description(description, scene, bvh.error().message)});
  return bvh;
}

}  // namespace

build::Result<Built> build_or_reuse(const build::SceneInput& scene, const BuildRequest& request, CacheCounts& counts) {
  if (request.cache == nullptr) return build_meshes(scene, request);
  auto result = request.cache->build(scene, request);
  if (!result) return tl::unexpected(std::move(result.error()));
  ++(result->use == CacheUse::kHit ? counts.hits : counts.misses);
  counts.damaged += result->use == CacheUse::kDamaged ? 1 : 0;
  counts.first_damage = std::move(result->damage);
  counts.first_not_stored = std::move(result->not_stored);
  return std::move(result->built);
}

build::Result<std::vector<build::Buffer>> build_objects(SceneDescription& scene, const BuildRequest& request,
                                                        const ProgressSink& progress, BuiltScene& result) {
  build::Stopwatch watch;
  auto files = ObjectBuilder(scene, request, progress).run(result);
  if (!files) return files;
  scene.meshes.clear();
  scene.shapes.clear();
  result.object_seconds = watch.lap();
  return files;
}

build::Result<build::Bvh> build_selection(const SceneDescription& scene, std::span<const build::Buffer> files,
                                          const SceneSelection& selection, bool on_gpu, const BuildRequest& request,
                                          const ProgressSink& progress) {
  LibraryScene part;
  part.selection = &selection;
  for (const std::uint32_t file : selection.files) part.objects.push_back(files[file].bytes());
  std::vector<std::vector<build::Instance>> groups;
  for (const SceneSelection::Group& group : selection.groups) {
    auto& instances = groups.emplace_back();
    for (std::size_t i = 0; i < group.instances.size(); ++i) {
      instances.push_back(scene.groups[group.original].instances[group.instances[i]]);
      instances.back().object = group.objects[i];
    }
  }
  part.groups.assign(groups.begin(), groups.end());
  return join(scene, part, on_gpu, request, progress);
}

build::Result<BuiltScene> build_scene(SceneDescription& scene, const BuildRequest& request,
                                      const ProgressSink& progress) {
  BuiltScene result;
  const auto files = build_objects(scene, request, progress, result);
  if (!files) return tl::unexpected(files.error());
  build::Stopwatch watch;
  LibraryScene whole;
  for (const build::Buffer& file : *files) whole.objects.push_back(file.bytes());
  for (const SceneGroup& group : scene.groups) whole.groups.emplace_back(group.instances);
  auto bvh = join(scene, whole, result.on_gpu, request, progress);
  if (!bvh) return tl::unexpected(std::move(bvh.error()));
  result.file = std::move(bvh->buffer);
  result.instance_seconds = watch.lap();
  return result;
}

}  // namespace hiprt::tools
