#include <tools/parts/split_scene.h>

#include <algorithm>
#include <limits>

namespace hiprt::tools {
namespace {

/// The memory of instances that come one after the other.
class Sum {
 public:
  explicit Sum(const SplitInput& input) : input_(input), has_(input.file_bytes.size()) {}

  std::uint64_t add(std::uint32_t instance) {
    bytes_ += input_.instance_bytes;
    for (const std::uint32_t file : input_.needs[input_.instances[instance].object]) {
      if (has_[file] != 0) continue;
      has_[file] = 1;
      bytes_ += input_.file_bytes[file];
    }
    return bytes_;
  }

 private:
  const SplitInput& input_;
  std::vector<char> has_;
  std::uint64_t bytes_ = 0;
};

struct Cut {
  double cost = std::numeric_limits<double>::infinity();  ///< Bytes per part of the worse side.
  unsigned axis = 0;
  std::size_t at = 0;  ///< Instances on the first side.
};

class Splitter {
 public:
  explicit Splitter(const SplitInput& input) : input_(input) {}

  void split(std::span<std::uint32_t> instances, std::size_t parts, std::vector<std::vector<std::uint32_t>>& result) {
    if (parts == 1) {
      std::sort(instances.begin(), instances.end());
      result.emplace_back(instances.begin(), instances.end());
      return;
    }
    const std::size_t first_parts = parts / 2;
    const unsigned longest = longest_axis(instances);
    Cut best;
    for (unsigned axis = 0; axis < 3; ++axis) {
      sort(instances, axis);
      Cut cut = best_cut(instances, axis, first_parts, parts);
      // Long parts have large surfaces, and rays cross many of them.
      constexpr double kWorthLongParts = 1.05;
      if (axis != longest) cut.cost *= kWorthLongParts;
      if (cut.cost < best.cost) best = cut;
    }
    sort(instances, best.axis);
    split(instances.first(best.at), first_parts, result);
    split(instances.subspan(best.at), parts - first_parts, result);
  }

 private:
  void sort(std::span<std::uint32_t> instances, unsigned axis) const {
    std::sort(instances.begin(), instances.end(), [&](std::uint32_t a, std::uint32_t b) {
      const double x = input_.instances[a].center[axis], y = input_.instances[b].center[axis];
      return x != y ? x < y : a < b;
    });
  }

  unsigned longest_axis(std::span<const std::uint32_t> instances) const {
    std::array<double, 3> extent{};
    for (unsigned axis = 0; axis < 3; ++axis) {
      const auto [least, most] = std::minmax_element(instances.begin(), instances.end(), [&](auto a, auto b) {
        return input_.instances[a].center[axis] < input_.instances[b].center[axis];
      });
      extent[axis] = input_.instances[*most].center[axis] - input_.instances[*least].center[axis];
    }
    return static_cast<unsigned>(std::max_element(extent.begin(), extent.end()) - extent.begin());
  }

  /// Every side gets an instance per part at least.
  Cut best_cut(std::span<const std::uint32_t> instances, unsigned axis, std::size_t first_parts,
               std::size_t parts) const {
    std::vector<std::uint64_t> after(instances.size());  // Bytes from an instance on.
    Sum behind(input_), before(input_);
    for (std::size_t i = instances.size(); i-- > 0;) after[i] = behind.add(instances[i]);
    const std::size_t second_parts = parts - first_parts;
    Cut best;
    best.axis = axis;
    for (std::size_t at = 1; at + second_parts <= instances.size(); ++at) {
      const std::uint64_t first = before.add(instances[at - 1]);
      if (at < first_parts) continue;
      const double cost = std::max(static_cast<double>(first) / static_cast<double>(first_parts),
                                   static_cast<double>(after[at]) / static_cast<double>(second_parts));
      if (cost < best.cost) {
        best.cost = cost;
        best.at = at;
      }
    }
    return best;
  }

  const SplitInput& input_;
};

}  // namespace

std::vector<std::vector<std::uint32_t>> split_scene(const SplitInput& input, std::size_t parts) {
  std::vector<std::uint32_t> all(input.instances.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint32_t>(i);
  std::vector<std::vector<std::uint32_t>> result;
  Splitter(input).split(all, parts, result);
  return result;
}

std::uint64_t bytes_of(const SplitInput& input, std::span<const std::uint32_t> instances) {
  Sum sum(input);
  std::uint64_t bytes = 0;
  for (const std::uint32_t instance : instances) bytes = sum.add(instance);
  return bytes;
}

}  // namespace hiprt::tools
