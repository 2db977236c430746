/// Parts of the path tracer (materials, sky, choice of directions) against sums over all directions in double.

#include <hiprt_device/math/vec_functions.h>
#include <tests/amount.h>
#include <tests/oracle/random.h>
#include <tools/render/path/path_bsdf.h>
#include <tools/render/path/path_lights.h>
#include <tools/render/path/path_sky.h>

#include <tests/catch.h>

#include <cmath>
#include <functional>

using namespace hiprt;
using namespace hiprt::tools;
using oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261123;

/// The integral over the upper half of directions, by the midpoint rule in the cosine and the angle.
double integral(const std::function<double(const Vec3&)>& f, unsigned rings = 1000, unsigned sectors = 720) {
  double sum = 0.0;
  for (unsigned i = 0; i < rings; ++i)
    for (unsigned k = 0; k < sectors; ++k) {
      // Cubes put more rings where a smooth surface mirrors at grazing angles, and near the pole.
      const double t = (i + 0.5) / rings, z = t * t * (3.0 - 2.0 * t), stretch = 6.0 * t * (1.0 - t);
      const double angle = 2.0 * 3.14159265358979323846 * (k + 0.5) / sectors, r = std::sqrt(1.0 - z * z);
      const Vec3 d(static_cast<float>(r * std::cos(angle)), static_cast<float>(r * std::sin(angle)),
                   static_cast<float>(z));
      sum += f(d) * stretch;
    }
  return sum * 2.0 * 3.14159265358979323846 / (static_cast<double>(rings) * sectors);
}

PathSurface material(float metallic, float roughness, const Vec3& color) {
  PathSurface surface;
  surface.base_color = color;
  surface.metallic = metallic;
  surface.roughness = roughness;
  return surface;
}

struct SkyScene {
  PathSky sky;
  PathScene scene{{}, {}, {CameraRays({}, 1, 1), 1, 1, {}, 0, 0}};

  explicit SkyScene(PathSky of) : sky(std::move(of)) {
    scene.arrays.sky = {sky.radiance.data(), sky.radiance.size()};
    scene.arrays.sky_rows = {sky.rows.data(), sky.rows.size()};
    scene.arrays.sky_columns = {sky.columns.data(), sky.columns.size()};
  }
};

}  // namespace

TEST_CASE("sine and cosine of turns have errors of at most 1.5e-7") {
  float worst = 0.0f;
  for (int i = 0; i <= 200000; ++i) {
    const float turn = static_cast<float>(i) / 200000.0f;
    const SinCos found = sin_cos_of_turn(turn);
    const double angle = 2.0 * 3.14159265358979323846 * static_cast<double>(turn);
    worst = std::max({worst, std::abs(found.sine - static_cast<float>(std::sin(angle))),
                      std::abs(found.cosine - static_cast<float>(std::cos(angle)))});
  }
  CAPTURE(worst);
  CHECK(worst < 1.5e-7f);
}

TEST_CASE("frames are orthonormal for every normal") {
  Random random(kSeed);
  for (unsigned i = 0; i < 20000; ++i) {
    const auto n = random.on_sphere();
    Vec3 normal(static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2]));
    if (i < 2) normal = Vec3(0, 0, i == 0 ? 1 : -1);
    const Frame frame(normal);
    INFO("seed " << kSeed << ", " << i);
    REQUIRE(std::abs(glm::dot(frame.tangent, frame.bitangent)) < 1e-6f);
    REQUIRE(std::abs(glm::dot(frame.tangent, frame.normal)) < 1e-6f);
    REQUIRE(std::abs(glm::dot(frame.bitangent, frame.normal)) < 1e-6f);
    REQUIRE(std::abs(glm::length(frame.tangent) - 1.0f) < 1e-6f);
    REQUIRE(glm::length(glm::cross(frame.tangent, frame.bitangent) - frame.normal) < 1e-6f);
  }
}

TEST_CASE("materials conserve energy, are reciprocal, and sample with the density that they report") {
  checks::Sample sample(4);
  for (const float metallic : {0.0f, 0.5f, 1.0f})
    for (const float roughness : {0.3f, 0.6f, 1.0f})
      for (const float cosine : {0.15f, 0.6f, 0.98f}) {
        if (!sample.next()) continue;
        const Vec3 wo(std::sqrt(1.0f - cosine * cosine), 0.0f, cosine);
        const PathSurface surface = material(metallic, roughness, Vec3(1.0f, 0.5f, 0.25f));
        const Bsdf bsdf(surface, wo);
        CAPTURE(metallic, roughness, cosine);
        const double sent = integral([&](const Vec3& d) { return static_cast<double>(bsdf.value(d).x); });
        CHECK(sent < 1.01);
        CHECK(sent > 0.25);
        // What the choice leaves out goes below the surface.
        const double chosen = integral([&](const Vec3& d) { return static_cast<double>(bsdf.density(d)); });
        CHECK(chosen < 1.002);
        Random random(kSeed);
        constexpr unsigned kSamples = 60000;
        double estimate = 0.0, above = 0.0;
        for (unsigned i = 0; i < kSamples; ++i) {
          const Vec3 d =
              bsdf.sample(random.uniform_float(0, 1), random.uniform_float(0, 1), random.uniform_float(0, 1));
          REQUIRE(std::abs(glm::length(d) - 1.0f) < 1e-4f);
          const float density = bsdf.density(d);
          if (!(density > 0.0f)) continue;
          above += 1.0;
          estimate += static_cast<double>(bsdf.value(d).x / density);
        }
        CHECK(above / kSamples == Approx(chosen).margin(0.01));
        CHECK(estimate / kSamples == Approx(sent).margin(0.02));
        const Vec3 wi = glm::normalize(Vec3(0.3f, 0.5f, 0.4f));
        const Vec3 there = bsdf.value(wi) / wi.z, back = Bsdf(surface, wi).value(wo) / wo.z;
        CHECK(glm::length(there - back) < 1e-4f * glm::length(there));
      }
}

TEST_CASE("the octahedral square contains every direction once") {
  Random random(kSeed);
  double covered = 0.0;
  constexpr unsigned kSide = 512;
  for (unsigned y = 0; y < kSide; ++y)
    for (unsigned x = 0; x < kSide; ++x) {
      const Vec3 d = Octahedral::direction(2.0f * (static_cast<float>(x) + 0.5f) / kSide - 1.0f,
                                           2.0f * (static_cast<float>(y) + 0.5f) / kSide - 1.0f);
      covered += static_cast<double>(Octahedral::project(d).stretch) * 4.0 / (kSide * kSide);
    }
  CHECK(covered == Approx(4.0 * 3.14159265358979323846).epsilon(1e-4));
  for (unsigned i = 0; i < 20000; ++i) {
    const auto p = random.on_sphere();
    const Vec3 d(static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]));
    const Octahedral::Projection at = Octahedral::project(d);
    INFO("seed " << kSeed << ", " << i);
    REQUIRE(glm::length(Octahedral::direction(at.x, at.y) - d) < 1e-6f);
  }
}

TEST_CASE("a sky has the radiance it was made of, and is sampled with the density that it reports") {
  const Vec3 sun = glm::normalize(Vec3(0.4f, 0.8f, -0.3f));
  const auto light = [&](const Vec3& d) {
    const float at_sun = std::max(0.0f, glm::dot(d, sun));
    return Vec3(0.2f + 0.1f * d.y, 0.3f, 0.4f) + Vec3(20.0f) * std::pow(at_sun, 200.0f);
  };
  const SkyScene made(make_sky(light, 128));
  const Sky sky(made.scene);
  Random random(kSeed);
  double whole = 0.0, by_choice = 0.0, density = 0.0;
  constexpr unsigned kSamples = 200000;
  for (unsigned i = 0; i < kSamples; ++i) {
    const auto p = random.on_sphere();
    const Vec3 d(static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]));
    INFO("seed " << kSeed << ", " << i);
    if (glm::dot(d, sun) < 0.9f) REQUIRE(glm::length(sky.radiance(d) - light(d)) < 0.01f);
    whole += static_cast<double>(light(d).x) * 4.0 * 3.14159265358979323846;
    density += static_cast<double>(sky.density(d)) * 4.0 * 3.14159265358979323846;
    const LightSample sample = sky.sample(random.uniform_float(0, 1), random.uniform_float(0, 1));
    REQUIRE(sample.density > 0.0f);
    REQUIRE(sample.density == sky.density(sample.direction));
    by_choice += static_cast<double>(sample.radiance.x / sample.density);
  }
  CHECK(density / kSamples == Approx(1.0).epsilon(0.03));
  CHECK(by_choice / kSamples == Approx(whole / kSamples).epsilon(0.03));
}

TEST_CASE("an equirectangular picture: +y is the top row, +x the middle column, +z to the right of it") {
  constexpr std::uint32_t kWidth = 64, kHeight = 32;
  std::vector<Vec3> pixels(kWidth * kHeight);
  for (std::uint32_t y = 0; y < kHeight; ++y)
    for (std::uint32_t x = 0; x < kWidth; ++x)
      pixels[y * kWidth + x] = Vec3(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f);
  const SkyScene made(make_sky(pixels, kWidth, kHeight));
  const Sky sky(made.scene);
  CHECK(sky.radiance(Vec3(0, 1, 0)).y < 2.0f);
  CHECK(sky.radiance(Vec3(0, -1, 0)).y > 30.0f);
  CHECK(sky.radiance(Vec3(1, 0, 0)).x == Approx(32.0f).margin(1.0));
  CHECK(sky.radiance(Vec3(1, 0, 0)).y == Approx(16.0f).margin(1.0));
  CHECK(sky.radiance(Vec3(0, 0, 1)).x == Approx(48.0f).margin(1.0));
  CHECK(sky.radiance(Vec3(0, 0, -1)).x == Approx(16.0f).margin(1.0));
}

TEST_CASE("a black sky counts as no sky, and values that are not finite are black") {
  CHECK(make_sky([](const Vec3&) { return Vec3(0.0f); }, 16).radiance.empty());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(make_sky([&](const Vec3&) { return Vec3(nan, -1.0f, std::numeric_limits<float>::infinity()); }, 16)
            .radiance.empty());
}
