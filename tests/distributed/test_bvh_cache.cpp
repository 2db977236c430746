// The cache of built files: what a key depends on, damaged entries, and what pruning removes.

#include <tests/amount.h>
#include <tests/catch.h>
#include <tests/oracle/random.h>
#include <tests/tools/temp_folder.h>
#include <tools/build/bvh_cache.h>
#include <tools/build/cache_key.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <functional>
#include <set>

using namespace hiprt;
using namespace hiprt::tools;
namespace fs = std::filesystem;

namespace {

/// A fan of triangles with its own copy of everything.
struct Fan {
  std::vector<build::Position> positions{{0, 0, 0}};
  std::vector<build::Triangle> triangles{};
  std::string name = "fan";

  explicit Fan(unsigned count, float z = 0) {
    for (unsigned i = 0; i <= count; ++i)
      positions.push_back({static_cast<float>(i), static_cast<float>(i * i % 7), z + 1});
    for (unsigned i = 0; i < count; ++i) triangles.push_back({0, i + 1, i + 2});
  }
  build::TriangleMesh view() const { return {positions, triangles, 0xffffffffu, name}; }
};

CachedBuild build_in(const BvhCache& cache, const Fan& fan, const BuildRequest& request = {}) {
  const build::TriangleMesh mesh = fan.view();
  auto built = cache.build({{&mesh, 1}, {}}, request);
  REQUIRE(built);
  return std::move(*built);
}

void set_age(const fs::path& path, int seconds) {
  const timespec time{::time(nullptr) - seconds, 0};
  const timespec times[2]{time, time};
  REQUIRE(::utimensat(AT_FDCWD, path.c_str(), times, 0) == 0);
}

}  // namespace

TEST_CASE("cache: the key depends on every input of the build, and not on threads") {
  const Fan fan(20);
  std::set<std::string> keys;
  std::size_t count = 0;
  const auto add = [&](const std::function<void(build::TriangleMesh&, BuildRequest&, Fan&)>& change) {
    Fan other = fan;
    BuildRequest request;
    build::TriangleMesh mesh = other.view();
    change(mesh, request, other);
    keys.insert(cache_key({{&mesh, 1}, {}}, request));
    ++count;
  };
  add([](auto&, auto&, auto&) {});
  const std::string plain = *keys.begin();
  CHECK(plain.size() == 32);
  add([](auto&, auto&, Fan& f) { f.positions[3][1] += 0.5f; });
  add([](auto&, auto&, Fan& f) { std::swap(f.triangles[0], f.triangles[1]); });
  add([](auto& mesh, auto&, auto&) { mesh.mask = 1; });
  add([](auto& mesh, auto&, auto&) { mesh.name = "other"; });
  add([](auto& mesh, auto&, auto&) { mesh.type = 1; });
  add([](auto&, auto& r, auto&) { r.options.builder = build::Builder::kHq; });
  add([](auto&, auto& r, auto&) { r.options.nodes = NodeLayout::kHalf; });
  add([](auto&, auto& r, auto&) { r.options.split_budget = 2; });
  add([](auto&, auto& r, auto&) { r.options.split_budget = build::kSplitsAsNeeded; });
  add([](auto&, auto& r, auto&) { r.options.presplit_budget = 1.5; });
  add([](auto&, auto& r, auto&) { r.options.reinsertion_rounds = 0; });
  add([](auto&, auto& r, auto&) { r.options.reinsertion_rounds = 3; });
  add([](auto&, auto& r, auto&) { r.options.ploc_radius = 9; });
  add([](auto&, auto& r, auto&) { r.options.max_leaf_triangles = 4; });
  add([](auto&, auto& r, auto&) { r.options.pair_triangles = false; });
  add([](auto&, auto& r, auto&) { r.options.costs.leaf = 1; });
  add([](auto&, auto& r, auto&) { r.options.tool = "tool"; });
  add([](auto&, auto& r, auto&) { r.device = DeviceChoice::kGpu; });
  CHECK(keys.size() == count);
  add([](auto&, auto& r, auto&) { r.options.threads = 3; });
  CHECK(keys.size() == count - 1);

  const build::TriangleMesh mesh = fan.view(), twice[2]{mesh, mesh};
  CHECK(cache_key({twice, {}}, {}) != plain);
}

TEST_CASE("cache: the key depends on every member of a custom geometry") {
  struct Custom {
    std::vector<Box> boxes{{{0, 0, 0}, {1, 1, 1}}, {{1, 0, 0}, {2, 1, 1}}};
    std::vector<ShapePoint> points{{{0, 0, 0}, 0}, {{1, 0, 0}, 0}, {{0, 1, 0}, 0}};
    std::vector<std::uint32_t> segments{0, 1};
    build::CustomGeometry geometry;
  };
  std::set<std::string> keys;
  std::size_t count = 0;
  const auto add = [&](const std::function<void(Custom&)>& change) {
    Custom custom;
    custom.geometry.shapes.kind = ShapeKind::kCurves;
    change(custom);
    custom.geometry.boxes = custom.boxes;
    custom.geometry.shapes.points = custom.points;
    custom.geometry.shapes.segments = custom.segments;
    keys.insert(cache_key({{}, {&custom.geometry, 1}}, {}));
    ++count;
  };
  add([](Custom&) {});
  add([](Custom& c) { c.boxes[1].max[2] = 2; });
  add([](Custom& c) { c.boxes.pop_back(); });
  add([](Custom& c) { c.points[1].position[0] = 2; });
  add([](Custom& c) { c.points[2].radius = 0.5f; });
  add([](Custom& c) { c.points.pop_back(); });
  add([](Custom& c) { c.segments[1] = 0; });
  add([](Custom& c) { c.geometry.shapes.kind = ShapeKind::kMovingTriangles; });
  add([](Custom& c) { c.geometry.shapes.keys = 2; });
  add([](Custom& c) { c.geometry.mask = 1; });
  add([](Custom& c) { c.geometry.type = 1; });
  add([](Custom& c) { c.geometry.name = "other"; });
  CHECK(keys.size() == count);
}

TEST_CASE("cache: a second build is a hit with the same bytes and statistics") {
  const test::TempFolder folder;
  const auto cache = BvhCache::open(folder / "c");
  REQUIRE(cache);
  const CachedBuild first = build_in(*cache, Fan(50)), second = build_in(*cache, Fan(50));
  CHECK(first.use == CacheUse::kMiss);
  CHECK(second.use == CacheUse::kHit);
  CHECK(first.file == second.file);
  CHECK(first.file.parent_path().filename() == first.key.substr(0, 2));
  const auto a = first.built.bvh.buffer.bytes(), b = second.built.bvh.buffer.bytes();
  CHECK(std::equal(a.begin(), a.end(), b.begin(), b.end()));
  CHECK(second.built.bvh.statistics.triangles == 50);
  CHECK(second.built.bvh.statistics.nodes == first.built.bvh.statistics.nodes);
  CHECK(second.built.bvh.statistics.builder == first.built.bvh.statistics.builder);
}

TEST_CASE("cache: every damaged or truncated entry is found and built again") {
  const test::TempFolder folder;
  const auto cache = BvhCache::open(folder / "c");
  REQUIRE(cache);
  const fs::path file = build_in(*cache, Fan(40)).file;
  const std::string whole = test::read_file(file);
  oracle::Random random(42);
  std::vector<std::string> damaged{"",
                                   "x",
                                   whole.substr(0, whole.size() / 2),
                                   whole.substr(0, whole.size() - 1),
                                   whole + "x",
                                   std::string(whole.size(), '\0')};
  for (int i = 0; i < 60; ++i) {
    std::string bytes = whole;
    bytes[random.below(static_cast<std::uint32_t>(bytes.size()))] ^= static_cast<char>(1u << random.below(8));
    damaged.push_back(bytes);
  }
  for (const std::string& bytes : damaged) {
    std::ofstream(file, std::ios::binary) << bytes;
    const CachedBuild again = build_in(*cache, Fan(40));
    CHECK(again.use == CacheUse::kDamaged);
    CHECK_THAT(again.damage, Catch::Contains(file.filename().string()));
    CHECK(again.not_stored.empty());
    CHECK(test::read_file(file) == whole);
  }
  CHECK(build_in(*cache, Fan(40)).use == CacheUse::kHit);
}

TEST_CASE("cache: an entry that cannot be written is built and reported") {
  const test::TempFolder folder;
  const auto cache = BvhCache::open(folder / "c");
  REQUIRE(cache);
  const fs::path file = build_in(*cache, Fan(30)).file;
  // A folder of this name cannot be replaced, by root neither.
  fs::remove(file);
  fs::create_directory(file);
  const CachedBuild again = build_in(*cache, Fan(30));
  CHECK(again.use == CacheUse::kDamaged);
  CHECK_THAT(again.not_stored, Catch::Contains("directory"));
  CHECK(again.built.bvh.buffer.size() != 0);

  std::ofstream(folder / "file") << "x";
  const auto none = BvhCache::open(folder / "file");
  REQUIRE_FALSE(none);
  CHECK_THAT(none.error().message, Catch::Contains("file: cannot make the folder"));
}

TEST_CASE("cache: pruning by size keeps the entries that were used last") {
  const test::TempFolder folder;
  std::vector<fs::path> files;
  std::uint64_t newest = 0;
  {
    const auto cache = BvhCache::open(folder.path());
    REQUIRE(cache);
    for (unsigned i = 0; i < 6; ++i) files.push_back(build_in(*cache, Fan(20 + i)).file);
  }
  for (int i = 0; i < 6; ++i) set_age(files[static_cast<std::size_t>(i)], 1000 - 100 * i);
  for (std::size_t i = 4; i < 6; ++i) newest += fs::file_size(files[i]);
  const auto pruned = prune_cache(folder.path(), {.bytes = newest});
  REQUIRE(pruned);
  CHECK(pruned->files == 4);
  CHECK(pruned->kept_bytes == newest);
  for (std::size_t i = 0; i < 6; ++i) CHECK(fs::exists(files[i]) == (i >= 4));

  const auto by_age = prune_cache(folder.path(), {.age = std::chrono::seconds(550)});
  REQUIRE(by_age);
  CHECK(by_age->files == 1);
  CHECK(fs::exists(files[5]));
}

TEST_CASE("cache: pruning spares what a living process has used since it opened the cache") {
  const test::TempFolder folder;
  std::vector<fs::path> files;
  {
    const auto cache = BvhCache::open(folder.path());
    REQUIRE(cache);
    for (unsigned i = 0; i < 4; ++i) files.push_back(build_in(*cache, Fan(20 + i)).file);
  }
  for (const fs::path& file : files) set_age(file, 1000);
  std::ofstream(files[0].parent_path() / ".hiprt-1-0.tmp") << "half";
  std::ofstream(folder / ".use-1-0") << "";
  {
    const auto cache = BvhCache::open(folder.path());
    REQUIRE(cache);
    CHECK(build_in(*cache, Fan(21)).use == CacheUse::kHit);
    CHECK(build_in(*cache, Fan(30)).use == CacheUse::kMiss);
    const auto pruned = prune_cache(folder.path(), {.bytes = 0});
    REQUIRE(pruned);
    CHECK(pruned->files == 3);
    CHECK(pruned->in_use == 2);
    CHECK(fs::exists(files[1]));
    CHECK_FALSE(fs::exists(folder / ".use-1-0"));
  }
  const auto rest = prune_cache(folder.path(), {.bytes = 0});
  REQUIRE(rest);
  CHECK(rest->files == 2);
  CHECK(rest->in_use == 0);
}

TEST_CASE("cache: limits of pruning are sizes and times") {
  CHECK(parse_prune_limit("20G")->bytes == std::uint64_t{20} << 30);
  CHECK(parse_prune_limit("0K")->bytes == 0);
  CHECK(parse_prune_limit("30d")->age == std::chrono::hours(720));
  CHECK(parse_prune_limit("12h")->age == std::chrono::hours(12));
  for (const char* text : {"", "G", "20", "20g", "-1G", "1.5G", "20GB", "99999999999999999999G", "20 G"})
    CHECK_FALSE(parse_prune_limit(text));
}
