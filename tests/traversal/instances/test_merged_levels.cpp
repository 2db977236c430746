// Merged levels of instances: the surfaces stay in place, and instance paths can be restored. Also: levels that cannot
// merge, and invalid input.

#include <hiprt_build/merge_levels.h>
#include <tests/traversal/instances/moving_scenes.h>

#include <cmath>
#include <map>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261127;
using Tracer = Moving<Instanced<Policies, 6>>;

build::Result<build::MergedLevels> merge(const InstanceScene& scene, const build::MergeOptions& options = {}) {
  const std::vector<std::span<const std::byte>> files(scene.files.size());
  const std::vector<std::span<const Instance>> groups(scene.groups.begin(), scene.groups.end());
  return build::merge_levels({files, groups}, options);
}

/// The scene of a merge, built; its files are gone from @p from.
InstanceScene merged_scene(InstanceScene& from, const build::MergedLevels& merged) {
  InstanceScene result;
  result.files = std::move(from.files);
  result.groups = merged.groups;
  result.build();
  return result;
}

/// An instance path of the merged scene, as the original scene had it.
template <unsigned kLevels>
std::vector<std::uint32_t> path_before_merge(const build::MergedLevels& merged, std::size_t files,
                                             const InstancePath<kLevels>& path) {
  std::vector<std::uint32_t> original;
  std::size_t group = merged.groups.size() - 1;
  for (unsigned i = 0; i < path.depth; ++i) {
    const auto part = merged.path_of(path.instance[i], group);
    original.insert(original.end(), part.begin(), part.end());
    const std::uint32_t object = merged.groups[group][path.instance[i]].object;
    if (object >= files) group = object - files;
  }
  return original;
}
template <unsigned kLevels> std::vector<std::uint32_t> numbers(const InstancePath<kLevels>& path) {
  return {path.instance, path.instance + path.depth};
}

/// Files of a ball and of needles, and @p levels levels of three to six instances each.
InstanceScene random_scene(Random& random, unsigned levels) {
  InstanceScene scene;
  scene.add_file({oracle::icosphere(2)}, NodeLayout::kPlanes);
  scene.add_file({oracle::needles(40, 15, kSeed)}, NodeLayout::kPlanes);
  for (unsigned level = 0; level < levels; ++level) {
    auto& group = scene.groups.emplace_back(3 + random.below(4));
    for (Instance& instance : group)
      instance = {.object = random.below(2 + level),
                  .to_scene = random_affine(random, 2.0),
                  .mask = random.below(3) == 0 ? 6u : 0xffffffffu,
                  .id = static_cast<std::uint32_t>(100 * level + (&instance - group.data()))};
    if (level > 0) group[0].object = 1 + level;
  }
  return scene;
}

/// The product of the matrices on an instance path, entry by entry in long double.
void check_product(const InstanceScene& scene, const std::vector<std::uint32_t>& path, const Instance& merged) {
  long double product[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  long double size[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  std::size_t group = scene.groups.size() - 1;
  std::uint32_t object = 0, mask = 0xffffffffu, id = 0;
  for (std::size_t step = 0; step < path.size(); ++step) {
    const Instance& instance = scene.groups[group][path[step]];
    long double next[3][4], next_size[3][4];
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) {
        next[r][c] = c == 3 ? product[r][3] : 0;
        next_size[r][c] = c == 3 ? size[r][3] : 0;
        for (int k = 0; k < 3; ++k) {
          next[r][c] += product[r][k] * static_cast<long double>(instance.to_scene.row[k][c]);
          next_size[r][c] += size[r][k] * std::abs(static_cast<long double>(instance.to_scene.row[k][c]));
        }
      }
    std::copy(&next[0][0], &next[0][0] + 12, &product[0][0]);
    std::copy(&next_size[0][0], &next_size[0][0] + 12, &size[0][0]);
    mask &= instance.mask;
    if (step == 0) id = instance.id;
    object = instance.object;
    if (object >= scene.files.size()) group = object - scene.files.size();
  }
  REQUIRE((merged.mask == mask && merged.id == id));
  if (object < scene.files.size()) REQUIRE(merged.object == object);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) {
      // Half a unit of the last place, and what doubles rounded.
      const long double allowed = 0x1p-24L * std::abs(product[r][c]) + 0x1p-49L * size[r][c] + 0x1p-149L;
      REQUIRE(std::abs(static_cast<long double>(merged.to_scene.row[r][c]) - product[r][c]) <= allowed);
    }
}

}  // namespace

TEST_CASE("merged instances are the products along their paths, and no path is missing") {
  Random random(kSeed);
  for (unsigned round = 0; round < 40; ++round) {
    const unsigned levels = 1 + round % 5;
    InstanceScene scene = random_scene(random, levels);
    for (auto& group : scene.groups)
      for (Instance& instance : group) instance.mask = 0xffffffffu;
    for (unsigned wanted = 1; wanted <= levels + 1; ++wanted) {
      INFO("seed " << kSeed << ", round " << round << ", " << wanted << " of " << levels << " levels");
      const auto merged = merge(scene, {.levels = wanted});
      REQUIRE(merged.has_value());
      REQUIRE(merged->levels == std::min(wanted, levels));
      REQUIRE(merged->kept_masks + merged->kept_moving == 0);
      REQUIRE(merged->views().size() == merged->groups.size());
      const auto& top = merged->groups.back();
      std::vector<std::vector<std::uint32_t>> paths;
      for (std::uint32_t i = 0; i < top.size(); ++i) {
        paths.push_back(merged->path_of(i));
        check_product(scene, paths.back(), top[i]);
      }
      // Depth first, each once.
      REQUIRE(std::is_sorted(paths.begin(), paths.end()));
      REQUIRE(std::adjacent_find(paths.begin(), paths.end()) == paths.end());
      if (wanted >= levels) {
        REQUIRE(top.size() == scene.groups.back().size());
        continue;
      }
      if (wanted > 1) continue;
      std::vector<std::size_t> uses;
      for (const auto& group : scene.groups) {
        uses.push_back(0);
        for (const Instance& instance : group) uses.back() += instance.object < 2 ? 1 : uses[instance.object - 2];
      }
      REQUIRE((merged->groups.size() == 1 && top.size() == uses.back()));
    }
  }
}

TEST_CASE("rays have the same hits before and after merging levels, with the same instance paths") {
  Random random(kSeed + 1);
  unsigned hits = 0, same = 0, one_only = 0;
  for (unsigned round = 0; round < 24; ++round) {
    const unsigned levels = 2 + round % 3;
    InstanceScene scene = random_scene(random, levels);
    scene.build();
    const auto merged = merge(scene, {.levels = 1 + round % 2});
    REQUIRE(merged.has_value());
    const std::size_t files = scene.files.size();
    InstanceScene other = merged_scene(scene, *merged);
    const SceneView a = scene.view(), b = other.view();
    REQUIRE(b.levels == merged->levels);
    for (unsigned i = 0; i < 400; ++i) {
      const Ray ray = random_ray(random, 9.0);
      INFO("seed " << kSeed + 1 << ", round " << round << ", ray " << i);
      const auto first = closest_hit<Tracer>(a, ray), second = closest_hit<Tracer>(b, ray);
      // Roundings move silhouettes: then the hits are different ones. All others are one.
      one_only += first.found() != second.found() ? 1 : 0;
      if (!first.found() || !second.found()) continue;
      ++hits;
      if (first.primitive != second.primitive || numbers(first.path) != path_before_merge(*merged, files, second.path))
        continue;
      ++same;
      REQUIRE(first.geometry == second.geometry);
      const float length = max_component(ray.direction);
      REQUIRE(std::abs(first.t - second.t) * length <= 16.0f * (first.error + second.error));
    }
  }
  CHECK(hits > 2000);
  CHECK(same > hits - hits / 200);
  CHECK(one_only < hits / 200);
}

namespace {

/// Integer translations, scales by powers of two, quarter turns: nothing rounds.
Affine exact_affine(Random& random) {
  Affine result;
  const unsigned turn = random.below(3);
  const float scale = std::ldexp(1.0f, static_cast<int>(random.below(3)) - 1);
  for (unsigned r = 0; r < 3; ++r) {
    for (unsigned c = 0; c < 3; ++c)
      result.row[r][c] = c == (r + turn) % 3 ? (random.below(2) == 0 ? scale : -scale) : 0.0f;
    result.row[r][3] = static_cast<float>(static_cast<int>(random.below(9)) - 4);
  }
  return result;
}

/// A ball in four levels of four instances.
InstanceScene exact_scene(Random& random, NodeLayout layout) {
  InstanceScene scene;
  scene.add_file({oracle::icosphere(2)}, layout);
  for (unsigned level = 0; level < 4; ++level) {
    auto& group = scene.groups.emplace_back(4);
    for (Instance& instance : group) {
      instance.object = level == 0 ? 0 : random.below(1 + level);
      instance.to_scene = exact_affine(random);
    }
    if (level > 0) group[0].object = level;
  }
  scene.build();
  return scene;
}

/// Multiples of 1/32 in [-16, 16].
Ray exact_ray(Random& random) {
  const auto coordinate = [&] { return std::ldexp(static_cast<float>(random.below(1025)), -5) - 16.0f; };
  Ray ray;
  ray.origin = {coordinate(), coordinate(), coordinate()};
  ray.direction = {coordinate(), coordinate(), coordinate()};
  return ray;
}

}  // namespace

TEMPLATE_TEST_CASE("exact products give hits with the same bits", "", FloatLayout, PlanesLayout, HalfLayout,
                   QuantizedLayout) {
  Random random(kSeed + 2);
  InstanceScene scene = exact_scene(random, TestType::kId);
  const auto merged = merge(scene);
  REQUIRE(merged.has_value());
  InstanceScene other = merged_scene(scene, *merged);
  using P = Instanced<WithLayout<TestType>, 4>;
  using One = Instanced<WithLayout<TestType>>;
  const SceneView a = scene.view(), b = other.view();
  REQUIRE(covers<One>(b));
  unsigned hits = 0;
  for (unsigned i = 0; i < 2000; ++i) {
    const Ray ray = exact_ray(random);
    INFO("seed " << kSeed + 2 << ", ray " << i);
    const auto first = closest_hit<P>(a, ray);
    const auto second = closest_hit<One>(b, ray);
    REQUIRE(first.found() == second.found());
    REQUIRE(first.found() == any_hit<One>(b, ray).found());
    if (!first.found()) continue;
    ++hits;
    REQUIRE((first.t == second.t && first.u == second.u && first.v == second.v));
    REQUIRE(first.primitive == second.primitive);
    // Normals through instances may differ by a power of two.
    const float longer = max_component(first.normal) / max_component(second.normal);
    REQUIRE(first.normal == second.normal * longer);
    REQUIRE(numbers(first.path) == path_before_merge(*merged, 1, second.path));
  }
  CHECK(hits > 200);
}

TEST_CASE("moving instances, and instances that need two masks, are not merged") {
  Random random(kSeed + 3);
  const build::Motion motion{.keys = {{.time = 0}, {.time = 1, .translation = {1, 0, 0}, .rotation = {0, 0, 1, 1}}}};
  InstanceScene scene;
  scene.add_file({oracle::icosphere(1)}, NodeLayout::kPlanes);
  const auto instance_of = [&](std::uint32_t object) {
    return Instance{.object = object, .to_scene = random_affine(random, 3)};
  };
  // Group 0 (object 1): balls. Group 1 (2): instances of group 0, one moving. Group 2 (3): still instances of group 0.
  scene.groups.push_back({instance_of(0), instance_of(0)});
  scene.groups.push_back({instance_of(1), instance_of(1)});
  scene.groups[1][1].motion = &motion;
  scene.groups.push_back({instance_of(1), instance_of(1)});
  // The scene: both, the second in motion too, and twice with masks.
  scene.groups.push_back({instance_of(2), instance_of(3), instance_of(3), instance_of(3), instance_of(0)});
  scene.groups[3][1].motion = &motion;
  scene.groups[3][2].mask = 3;
  scene.groups[2][1].mask = 6;
  const auto merged = merge(scene);
  REQUIRE(merged.has_value());
  // Of the top: instance 0 has a group that moves in it, 1 moves; 2 has masks 3 and 6; 3 merges, and what it has.
  CHECK(merged->kept_moving == 3);
  CHECK(merged->kept_masks == 1);
  CHECK(merged->levels == 3);
  REQUIRE(merged->groups.back().size() == 3 + 4 + 1);
  CHECK(merged->path_of(3) == std::vector<std::uint32_t>{3, 0, 0});
  CHECK(merged->path_of(6) == std::vector<std::uint32_t>{3, 1, 1});
  CHECK(merged->groups.back()[6].mask == 6);
  CHECK(merged->path_of(7) == std::vector<std::uint32_t>{4});
  CHECK(merged->group_before == std::vector<std::size_t>{0, 1, 2, 3});
  scene.build();
  InstanceScene other = merged_scene(scene, *merged);
  unsigned found = 0, other_hits = 0;
  for (unsigned i = 0; i < 3000; ++i) {
    Ray ray = random_ray(random, 8.0);
    ray.mask = 1u << random.below(4);
    ray.time = random.uniform_float(0, 1);
    const auto first = closest_hit<Tracer>(scene.view(), ray), second = closest_hit<Tracer>(other.view(), ray);
    if (!first.found() && !second.found()) continue;
    ++found;
    INFO("seed " << kSeed + 3 << ", ray " << i);
    if (first.primitive == second.primitive && numbers(first.path) == path_before_merge(*merged, 1, second.path))
      REQUIRE(first.t == Approx(second.t).epsilon(1e-4).margin(1e-4));
    else
      ++other_hits;
  }
  CHECK(found > 150);
  CHECK(other_hits < found / 50);
}

TEST_CASE("merged instances keep without_filter") {
  InstanceScene scene;
  scene.add_file({oracle::icosphere(1)}, NodeLayout::kPlanes);
  scene.groups.push_back({Instance{}, Instance{.without_filter = true}});
  scene.groups.push_back({Instance{.object = 1}, Instance{.object = 1, .without_filter = true}});
  const auto merged = merge(scene);
  REQUIRE(merged.has_value());
  std::vector<bool> without;
  for (const Instance& instance : merged->groups.back()) without.push_back(instance.without_filter);
  CHECK(without == std::vector<bool>{false, true, true, true});
}

TEST_CASE("merge_levels() refuses invalid input") {
  InstanceScene scene;
  const auto message = [&](const build::MergeOptions& options = {}) {
    const auto merged = merge(scene, options);
    REQUIRE_FALSE(merged.has_value());
    return std::pair(merged.error().code, merged.error().message);
  };
  using build::ErrorCode;
  CHECK(message() == std::pair(ErrorCode::kInvalidInput, std::string("a scene of instances has a group at least")));
  scene.files.resize(1);
  scene.groups.push_back({Instance{}, Instance{.object = 1}});
  CHECK(message() == std::pair(ErrorCode::kInvalidInput,
                               std::string("group 0, instance 1: object 1, those before the group are 1")));
  scene.groups[0][1].object = 0;
  CHECK(message({.levels = 0}) == std::pair(ErrorCode::kInvalidInput, std::string("levels is 0, 1 or more expected")));
  // Groups of two nested deep: 2^64 instances and more, which the function reports at once.
  for (std::uint32_t g = 1; g < 70; ++g) scene.groups.push_back({Instance{.object = g}, Instance{.object = g}});
  CHECK(message() == std::pair(ErrorCode::kTooLarge,
                               std::string("merged, the groups have 2^64 instances or more, the limit is 134217728")));
  // Half of it fits.
  const auto half = merge(scene, {.levels = 60});
  REQUIRE(half.has_value());
  CHECK((half->levels == 60 && half->groups.size() == 60 && half->groups.back().size() == 1u << 11));
  // Nothing, as often: no walk through all of it.
  scene.groups[0].clear();
  CHECK(message().first == ErrorCode::kTooLarge);
  scene.groups.resize(4);
  CHECK(merge(scene)->groups.back().empty());
  scene.groups[0] = {Instance{}, Instance{}};
  scene.groups.resize(3);
  CHECK(message({.most_instances = 7}) ==
        std::pair(ErrorCode::kTooLarge, std::string("merged, the groups have 8 instances or more, the limit is 7")));
  CHECK(merge(scene, {.most_instances = 8}).has_value());
}
