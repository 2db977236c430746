// Moving instances: transforms at a time against textbook formulas, and bounds over all times against dense samples.

#include <tests/traversal/instances/recorded_motion.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261122;
Real length(const Real3& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// The distance in the scene between p and the transformed point of p at a time, and the error that the record allows.
struct Error {
  double is, allowed;
};
Error error_at(const Recorded& recorded, const build::Motion& motion, float time, const Real3& p) {
  const InstanceRecord placed = recorded.at(time);
  const Real3 there = moved(motion, time, p);
  Real3 from, translation, miss{};
  for (unsigned i = 0; i < 3; ++i) {
    translation[i] = placed.translation[i];
    from[i] = there[i] - translation[i];
  }
  for (unsigned r = 0; r < 3; ++r) {
    for (unsigned c = 0; c < 3; ++c) miss[r] += Real{placed.linear[r][c]} * from[c];
    miss[r] -= p[r];
  }
  // The miss, as the inverse takes it back.
  const LinearInverse inverse(placed);
  Real3 back{};
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 3; ++c) back[r] += Real{inverse.row[r][c]} * miss[c];
  return {static_cast<double>(length(back)),
          static_cast<double>(
              0x1p-24L * (14 * Real{recorded.record.rounding} * length(from) + 6 * Real{recorded.record.farthest}))};
}

}  // namespace

TEST_CASE("transforms at a time equal the textbook's, within the recorded error") {
  Random random(kSeed);
  for (const MotionKind kind : kKinds) {
    double most = 0.0;
    for (unsigned i = 0; i < 3000; ++i) {
      const build::Motion motion = random_motion(random, kind, 2 + random.below(5), i % 5 == 0 ? 1e4 : 2.0);
      const Recorded recorded(motion);
      for (unsigned k = 0; k < 20; ++k) {
        const auto p = random.in_cube(1.5);
        const float time = random_time(random, motion);
        INFO("seed " << kSeed << ", " << name_of(kind) << " motion " << i << ", time " << time);
        const Error error = error_at(recorded, motion, time, {p[0], p[1], p[2]});
        REQUIRE(error.is <= error.allowed);
        most = std::max(most, error.is / error.allowed);
      }
    }
    std::printf("error of positions at a time: %-7s at most %.3f of the bound\n", name_of(kind), most);
    CHECK(most > 0.001);
  }
}

namespace {

Box random_box(Random& random) {
  const auto corner = random.in_cube(1), other = random.in_cube(1);
  Box box;
  for (unsigned axis = 0; axis < 3; ++axis) {
    box.min[axis] = std::min(corner[axis], other[axis]);
    box.max[axis] = std::max(corner[axis], other[axis]);
  }
  return box;
}

/// The bounds of the textbook positions of a box's corners, at many times.
struct SampledBounds {
  Real low[3], high[3];
  std::size_t samples = 0;

  SampledBounds(const build::Motion& motion, const Box& box) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      low[axis] = std::numeric_limits<double>::infinity();
      high[axis] = -low[axis];
    }
    const Real begin = motion.keys.front().time, whole = Real{motion.keys.back().time} - begin;
    constexpr unsigned kTimes = 3000;
    for (unsigned k = 0; k <= kTimes; ++k) add(motion, box, begin + whole * k / kTimes);
    for (const build::MotionKey& key : motion.keys) add(motion, box, key.time);
  }

 private:
  void add(const build::Motion& motion, const Box& box, Real time) {
    for (unsigned c = 0; c < 8; ++c) {
      Real3 p;
      for (unsigned axis = 0; axis < 3; ++axis) p[axis] = (c >> axis & 1u) != 0 ? box.max[axis] : box.min[axis];
      const Real3 there = moved(motion, time, p);
      ++samples;
      for (unsigned axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], there[axis]);
        high[axis] = std::max(high[axis], there[axis]);
      }
    }
  }
};

}  // namespace

TEST_CASE("moving points stay within their bounds, and the bounds are tight") {
  Random random(kSeed);
  std::size_t samples = 0;
  for (const MotionKind kind : kKinds) {
    double loosest = 1.0;
    for (unsigned i = 0; i < 60; ++i) {
      build::Motion motion = random_motion(random, kind, 2 + random.below(3), 2.0);
      if (kind != MotionKind::kMatrix && i % 3 == 0) {
        // The largest rotation about some axis, near the origin or far away.
        const auto axis = random.on_sphere();
        const double far = i % 2 == 0 ? 0.0 : 1e3;
        motion.keys = {turned_key(0, axis, 0, {far, 0, 0}),
                       turned_key(1, axis, 179.9 / 180 * 3.14159265358979, {far, 0.1, 0})};
      }
      const Recorded recorded(motion);
      const Box box = random_box(random), bounds = recorded.bounds(box);
      const SampledBounds sampled(motion, box);
      samples += sampled.samples;
      for (unsigned axis = 0; axis < 3; ++axis) {
        INFO("seed " << kSeed << ", " << name_of(kind) << " motion " << i << ", axis " << axis);
        const Real low = sampled.low[axis], high = sampled.high[axis];
        // The floats of the keys differ slightly from the textbook's values of the program's keys.
        const double slack = 0x1p-22 * static_cast<double>(std::fabs(low) + std::fabs(high) + 4);
        REQUIRE(double{bounds.min[axis]} <= static_cast<double>(low) + slack);
        REQUIRE(double{bounds.max[axis]} >= static_cast<double>(high) - slack);
        const double extent = static_cast<double>(high - low) + slack + 0x1p-22 * std::fabs(double{bounds.max[axis]});
        loosest = std::min(loosest, extent / (double{bounds.max[axis]} - double{bounds.min[axis]}));
      }
    }
    std::printf("bounds of motion: %-7s the loosest extent is filled to %.6f\n", name_of(kind), loosest);
    CHECK(loosest > 0.9999);
  }
  std::printf("bounds of motion: %zu samples, none outside\n", samples);
}

TEST_CASE("bounds contain the positions that the records give, exactly") {
  Random random(kSeed + 1);
  for (unsigned i = 0; i < 300; ++i) {
    const MotionKind kind = kKinds[i % 3];
    const Recorded recorded(random_motion(random, kind, 2, i % 2 == 0 ? 2.0 : 1e5));
    const SegmentMotion motion(recorded.parts.segments[0], kind);
    const auto p = random.in_cube(1);
    const Box box = recorded.bounds({{p[0], p[1], p[2]}, {p[0], p[1], p[2]}});
    const double point[3] = {p[0], p[1], p[2]};
    for (unsigned axis = 0; axis < 3; ++axis) {
      const MotionCurve curve = motion.curve(axis, point);
      for (unsigned k = 0; k <= 4000; ++k) {
        const double x = curve.at(k / 4000.0).value;
        INFO("seed " << kSeed + 1 << ", motion " << i << ", axis " << axis << ", s " << k << "/4000");
        REQUIRE(double{box.min[axis]} <= x);
        REQUIRE(x <= double{box.max[axis]});
      }
    }
  }
}

TEST_CASE("a spinning wheel keeps its size; between matrices it shrinks") {
  for (const double degrees : {90.0, 179.9}) {
    const auto quarter = degrees / 180 * 3.14159265358979;
    for (const MotionKind kind : kKinds) {
      if (kind == MotionKind::kMatrix && degrees > 170) continue;
      const Recorded recorded({.keys = {turned_key(0, {0, 0, 1}, 0), turned_key(1, {0, 0, 1}, quarter)}, .kind = kind});
      for (const float time : {0.0f, 0.25f, 0.5f, 0.75f, 1.0f}) {
        const Vec3 rim = point_to_scene(recorded.at(time), Vec3(1, 0, 0));
        const double radius = std::hypot(double{rim.x}, double{rim.y}),
                     angle = std::atan2(double{rim.y}, double{rim.x});
        INFO(name_of(kind) << " at " << time);
        if (kind == MotionKind::kMatrix) {
          // A quarter turn, linearly: along the chord.
          CHECK(radius == Approx(std::sqrt((1.0 - time) * (1.0 - time) + double{time} * double{time})));
          continue;
        }
        CHECK(radius == Approx(1.0));
        if (kind == MotionKind::kSlerp) CHECK(angle == Approx(time * quarter).margin(1e-6));
      }
    }
  }
  const auto halves = build::make_motion(
      {.keys = {turned_key(0, {0, 0, 1}, 0), turned_key(1, {0, 0, 1}, 3.14159265358979)}, .kind = MotionKind::kMatrix});
  REQUIRE_FALSE(halves.has_value());
  CHECK(halves.error().message.find("between keys 0 and 1, at 0.5 of the way, the transform has no inverse") == 0);
}

TEST_CASE("matrices are decomposed and composed again") {
  Random random(kSeed);
  for (unsigned i = 0; i < 2000; ++i) {
    const build::MatrixKey key{.time = 1, .to_scene = random_affine(random, 10)};
    const auto parts = build::decompose(key);
    REQUIRE(parts.has_value());
    const build::MatrixKey again = build::compose(*parts);
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 4; ++c)
        REQUIRE(double{again.to_scene.row[r][c]} == Approx(double{key.to_scene.row[r][c]}).margin(3e-6));
  }
  CHECK_FALSE(build::decompose({0, {{{1, 1, 0, 0}, {1, 1, 0, 0}, {0, 0, 1, 0}}}}).has_value());
  CHECK_FALSE(build::decompose({0, {{{0, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}}}).has_value());
}

TEST_CASE("invalid motions are refused with their numbers") {
  const auto message = [](const build::Motion& motion) {
    const auto made = build::make_motion(motion);
    return made ? std::string() : made.error().message;
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(message({}) == "a motion has keys, or matrices, one of them at least");
  CHECK(message({.keys = {{}}, .matrices = {{}}}) == "a motion has keys, or matrices, one of them at least");
  CHECK(message({.keys = {{}}, .kind = static_cast<MotionKind>(7)}) == "a motion of unknown kind 7");
  CHECK(message({.keys = {{.time = 1}, {.time = 1}}}) == "key 1: time 1 is not after that of the key before, 1");
  CHECK(message({.keys = {{.time = 1}, {.time = nan}}}) == "key 1: time nan is not finite");
  CHECK(message({.keys = {{.time = -3e38f}, {.time = 3e38f}}}) ==
        "key 1: time 3e+38 is too far from that of the key before");
  CHECK(message({.keys = {{.rotation = {0, 0, 0, 0}}}}) == "key 0: the rotation has length 0");
  CHECK(message({.keys = {{.translation = {0, nan, 0}}}}) == "key 0: a number is not finite");
  CHECK(message({.keys = {{.scale = {1, 0, 1}}}}) == "key 0: the scale has a 0");
  CHECK(message({.keys = {{.time = 0}, {.time = 1, .scale = {1, 1, -1}}}}) ==
        "key 1: the scale changes its sign: at some time the transform has no inverse");
  CHECK(message({.keys = {{.time = 0}, {.time = 1, .scale = {1, 1, 1e-8f}}}})
            .find("between keys 0 and 1, at 1 of the way, the transform has no inverse that floats can hold: "
                  "determinant 1e-08") == 0);
  CHECK(message({.matrices = {{0, {{{1, 1, 0, 0}, {1, 1, 0, 0}, {0, 0, 1, 0}}}}}}) ==
        "key 0: the matrix has no inverse that floats can hold: determinant 0");
  // A key of scale 0 hides the instance; something has to be left at another key.
  CHECK(message({.keys = {{.time = 0}, {.time = 1, .scale = {0, 0, 0}}}}) == "");
  CHECK(message({.keys = {{.time = 0, .scale = {0, 0, 0}}, {.time = 1, .scale = {0, 0, 0}}}}) ==
        "all keys hide the instance: leave it out");
  CHECK(message({.keys = {{.time = 0}, {.time = 1, .scale = {0, 0, 0}, .shear = {1, 0, 0}}}}) ==
        "key 1: the scale has a 0");
  // One key, equal keys, rotations by almost 0 and by almost 180 degrees.
  CHECK(message({.keys = {{}}}) == "");
  CHECK(message({.keys = {{.time = 0}, {.time = 1}}}) == "");
  CHECK(message({.keys = {turned_key(0, {0, 0, 1}, 0), turned_key(1, {0, 0, 1}, 1e-12)}}) == "");
  CHECK(message({.keys = {turned_key(0, {0, 0, 1}, 0), turned_key(1, {0, 0, 1}, 3.14159265358979)}}) == "");
}

TEST_CASE("a key that hides its instance: beside it transforms have the recorded error, at it no ray stays finite") {
  Random random(kSeed + 1);
  for (const MotionKind kind : kKinds)
    for (unsigned i = 0; i < 500; ++i) {
      build::Motion motion = random_motion(random, kind, 3, 2.0);
      const std::size_t hidden = random.below(3);
      if (motion.matrices.empty()) {
        std::fill_n(motion.keys[hidden].scale, 3, 0.0f);
        std::fill_n(motion.keys[hidden].shear, 3, 0.0f);
      } else {
        for (auto& row : motion.matrices[hidden].to_scene.row) std::fill_n(row, 3, 0.0f);
      }
      const float at = motion.matrices.empty() ? motion.keys[hidden].time : motion.matrices[hidden].time;
      const Recorded recorded(motion);
      INFO("seed " << kSeed + 1 << ", " << name_of(kind) << " motion " << i);
      for (unsigned k = 0; k < 20; ++k) {
        const auto p = random.in_cube(1.5);
        const float time = random_time(random, motion);
        const bool rests = (hidden == 0 && time <= at) || (hidden == 2 && time >= at);
        if (rests || time == at) continue;
        const Error error = error_at(recorded, motion, time, {p[0], p[1], p[2]});
        REQUIRE(error.is <= error.allowed);
      }
      const Ray ray{.origin = {1, 2, 3}, .direction = {0.5f, -0.25f, 1}};
      CHECK_FALSE(is_traceable(ray_to_object(recorded.at(at), ray)));
    }
}

TEST_CASE("motions that pass nothing, or come very near to it, are judged and end") {
  for (const float scale : {1e-3f, 1e-10f, 1e-16f, 1e-20f, 1e-30f, 1e-44f})
    for (const bool grows : {false, true}) {
      build::Motion motion{.keys = {{.time = 0}, {.time = 1}}};
      std::fill_n(motion.keys[grows ? 0 : 1].scale, 3, scale);
      const auto parts = build::make_motion(motion);
      INFO(scale);
      // Of one shape at all times. The first key of a motion must have an inverse that floats can hold.
      REQUIRE(parts.has_value());
      CHECK(parts->magnification.condition <= 1.06);
    }
  for (const float mirrored : {-1.0f, -0.37f, -0.001f, -3.3f}) {
    build::Motion motion{.kind = MotionKind::kMatrix, .matrices = {{.time = 0}, {.time = 1}}};
    for (unsigned axis = 0; axis < 3; ++axis) motion.matrices[1].to_scene.row[axis][axis] = mirrored;
    const auto parts = build::make_motion(motion);
    REQUIRE_FALSE(parts.has_value());
    CHECK(parts.error().message.find("between keys 0 and 1, at ") == 0);
  }
}

TEST_CASE("a motion that is nearly singular throughout is checked quickly") {
  // The shortest image is far smaller than what changes: by the size of the change alone a key would take a second.
  build::Motion motion{.kind = MotionKind::kSlerp};
  for (unsigned key = 0; key < 100; ++key) {
    const float more = key % 2 == 0 ? 1.0f : 2.0f;
    motion.keys.push_back({.time = static_cast<float>(key), .scale = {more, more, more * 0x1p-19f}});
    motion.keys.back().shear[0] = more - 1.0f;
  }
  const auto parts = build::make_motion(motion);
  REQUIRE(parts.has_value());
  CHECK(parts->magnification.condition >= 0x1p19);
  CHECK(parts->magnification.condition <= 0x1p20);
}
