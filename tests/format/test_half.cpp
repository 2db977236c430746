/// 16-bit floats: every value, every gap between two values, and random 32-bit floats.

#include <hiprt_device/format/half.h>
#include <tests/oracle/random.h>

#include <tests/catch.h>

#include <bit>
#include <cmath>
#include <limits>
#include <vector>

using namespace hiprt;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

bool is_nan(unsigned half) { return (half & 0x7fffu) > 0x7c00u; }

/// The value of a half by its definition.
double value_of(unsigned half) {
  const int exponent = static_cast<int>(half >> 10 & 31u);
  const double fraction = half & 1023u;
  const double magnitude = exponent == 31  ? (fraction == 0 ? std::numeric_limits<double>::infinity() : std::nan(""))
                           : exponent == 0 ? std::ldexp(fraction, -24)
                                           : std::ldexp(1024 + fraction, exponent - 25);
  return (half & 0x8000u) != 0 ? -magnitude : magnitude;
}

float float_of(unsigned half) { return half_to_float(static_cast<std::uint16_t>(half)); }

/// All halves but NaN and -0, ascending.
std::vector<std::uint16_t> ascending_halves() {
  std::vector<std::uint16_t> halves;
  for (unsigned half = 0xfc00; half > 0x8000; --half) halves.push_back(static_cast<std::uint16_t>(half));
  for (unsigned half = 0; half <= 0x7c00; ++half) halves.push_back(static_cast<std::uint16_t>(half));
  return halves;
}

/// Counts instead of checks: Catch2's assertions are slow.
struct Faults {
  unsigned count = 0;
  float first = 0;

  void expect(bool good, float value) {
    if (!good && count++ == 0) first = value;
  }
};

}  // namespace

TEST_CASE("every half converts to its value") {
  unsigned wrong = 0;
  for (unsigned half = 0; half < 65536; ++half) {
    const float value = float_of(half);
    const bool good =
        is_nan(half) ? std::isnan(value)
                     : static_cast<double>(value) == value_of(half) && std::signbit(value) == ((half & 0x8000u) != 0);
    wrong += good ? 0 : 1;
  }
  CHECK(wrong == 0);
}

TEST_CASE("every half rounds to itself, down and up") {
  unsigned wrong = 0;
  for (unsigned half = 0; half < 65536; ++half) {
    const std::uint16_t below = half_below(float_of(half)), above = half_above(float_of(half));
    wrong += (is_nan(half) ? is_nan(below) && is_nan(above) : below == half && above == half) ? 0 : 1;
  }
  CHECK(wrong == 0);
}

TEST_CASE("floats between two halves round to those halves") {
  const std::vector<std::uint16_t> halves = ascending_halves();
  Faults faults;
  for (std::size_t i = 0; i + 1 < halves.size(); ++i) {
    const float low = half_to_float(halves[i]), high = half_to_float(halves[i + 1]);
    const float inside[] = {std::nextafter(low, kInfinity), std::nextafter(high, -kInfinity),
                            std::isinf(low)    ? -1e30f
                            : std::isinf(high) ? 1e30f
                                               : 0.5f * (low + high)};
    for (const float value : inside)
      faults.expect(half_to_float(half_below(value)) == low && half_to_float(half_above(value)) == high, value);
  }
  INFO(faults.first);
  CHECK(faults.count == 0);
}

TEST_CASE("random floats round to the two halves around them") {
  constexpr std::uint64_t kSeed = 41;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  Faults faults;
  for (unsigned round = 0; round < 2'000'000; ++round) {
    const float value = random.any_float();
    const std::uint16_t below = half_below(value), above = half_above(value);
    if (std::isnan(value)) {
      faults.expect(is_nan(below) && is_nan(above), value);
      continue;
    }
    const double low = value_of(below), high = value_of(above), here = static_cast<double>(value);
    // Neighbours, or one half: no other half is between, as halves of one sign are ordered like their bits.
    const bool adjacent = below == above || (value > 0 ? above == below + 1 : below == above + 1);
    faults.expect(low <= here && here <= high && adjacent && (below != above || low == here), value);
  }
  INFO(faults.first);
  CHECK(faults.count == 0);
}

TEST_CASE("the edges of the range") {
  CHECK(half_below(65504.0f) == 0x7bff);
  CHECK(half_above(65504.0f) == 0x7bff);
  CHECK(half_below(std::nextafter(65504.0f, kInfinity)) == 0x7bff);
  CHECK(half_above(std::nextafter(65504.0f, kInfinity)) == kHalfInfinity);
  CHECK(half_below(std::numeric_limits<float>::max()) == 0x7bff);
  CHECK(half_above(-std::numeric_limits<float>::max()) == 0xfbff);
  CHECK(half_below(-65505.0f) == kHalfNegativeInfinity);
  CHECK(half_below(kInfinity) == kHalfInfinity);
  CHECK(half_above(-kInfinity) == kHalfNegativeInfinity);
  CHECK(half_below(0x1p-149f) == 0);
  CHECK(half_above(0x1p-149f) == 1);
  CHECK(half_below(-0x1p-149f) == 0x8001);
  CHECK(half_above(-0x1p-149f) == 0x8000);
  static_assert(half_to_float(half_above(1.0f)) == 1.0f && half_below(1.0005f) == 0x3c00, "usable at compile time");
}
