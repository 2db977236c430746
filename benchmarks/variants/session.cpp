#include "session.h"

#include "check.h"

#include <hiprt_build/format/only_instance.h>
#include <hiprt_device/instances/placed_object.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

namespace hiprt::bench {
namespace {

constexpr std::string_view kLayoutNames[] = {"", "float", "planes", "half", "quantized"};
static_assert(static_cast<int>(NodeLayout::kFloat) == 1 && static_cast<int>(NodeLayout::kQuantized) == 4);

bool contains(const std::vector<std::string>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

TreeRecord record_of(const Tree& tree) {
  const FileHeader& header = *tree.view.header;
  return {tree.scene,
          tree.name,
          tree.path.string(),
          std::string(kLayoutNames[header.layout]),
          header.byte_size,
          header.primitive_count,
          tree.view.node_count(),
          tree.view.leaves.count,
          header.stack_bound,
          header.features,
          std::string(tree.view.provenance)};
}

/// One session's state.
class Session {
 public:
  Session(Engine& engine, const SessionOptions& options, const std::function<void(const std::string&)>& progress)
      : engine_(engine), options_(options), progress_(progress) {}

  build::Result<Report> run() {
    for (const std::filesystem::path& path : options_.trees)
      if (auto done = run_tree(path); !done) return tl::unexpected(done.error());
    compare_checksums();
    return std::move(report_);
  }

 private:
  /// Computed at first use.
  using HostResultsByQuery = std::array<std::optional<HostResults>, 3>;

  build::Result<void> run_tree(const std::filesystem::path& path) {
    const auto tree = load_tree(path);
    if (!tree) return tl::unexpected(tree.error());
    if (!contains_layout(*tree)) return {};
    if (auto loaded = load_scene_rays(*tree); !loaded) return loaded;
    if (auto set = engine_.set_tree(*tree); !set) return set;
    report_.trees.push_back(record_of(*tree));
    const bool vulkan = options_.vulkan != nullptr && options_.vulkan->set_tree(*tree);
    for (const RayBuffer& rays : rays_)
      if (auto done = run_rays(*tree, rays, vulkan); !done) return done;
    return {};
  }

  /// Whether any wanted variant is for the tree's layout.
  bool contains_layout(const Tree& tree) const {
    const std::string_view layout = kLayoutNames[tree.view.header->layout];
    return std::any_of(engine_.variants().begin(), engine_.variants().end(), [&](const Variant& variant) {
      return variant.name.layout == layout && is_wanted(variant.name, options_.values);
    });
  }

  /// All trees of a scene are traced with the same rays.
  build::Result<void> load_scene_rays(const Tree& tree) {
    if (tree.scene == rays_scene_) return {};
    rays_.clear();
    rays_scene_ = tree.scene;
    auto files = options_.ray_files;
    if (files.empty()) files = find_rays(tree.path.parent_path(), tree.scene);
    if (files.empty()) {
      const bool only_primary = options_.kinds == std::vector<std::string>{"primary"};
      auto made = make_rays(tree, options_.camera_file, options_.picture, only_primary);
      if (!made) return tl::unexpected(made.error());
      rays_ = std::move(*made);
    }
    for (const std::filesystem::path& file : files) {
      auto loaded = load_rays(file);
      if (!loaded) return tl::unexpected(loaded.error());
      rays_.push_back(std::move(*loaded));
    }
    std::erase_if(
        rays_, [&](const RayBuffer& rays) { return !options_.kinds.empty() && !contains(options_.kinds, rays.kind); });
    return {};
  }

  build::Result<void> run_rays(const Tree& tree, const RayBuffer& rays, bool vulkan) {
    if (auto set = engine_.set_rays(rays); !set) return set;
    HostResultsByQuery hosts;
    const FileHeader& header = *tree.view.header;
    std::size_t measured = 0;
    for (std::size_t i = 0; i < engine_.variants().size(); ++i) {
      const Variant& variant = engine_.variants()[i];
      const bool fits = variant.name.layout == kLayoutNames[header.layout] &&
                        (variant.query == Query::kAny) == rays.any_hit &&
                        (header.features & ~(variant.features | kFeaturesWithoutCode)) == 0 &&
                        header.levels <= variant.levels && (!variant.placed || only_instance(tree.view));
      if (!fits || !is_wanted(variant.name, options_.values)) continue;
      auto& host = hosts[static_cast<std::size_t>(variant.query)];
      if (!host) host.emplace(tree, engine_.rays(), variant.query);
      run_variant(i, rays, *host);
      ++measured;
    }
    if (vulkan) {
      auto& host = hosts[static_cast<std::size_t>(rays.any_hit ? Query::kAny : Query::kClosest)];
      if (!host) host.emplace(tree, engine_.rays(), rays.any_hit ? Query::kAny : Query::kClosest);
      options_.vulkan->run(rays, engine_.rays(), *host, options_.repetitions);
    }
    progress_(tree.path.filename().string() + ", " + rays.kind + ": " + std::to_string(engine_.rays().size()) +
              " rays, " + std::to_string(measured) + " variants");
    return {};
  }

  void run_variant(std::size_t variant, const RayBuffer& rays, const HostResults& host) {
    Result result;
    result.tree = report_.trees.size() - 1;
    result.variant = variant;
    result.kind = rays.kind;
    result.ray_order = rays.origin;
    result.rays = engine_.rays().size();
    auto outcome = engine_.run(variant, options_.repetitions);
    if (outcome)
      judge(result, *outcome, host);
    else
      result.problem = outcome.error().message;
    if (!result.problem.empty()) report_.faults.push_back(describe(result) + ": " + result.problem);
    report_.results.push_back(std::move(result));
  }

  void judge(Result& result, Outcome& outcome, const HostResults& host) {
    const Variant& variant = engine_.variants()[result.variant];
    std::vector<double>& times = outcome.milliseconds;
    if (times.empty()) return;
    std::sort(times.begin(), times.end());
    result.repetitions = static_cast<unsigned>(times.size());
    result.min_ms = times.front();
    result.median_ms = times[times.size() / 2];
    result.max_ms = times.back();
    result.mrays_s = static_cast<double>(result.rays) / (result.median_ms * 1e3);
    result.overflowed = outcome.overflowed;
    result.checksum = checksum(outcome.results, variant.query);
    result.hits = count_hits(outcome.results, variant.query);
    const HostResults::Comparison comparison = host.compare(outcome.results);
    result.checked = comparison.checked;
    result.wrong = comparison.wrong;
    result.other_primitives = comparison.other_primitives;
    if (result.wrong != 0 && is_exact(variant.name))
      result.problem = std::to_string(result.wrong) + " of " + std::to_string(result.checked) +
                       " rays differ from the host's results";
  }

  /// Every exact variant must have the same results for the same rays and query, whatever the tree.
  void compare_checksums() {
    std::map<std::tuple<std::string, std::string, Query>, const Result*> first;
    for (const Result& result : report_.results) {
      const Variant& variant = engine_.variants()[result.variant];
      if (!is_exact(variant.name) || !result.problem.empty() || result.overflowed != 0) continue;
      const Result*& other = first[{report_.trees[result.tree].scene, result.kind, variant.query}];
      if (other == nullptr) other = &result;
      if (other->checksum != result.checksum)
        report_.faults.push_back(describe(result) + ": other results than " + describe(*other));
    }
  }

  std::string describe(const Result& result) const {
    const TreeRecord& tree = report_.trees[result.tree];
    std::string text = tree.scene + "." + tree.name + " " + result.kind + ":";
    for (const Axis& axis : kAxes) text += " " + std::string(engine_.variants()[result.variant].name.*axis.value);
    return text;
  }

  Engine& engine_;
  const SessionOptions& options_;
  const std::function<void(const std::string&)>& progress_;
  std::string rays_scene_;
  std::vector<RayBuffer> rays_;
  Report report_;
};

}  // namespace

bool is_wanted(const VariantName& name, const std::vector<std::vector<std::string>>& values) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!values[i].empty() && !contains(values[i], name.*kAxes[i].value)) return false;
  return true;
}

build::Result<Report> run_session(Engine& engine, const SessionOptions& options,
                                  const std::function<void(const std::string&)>& progress) {
  return Session(engine, options, progress).run();
}

}  // namespace hiprt::bench
