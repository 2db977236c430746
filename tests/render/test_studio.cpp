#include <hiprt_device/math/vec_functions.h>
#include <tools/render/image/color.h>
#include <tools/render/studio/studio.h>

#include <tests/catch.h>

#include <cmath>
#include <random>

using namespace hiprt;
using namespace hiprt::tools;

TEST_CASE("Studio: the mean of zonal light is exact where it is known") {
  const double two_thirds = 2.0 / 3.0;
  const ZonalIrradiance constant([](float) { return Vec3(1.0f, 2.0f, 3.0f); });
  const ZonalIrradiance linear([](float c) { return Vec3(c); });
  const ZonalIrradiance square([](float c) { return Vec3(c * c); });
  for (const float c : {-1.0f, -0.7f, 0.0f, 0.1f, 0.5f, 1.0f}) {
    CHECK(glm::length(constant.at(c) - Vec3(1, 2, 3)) < 1e-5f);
    CHECK(linear.at(c).x == Approx(two_thirds * c).margin(2e-3));
    CHECK(square.at(c).x == Approx(0.25 * (1 + c * c)).margin(2e-3));
  }
}

TEST_CASE("Studio: the open sky is the mean of the sky's light") {
  const Studio studio({{2, 1, 3}, {0, 0, 0}, {0, 1, 0}, 40});
  const unsigned seed = 3;
  INFO("seed " << seed);
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  for (const Vec3& n : {Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(1, 0, 0), glm::normalize(Vec3(-1, 1, 1))}) {
    Vec3 sum(0.0f);
    const int count = 100000;
    for (int i = 0; i < count; ++i) {
      // n plus a point of the unit sphere is cosine-distributed.
      const Vec3 point = glm::normalize(Vec3(normal(random), normal(random), normal(random)));
      sum += studio.sky(glm::normalize(n * 1.000001f + point)) / static_cast<float>(count);
    }
    const Vec3 expected = studio.open_sky(n);
    CHECK(glm::length(sum - expected) < 0.02f * glm::length(expected));
  }
}

TEST_CASE("Studio: clay in the open stays below white, is lightest towards the key and darkest from below") {
  const Studio studio({{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 40});
  const auto brightness = [&](const Vec3& n) { return luminance(Studio::clay() * studio.open_sky(glm::normalize(n))); };
  CHECK(brightness({-0.8f, 0.75f, 0.3f}) < 1.0f);
  CHECK(brightness({-0.8f, 0.75f, 0.3f}) > 0.6f);
  CHECK(brightness({-0.8f, 0.75f, 0.3f}) > brightness({0.8f, 0.75f, 0.3f}));
  CHECK(brightness({0, -1, 0}) < 0.2f);
  CHECK(brightness({0, -1, 0}) > 0.03f);
}
