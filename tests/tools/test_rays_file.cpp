#include "load.h"

#include <tools/scene_io/rays_file.h>

#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

TEST_CASE("Rays and hits: written and read back bit for bit") {
  const TempFolder folder;
  const float inf = std::numeric_limits<float>::infinity();
  std::vector<Ray> rays(3);
  rays[1] = {{1, 2, 3}, 0.5f, {-0.0f, 1e-40f, -1}, 7, 0xffffffffu};
  REQUIRE(tools::write_rays(folder / "a.rays", true, rays));
  CHECK(read_file(folder / "a.rays").size() == 8 + 3 * 32);
  const auto batch = tools::read_rays(folder / "a.rays");
  REQUIRE(batch);
  CHECK(batch->any_hit);
  REQUIRE(batch->rays.size() == 3);
  CHECK(batch->rays[1].origin == Vec3(1, 2, 3));
  CHECK(batch->rays[1].tmin == 0.5f);
  CHECK(std::signbit(batch->rays[1].direction.x));
  CHECK(batch->rays[1].direction.y == 1e-40f);
  CHECK(batch->rays[1].tmax == 7);
  CHECK(batch->rays[0].tmax == inf);

  const std::vector<tools::HitRecord> hits{{inf, 0xffffffffu}, {1.5f, 42}};
  REQUIRE(tools::write_hits(folder / "a.hits", hits));
  const auto read = tools::read_hits(folder / "a.hits");
  REQUIRE(read);
  REQUIRE(read->size() == 2);
  CHECK(((*read)[0].t == inf && (*read)[0].primitive == 0xffffffffu));
  CHECK(((*read)[1].t == 1.5f && (*read)[1].primitive == 42));
  CHECK(folder.names() == std::vector<std::string>{"a.hits", "a.rays"});
}

TEST_CASE("Paths: written and read back; sizes that do not fit are refused") {
  const TempFolder folder;
  const std::vector<tools::PathRecord> paths{{1, 2}, {3, 4}, {5, 6}, {0xffffffffu, 0xffffffffu}};
  REQUIRE(tools::write_paths(folder / "a.paths", 2, 2, paths));
  const std::string bytes = read_file(folder / "a.paths");
  CHECK(bytes.size() == 8 + 4 * 8);
  const auto read = tools::read_paths(folder / "a.paths");
  REQUIRE(read);
  CHECK(read->levels == 2);
  REQUIRE(read->paths.size() == 4);
  CHECK((read->paths[2].instance == 5 && read->paths[2].id == 6));
  REQUIRE(tools::write_paths(folder / "a.paths", 7, 0, {}));
  CHECK(tools::read_paths(folder / "a.paths")->paths.empty());
  const auto message = [&](const std::string& content) {
    const auto refused = tools::read_paths(folder.write("bad.paths", content));
    REQUIRE(!refused);
    CHECK_THAT(refused.error().message, Contains("bad.paths"));
    return refused.error().message;
  };
  CHECK_THAT(message(bytes.substr(0, 7)), Contains("7 bytes are too few"));
  CHECK_THAT(message(bytes.substr(0, 39)), Contains("2 rays of 2 levels") && Contains("31 bytes"));
  CHECK_THAT(message(bytes + std::string(8, '\0')), Contains("40 bytes"));
  std::string huge;
  append(huge, 0xffffffffu, 0xffffffffu);
  CHECK_THAT(message(huge), Contains("4294967295 rays of 4294967295 levels"));
  CHECK_THAT(tools::write_paths(folder / "no/such/folder.paths", 0, 0, {}).error().message, Contains("folder.paths"));
}

TEST_CASE("Rays and hits: sizes and flags that do not fit are refused") {
  const TempFolder folder;
  const auto message = [&](const std::string& bytes) {
    const auto batch = tools::read_rays(folder.write("bad.rays", bytes));
    REQUIRE(!batch);
    CHECK_THAT(batch.error().message, Contains("bad.rays"));
    return batch.error().message;
  };
  std::string bytes;
  append(bytes, 1u, 0u);
  CHECK_THAT(message(""), Contains("empty"));
  CHECK_THAT(message(bytes.substr(0, 7)), Contains("too few"));
  CHECK_THAT(message(bytes), Contains("1 rays") && Contains("40 bytes") && Contains("the file has 8"));
  CHECK_THAT(message(bytes + std::string(33, '\0')), Contains("the file has 41"));
  bytes.clear();
  append(bytes, 0xffffffffu, 0u);
  CHECK_THAT(message(bytes + std::string(32, '\0')), Contains("137438953448 bytes"));
  bytes.clear();
  append(bytes, 0u, 2u);
  CHECK_THAT(message(bytes), Contains("flag") && Contains("is 2"));
  CHECK_THAT(tools::read_hits(folder.write("bad.hits", "1234567")).error().message, Contains("bad.hits"));
  CHECK_THAT(tools::write_hits(folder / "no/such/folder.hits", {}).error().message, Contains("folder.hits"));
}
