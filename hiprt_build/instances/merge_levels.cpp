#include <hiprt_build/format/out_of_memory.h>
#include <hiprt_build/merge_levels.h>

#include <hiprt_build/input/check_input.h>
#include <hiprt_build/instances/double_matrix.h>

#include <algorithm>
#include <new>
#include <optional>

namespace hiprt::build {
namespace {

/// The one mask that stands for two on a path, if there is one: the bits of one are among the other's.
std::optional<std::uint32_t> both(std::uint32_t outer, std::uint32_t inner) {
  const std::uint32_t common = outer & inner;
  if (common != outer && common != inner) return std::nullopt;
  return common;
}

constexpr std::uint64_t kMost = ~std::uint64_t{0};

/// Their sum, or kMost.
std::uint64_t plus(std::uint64_t a, std::uint64_t b) { return a + b < a ? kMost : a + b; }

/// An instance on a path that is not finished.
struct Step {
  DoubleMatrix to_scene;  ///< Of the group that has the instance.
  std::size_t group;
  std::uint32_t next;    ///< Which of the group's instances comes next.
  std::uint64_t before;  ///< Of MergedPath.
  Instance outer;        ///< What the path so far stands for; at its begin only mask and filters count.
};

class Merger {
 public:
  Merger(const InstancedScene& scene, const MergeOptions& options) : scene_(scene), options_(options) {}

  Result<MergedLevels> run() {
    if (auto checked = survey(); !checked) return tl::unexpected(checked.error());
    const std::size_t top = scene_.groups.size() - 1;
    // From the scene downwards, as groups have instances of lower ones.
    used_[top] = true;
    for (std::size_t g = scene_.groups.size(); g-- > 0;) {
      if (!used_[g]) continue;
      if (auto counted = count(g); !counted) return tl::unexpected(counted.error());
      merge(g);
    }
    number_again();
    return std::move(result_);
  }

 private:
  std::size_t files() const { return scene_.files.size(); }
  bool is_group(const Instance& instance) const { return instance.object >= files(); }
  std::size_t group_of(const Instance& instance) const { return instance.object - files(); }

  /// Whether an instance of group @p g has more levels than may lie below an instance.
  bool is_too_high(std::size_t g) const { return height_[g] > options_.levels - 1; }

  /// Checks every instance; finds how high groups are and how many instances they have merged, if masks allow it.
  Result<void> survey() {
    if (options_.levels == 0) return tl::unexpected(invalid("levels is 0, 1 or more expected"));
    if (scene_.groups.empty()) return tl::unexpected(invalid("a scene of instances has a group at least"));
    const std::size_t count = scene_.groups.size();
    height_.resize(count);
    moves_.resize(count);
    used_.resize(count);
    merged_.resize(count);
    paths_.resize(count);
    sizes_.resize(count);
    for (std::size_t g = 0; g < count; ++g) {
      unsigned below = 0;
      for (std::size_t i = 0; i < scene_.groups[g].size(); ++i) {
        const Instance& instance = scene_.groups[g][i];
        if (instance.object >= files() + g)
          return tl::unexpected(invalid("group " + std::to_string(g) + ", instance " + std::to_string(i) + ": object " +
                                        std::to_string(instance.object) + ", those before the group are " +
                                        std::to_string(files() + g)));
        moves_[g] = moves_[g] || instance.motion != nullptr;
        // What is empty counts too: the path goes there.
        const bool merged = is_group(instance) && may_merge(instance);
        sizes_[g] = plus(sizes_[g], merged ? std::max(sizes_[group_of(instance)], std::uint64_t{1}) : 1);
        if (is_group(instance)) below = std::max(below, height_[group_of(instance)]);
      }
      height_[g] = below + 1;
    }
    return {};
  }

  /// Whether an instance of a group is to be replaced by the group's own, as far as motion goes.
  bool may_merge(const Instance& instance) const {
    return is_too_high(group_of(instance)) && instance.motion == nullptr && !moves_[group_of(instance)];
  }

  /// The same with masks; counts what stays. @param mask of the path and the instance.
  bool merges(const Instance& instance, std::uint32_t mask) {
    if (!is_group(instance) || !is_too_high(group_of(instance))) return false;
    if (!may_merge(instance)) {
      ++result_.kept_moving;
      return false;
    }
    const auto& inner = scene_.groups[group_of(instance)];
    if (std::all_of(inner.begin(), inner.end(), [&](const Instance& of) { return both(mask, of.mask).has_value(); }))
      return true;
    ++result_.kept_masks;
    return false;
  }

  /// Adds a group's instances to those of all that are used.
  Result<void> count(std::size_t g) {
    total_ = plus(total_, sizes_[g]);
    if (total_ <= options_.most_instances) return {};
    return tl::unexpected(
        Error{ErrorCode::kTooLarge, "merged, the groups have " + (total_ == kMost ? "2^64" : std::to_string(total_)) +
                                        " instances or more, the limit is " + std::to_string(options_.most_instances)});
  }

  /// Depth first, in the order of the instances.
  void merge(std::size_t g) {
    std::vector<Step> path;
    path.push_back({to_double(Affine{}), g, 0, MergedPath::kBegin, Instance{}});
    while (!path.empty()) {
      Step& step = path.back();
      if (step.next == scene_.groups[step.group].size()) {
        path.pop_back();
        continue;
      }
      const MergedPath here{step.before, step.next++};
      const Instance& instance = scene_.groups[step.group][here.instance];
      Instance whole = instance;
      DoubleMatrix to_scene{};
      if (path.size() > 1) {
        to_scene = product(step.to_scene, to_double(instance.to_scene));
        whole.to_scene = to_float(to_scene);
        whole.mask = *both(step.outer.mask, instance.mask);
        whole.without_filter = step.outer.without_filter || instance.without_filter;
        whole.id = step.outer.id;
      } else {
        to_scene = to_double(instance.to_scene);
      }
      if (merges(instance, whole.mask)) {
        result_.steps.push_back(here);
        path.push_back({to_scene, group_of(instance), 0, result_.steps.size() - 1, whole});
        continue;
      }
      if (is_group(whole)) used_[group_of(whole)] = true;
      merged_[g].push_back(whole);
      paths_[g].push_back(here);
    }
  }

  /// Groups that nobody has instances of are gone.
  void number_again() {
    std::vector<std::uint32_t> number(scene_.groups.size());
    std::vector<unsigned> levels;
    for (std::size_t g = 0; g < scene_.groups.size(); ++g) {
      if (!used_[g]) continue;
      number[g] = static_cast<std::uint32_t>(result_.groups.size());
      unsigned below = 0;
      for (Instance& instance : merged_[g]) {
        if (!is_group(instance)) continue;
        const std::uint32_t of = number[group_of(instance)];
        below = std::max(below, levels[of]);
        instance.object = static_cast<std::uint32_t>(files()) + of;
      }
      levels.push_back(below + 1);
      result_.groups.push_back(std::move(merged_[g]));
      result_.paths.push_back(std::move(paths_[g]));
      result_.group_before.push_back(g);
    }
    result_.levels = levels.back();
  }

  const InstancedScene& scene_;
  const MergeOptions& options_;
  // By group:
  std::vector<unsigned> height_;  ///< Levels of instances: 1 and more.
  std::vector<std::uint64_t> sizes_;
  std::vector<bool> moves_;  ///< Whether an instance of it moves.
  std::vector<bool> used_;
  std::vector<std::vector<Instance>> merged_;
  std::vector<std::vector<MergedPath>> paths_;
  std::uint64_t total_ = 0;  ///< Instances of the groups so far.
  MergedLevels result_;
};

}  // namespace

std::vector<std::uint32_t> MergedLevels::path_of(std::uint32_t i, std::size_t group) const {
  std::vector<std::uint32_t> path;
  MergedPath at = paths[group][i];
  path.push_back(at.instance);
  while (at.before != MergedPath::kBegin) {
    at = steps[at.before];
    path.push_back(at.instance);
  }
  std::reverse(path.begin(), path.end());
  return path;
}

Result<MergedLevels> merge_levels(const InstancedScene& scene, const MergeOptions& options) {
  return or_out_of_memory("to merge levels of instances", [&] { return Merger(scene, options).run(); });
}

}  // namespace hiprt::build
