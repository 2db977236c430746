// The functions of hiprt_common.h and hiprt_math.h, on the host.

#include <hiprt/hiprt_math.h>
#include <tests/catch.h>

#include <limits>

TEST_CASE("vectors: operators, and functions in namespace hiprt") {
  const hiprtFloat3 a{1, 2, 3}, b{4, -5, 6};
  CHECK(a + b == hiprtFloat3{5, -3, 9});
  CHECK(a - b == hiprtFloat3{-3, 7, -3});
  CHECK(a * b == hiprtFloat3{4, -10, 18});
  CHECK(b / a == hiprtFloat3{4, -2.5f, 2});
  CHECK(2.0f * a == a * 2.0f);
  CHECK(a / 2.0f == hiprtFloat3{0.5f, 1, 1.5f});
  CHECK(6.0f / a == hiprtFloat3{6, 3, 2});
  CHECK(-a == hiprtFloat3{-1, -2, -3});
  CHECK(a != b);
  hiprtFloat3 c = a;
  c += b;
  c -= a;
  c *= 2.0f;
  c /= hiprtFloat3{2, 2, 2};
  CHECK(c == b);
  CHECK(hiprtInt2{1, 2} + hiprtInt2{3, 4} == hiprtInt2{4, 6});
  CHECK(hiprtUint4{1, 2, 3, 4} * 2u == hiprtUint4{2, 4, 6, 8});
  CHECK(hiprt::min(a, b) == hiprtFloat3{1, -5, 3});
  CHECK(hiprt::max(a, b) == hiprtFloat3{4, 2, 6});
  CHECK(hiprt::clamp(b, -1.0f, 5.0f) == hiprtFloat3{4, -1, 5});
  CHECK(hiprt::dot(a, b) == 12.0f);
  CHECK(hiprt::dot(hiprtInt2{1, 2}, hiprtInt2{3, 4}) == 11);
  CHECK(hiprt::cross(a, b) == hiprtFloat3{27, 6, -13});
  CHECK(hiprt::normalize(hiprtFloat3{0, 3, 4}) == hiprtFloat3{0, 3.0f * (1.0f / 5.0f), 4.0f * (1.0f / 5.0f)});
  CHECK(hiprt::fma(a, b, a) == hiprtFloat3{5, -8, 21});
  CHECK(hiprt::mix(a, b, 0.5f) == hiprtFloat3{2.5f, -1.5f, 4.5f});
  CHECK(hiprt::ptr(a)[2] == 3.0f);
  CHECK(hiprt::hypot(hiprtFloat2{3, 4}) == 5.0f);
}

TEST_CASE("making vectors") {
  CHECK(hiprt::make_float3(1, 2.0, 3u) == hiprtFloat3{1, 2, 3});
  CHECK(hiprt::make_float3(2.0f) == hiprtFloat3{2, 2, 2});
  CHECK(hiprt::make_float3(hiprtFloat4{1, 2, 3, 4}) == hiprtFloat3{1, 2, 3});
  CHECK(hiprt::make_float3(hiprtInt3{1, 2, 3}) == hiprtFloat3{1, 2, 3});
  CHECK(hiprt::make_float3(hiprtFloat2{1, 2}, 3) == hiprtFloat3{1, 2, 3});
  CHECK(hiprt::make_float4(hiprtFloat3{1, 2, 3}, 4) == hiprtFloat4{1, 2, 3, 4});
  CHECK(hiprt::make_int2(1.9f, -1.9f) == hiprtInt2{1, -1});
  CHECK(hiprt::make_uint4(7) == hiprtUint4{7, 7, 7, 7});
}

TEST_CASE("numbers") {
  CHECK(hiprt::min(1, 2) == 1);
  CHECK(hiprt::max(1.0f, 2.0f) == 2.0f);
  CHECK(hiprt::clamp(5, 1, 3) == 3);
  CHECK(hiprt::mix(1.0f, 3.0f, 0.25f) == 1.5f);
  CHECK(hiprt::sign(-2.0f) == -1.0f);
  CHECK(hiprt::sign(0) == 0);
  // Products whose difference is the rounding error of one of them.
  const float x = 1.0f + 0x1p-12f;
  CHECK(hiprt::differenceOfProducts(x, x, 1.0f, 1.0f + 0x1p-11f) == 0x1p-24f);
  CHECK(hiprt::sumOfProducts(x, x, -1.0f, 1.0f + 0x1p-11f) == 0x1p-24f);
  CHECK(hiprt::as_float(0x3f800000u) == 1.0f);
  CHECK(hiprt::as_int(-0.0f) == std::numeric_limits<int>::min());
  CHECK(hiprt::as_uint(2.0f) == 0x40000000u);
  CHECK(hiprt::clz(0u) == 32u);
  CHECK(hiprt::clz(1u) == 31u);
  CHECK(hiprt::clz(-1) == 0u);
  CHECK(hiprt::Log2(1u) == 0u);
  CHECK(hiprt::RoundUp(64u, 64u) == 64u);
}
