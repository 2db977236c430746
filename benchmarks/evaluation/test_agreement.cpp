#include <benchmarks/trace/agreement.h>
#include <tests/catch.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace {

using namespace hiprt;
using namespace hiprt::bench;

Hit at(float t, std::uint32_t geometry, std::uint32_t primitive) {
  Hit hit;
  hit.t = t;
  hit.geometry = geometry;
  hit.primitive = primitive;
  return hit;
}

constexpr float kReach = 1000;

Disagreements one(const Hit& hit, const Hit& reference, bool any_hit = false) {
  return find_disagreements({{&hit, 1}, {}}, {{&reference, 1}, {}}, any_hit, kReach);
}

}  // namespace

TEST_CASE("a hit that the other tracer misses, or that failed, counts as found") {
  const Hit hit = at(5, 0, 3), miss;
  CHECK(one(hit, miss) == Disagreements{.found = 1});
  CHECK(one(miss, hit) == Disagreements{.found = 1});
  CHECK(one(miss, hit, true) == Disagreements{.found = 1});
  CHECK(one(miss, miss) == Disagreements{});
  CHECK(one(at(std::numeric_limits<float>::quiet_NaN(), kInvalidId, kInvalidId), miss) == Disagreements{.found = 1});
}

TEST_CASE("distances agree within the stated tolerance") {
  // 1e-4 * 5 + 1e-6 * 1000 = 0.0015.
  CHECK(one(at(5, 0, 3), at(5.0014f, 0, 3)) == Disagreements{});
  CHECK(one(at(5, 0, 3), at(5.0016f, 0, 3)) == Disagreements{.distance = 1});
  CHECK(one(at(5.0016f, 0, 3), at(5, 0, 3)) == Disagreements{.distance = 1});
  CHECK(one(at(5, 0, 3), at(9, 1, 4), true) == Disagreements{});
}

TEST_CASE("another geometry or primitive at the same distance counts as primitive") {
  CHECK(one(at(5, 0, 3), at(5, 0, 4)) == Disagreements{.primitive = 1});
  CHECK(one(at(5, 0, 3), at(5, 1, 3)) == Disagreements{.primitive = 1});
  CHECK(one(at(5, 0, 3), at(7, 0, 4)) == Disagreements{.distance = 1});
}

TEST_CASE("instances are compared if both tracers know them") {
  const std::array<Hit, 3> hits{at(5, 0, 3), at(5, 0, 3), Hit{}}, reference{at(5, 0, 4), at(5, 0, 3), Hit{}};
  const std::array<std::uint32_t, 3> same{7, 8, kInvalidId}, other{9, 8, 0};
  // The first ray's primitive differs too, but a ray counts once. Misses have no instance.
  CHECK(find_disagreements({hits, same}, {reference, other}, false, kReach) == Disagreements{.instance = 1});
  CHECK(find_disagreements({hits, same}, {reference, same}, false, kReach) == Disagreements{.primitive = 1});
  CHECK(find_disagreements({hits, same}, {reference, {}}, false, kReach) == Disagreements{.primitive = 1});
  CHECK(find_disagreements({hits, {}}, {reference, other}, false, kReach) == Disagreements{.primitive = 1});
}

TEST_CASE("count_disagreements() counts hits, misses and distances") {
  const std::array<Hit, 4> hits{at(5, 0, 3), Hit{}, at(5, 0, 3), at(5, 0, 3)};
  const std::array<Hit, 4> reference{at(6, 0, 3), at(5, 0, 3), at(5, 0, 4), at(5, 0, 3)};
  CHECK(count_disagreements(hits, reference, false, kReach) == 2);
  CHECK(count_disagreements(hits, reference, true, kReach) == 1);
}
