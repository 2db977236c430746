/// Boxes to nodes and back, for every layout: each decoded box contains the original and is as tight as documented.
/// Exact rationals (GMP) decide.

#include <hiprt_build/format/validate_quantized.h>
#include <hiprt_device/format/layout.h>
#include <tests/oracle/exact.h>
#include <tests/oracle/random.h>

#include <tests/catch.h>

#include <cmath>
#include <functional>

using namespace hiprt;
using oracle::exact;
using oracle::Random;
using oracle::Rational;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kLargest = std::numeric_limits<float>::max();
constexpr std::uint64_t kSeed = 43;

struct Boxes {
  Box box[kBranching];
};

/// Draws a coordinate; each box takes two per axis.
struct Source {
  const char* name;
  std::function<float(Random&, unsigned axis)> draw;
};

std::vector<Source> sources() {
  const auto uniform = [](double low, double high) {
    return [=](Random& random, unsigned) { return random.uniform_float(low, high); };
  };
  return {
      {"unit", uniform(-1, 1)},
      {"away from 0", uniform(2, 3)},
      {"offset 1e7", uniform(1e7, 1e7 + 40)},
      {"offset -1e7, small", uniform(-1e7, -1e7 + 2)},
      {"huge", uniform(-1e37, 1e37)},
      {"up to the limit", [](Random& random, unsigned) { return random.coin() ? -0x1p126f : 0x1.fffffep125f; }},
      {"subnormal", uniform(-1e-40, 1e-40)},
      {"around the smallest normal", uniform(-0x1p-125, 0x1p-125)},
      {"all magnitudes",
       [](Random& random, unsigned) {
         const auto x = static_cast<float>(random.log_uniform(1e-44, 8e37));
         return random.coin() ? x : -x;
       }},
      {"flat along y", [](Random& random, unsigned axis) { return axis == 1 ? 0.7f : random.uniform_float(-1, 1); }},
      {"one point", [](Random&, unsigned axis) { return axis == 0   ? 1e7f + 1
                                                        : axis == 1 ? -0.3f
                                                                    : 1e-41f; }},
      {"integers", [](Random& random, unsigned) { return static_cast<float>(random.below(300)); }}};
}

Boxes random_boxes(Random& random, const Source& source) {
  Boxes boxes;
  for (Box& box : boxes.box) {
    box = format_detail::empty_box();
    if (random.below(4) == 0) continue;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const float a = source.draw(random, axis), b = source.draw(random, axis);
      box.min[axis] = std::min(a, b);
      box.max[axis] = std::max(a, b);
    }
  }
  return boxes;
}

template <class Layout, class Check> void for_random_nodes(unsigned rounds, Check&& check) {
  Random random(kSeed);
  for (const Source& source : sources())
    for (unsigned round = 0; round < rounds; ++round) {
      INFO("seed " << kSeed << ", " << source.name << ", round " << round);
      const Boxes boxes = random_boxes(random, source);
      typename Layout::Node node{};
      REQUIRE(Layout::set_boxes(node, boxes.box));
      check(boxes, node);
    }
}

/// Every decoded box contains the one given; absent ones are empty.
template <class Layout> void check_contained(const Boxes& boxes, const typename Layout::Node& node) {
  for (unsigned c = 0; c < kBranching; ++c) {
    const Box decoded = Layout::box(node, c);
    if (is_empty(boxes.box[c]))
      REQUIRE(format_detail::first_different_plane(decoded, format_detail::empty_box()) == format_detail::kNoPlane);
    else
      REQUIRE(format_detail::first_plane_outside(boxes.box[c], decoded) == format_detail::kNoPlane);
  }
}

/// Scale and magnitude of one axis of the boxes that are there.
struct Extent {
  float low = kInfinity, high = -kInfinity;

  Extent(const Boxes& boxes, unsigned axis) {
    for (const Box& box : boxes.box) {
      if (is_empty(box)) continue;
      low = std::min(low, box.min[axis]);
      high = std::max(high, box.max[axis]);
    }
  }
  /// Whether the extent, rounded outwards to multiples of @p scale, has at most 255 steps and only floats in it.
  bool fits(double scale) const {
    const double first = std::floor(static_cast<double>(low) / scale),
                 last = std::ceil(static_cast<double>(high) / scale);
    const double magnitude = std::max(std::abs(static_cast<double>(low)), std::abs(static_cast<double>(high)));
    return last - first <= 255 && scale >= 0x1p-126 && scale >= oracle::ulp(magnitude);
  }
};

/// One plane: exactly what its bytes mean, and less than one step outside of @p wanted.
void check_plane(const QuantizedBoxNode& node, unsigned axis, unsigned side, unsigned child, float wanted) {
  const Rational scale = exact(std::ldexp(1.0f, node.exponent[axis] - 127));
  const Rational plane = exact(node.origin[axis]) + node.plane[axis][side][child] * scale;
  REQUIRE(plane == exact(dequantize(node, axis, side, child)));
  const Rational outside = side == 0 ? exact(wanted) - plane : plane - exact(wanted);
  REQUIRE(outside >= 0);
  REQUIRE(outside < scale);
  REQUIRE(format_detail::is_exact_plane(node.origin[axis], node.plane[axis][side][child],
                                        quantized_scale(node.exponent[axis])));
}

}  // namespace

TEMPLATE_TEST_CASE("float layouts keep every bit", "", FloatLayout, PlanesLayout) {
  for_random_nodes<TestType>(200, [](const Boxes& boxes, const typename TestType::Node& node) {
    for (unsigned c = 0; c < kBranching; ++c) {
      using Bits = std::array<std::uint32_t, 6>;
      REQUIRE(std::bit_cast<Bits>(TestType::box(node, c)) == std::bit_cast<Bits>(boxes.box[c]));
    }
  });
}

TEST_CASE("half planes are the nearest halves outside") {
  for_random_nodes<HalfLayout>(1000, [](const Boxes& boxes, const HalfBoxNode& node) {
    check_contained<HalfLayout>(boxes, node);
    for (unsigned c = 0; c < kBranching; ++c)
      for (unsigned axis = 0; axis < 3 && !is_empty(boxes.box[c]); ++axis) {
        // The next half inwards is not outside: finite ones ascend with their bits, away from zero.
        const auto inwards = [](std::uint16_t half, bool up) {
          const bool negative = (half & 0x8000u) != 0, zero = (half & 0x7fffu) == 0;
          if (zero) return half_to_float(up ? 1 : 0x8001);
          return half_to_float(static_cast<std::uint16_t>(negative == up ? half - 1 : half + 1));
        };
        REQUIRE(inwards(node.box[c].min[axis], true) > boxes.box[c].min[axis]);
        REQUIRE(inwards(node.box[c].max[axis], false) < boxes.box[c].max[axis]);
        REQUIRE(node.box[c].min[axis] != kHalfInfinity);
        REQUIRE(node.box[c].max[axis] != kHalfNegativeInfinity);
      }
  });
}

TEST_CASE("quantized planes are exact, less than one step outside, and steps as small as they can be") {
  for_random_nodes<QuantizedLayout>(1000, [](const Boxes& boxes, const QuantizedBoxNode& node) {
    check_contained<QuantizedLayout>(boxes, node);
    std::uint32_t present = 0;
    for (unsigned c = 0; c < kBranching; ++c) present |= (is_empty(boxes.box[c]) ? 0u : 1u) << c;
    REQUIRE(children_mask(node.children) == present);
    REQUIRE((node.children & 0xc0u) == 0);
    for (unsigned axis = 0; axis < 3; ++axis) {
      for (unsigned c = 0; c < kBranching; ++c) {
        if (is_empty(boxes.box[c])) {
          REQUIRE(node.plane[axis][0][c] == 255);
          REQUIRE(node.plane[axis][1][c] == 0);
          continue;
        }
        check_plane(node, axis, 0, c, boxes.box[c].min[axis]);
        check_plane(node, axis, 1, c, boxes.box[c].max[axis]);
      }
      if (present == 0) continue;
      const Extent extent(boxes, axis);
      const double scale = std::ldexp(1.0, node.exponent[axis] - 127);
      REQUIRE(extent.fits(scale));
      REQUIRE_FALSE(extent.fits(scale / 2));
    }
  });
}

TEST_CASE("the order axis is where the centres spread most") {
  for_random_nodes<QuantizedLayout>(200, [](const Boxes& boxes, const QuantizedBoxNode& node) {
    double spread[3] = {0, 0, 0}, magnitude = 0;
    const auto center = [](const Box& box, unsigned axis) {
      return 0.5 * (double{box.min[axis]} + double{box.max[axis]});
    };
    for (unsigned axis = 0; axis < 3; ++axis)
      for (const Box& a : boxes.box)
        for (const Box& b : boxes.box) {
          if (is_empty(a) || is_empty(b)) continue;
          spread[axis] = std::max(spread[axis], center(a, axis) - center(b, axis));
          magnitude = std::max(magnitude, std::abs(center(a, axis)));
        }
    const double widest = std::max({spread[0], spread[1], spread[2]});
    REQUIRE(children_order_axis(node.children) <= 2);
    // Centres are computed in float.
    REQUIRE(spread[children_order_axis(node.children)] >= widest - magnitude * 0x1p-21);
  });
}

TEST_CASE("boxes that quantized nodes cannot hold are refused") {
  const Box good{{0, 0, 0}, {1, 1, 1}};
  for (const float bad : {std::nextafter(0x1p126f, kInfinity), kLargest, -kLargest, kInfinity, -kInfinity})
    for (unsigned axis = 0; axis < 3; ++axis) {
      Box boxes[kBranching] = {good, format_detail::empty_box(), good, good};
      (bad > 0 ? boxes[2].max : boxes[2].min)[axis] = bad;
      QuantizedBoxNode node{};
      CHECK_FALSE(QuantizedLayout::set_boxes(node, boxes));
    }
}

TEST_CASE("planes are marked exact if and only if they are exact") {
  INFO("seed " << kSeed);
  Random random(kSeed);
  unsigned wrong = 0, seen[2] = {0, 0};
  for (unsigned round = 0; round < 300'000; ++round) {
    const auto q = static_cast<std::uint8_t>(random.below(256));
    const auto exponent = static_cast<std::uint8_t>(1 + random.below(254));
    float origin = random.any_float();
    // Often of a magnitude at which it matters.
    if (random.coin())
      origin = std::ldexp(random.uniform_float(-1, 1), exponent - 127 + static_cast<int>(random.below(36)) - 4);
    if (random.coin()) origin = std::ldexp(std::floor(std::ldexp(origin, 127 - exponent)), exponent - 127);
    if (!(std::abs(origin) <= kQuantizedLimit)) continue;
    const Rational plane = exact(origin) + q * exact(std::ldexp(1.0f, exponent - 127));
    const bool in_range = abs(plane) <= exact(kQuantizedLimit);
    const bool truth = in_range && exact(oracle::nearest_float(plane)) == plane;
    ++seen[truth ? 1 : 0];
    wrong += format_detail::is_exact_plane(origin, q, quantized_scale(exponent)) == truth ? 0 : 1;
  }
  CHECK(wrong == 0);
  CHECK(seen[0] > 10'000);
  CHECK(seen[1] > 10'000);
}
