/// Helpers of the validator: bit sets with rank, UTF-8, boxes.

#include <hiprt_build/format/bit_set.h>
#include <hiprt_build/format/box.h>
#include <hiprt_build/format/utf8.h>

#include <tests/catch.h>

#include <set>
#include <string>

using namespace hiprt;
using namespace hiprt::format_detail;

TEST_CASE("a bit set holds, counts and ranks its members") {
  const std::uint64_t bound = GENERATE(1u, 63u, 64u, 65u, 200u);
  BitSet bits(bound);
  std::set<std::uint64_t> members;
  for (std::uint64_t i = 0; i < bound; i = i * 2 + 1) {
    CHECK_FALSE(bits.insert(i));
    CHECK(bits.insert(i));
    members.insert(i);
  }
  bits.index();
  CHECK(bits.count() == members.size());
  for (std::uint64_t i = 0; i < bound; ++i) {
    CHECK(bits.test(i) == (members.count(i) == 1));
    CHECK(bits.rank(i) == static_cast<std::uint64_t>(std::distance(members.begin(), members.lower_bound(i))));
  }
}

TEST_CASE("a bit set finds the first absent number") {
  CHECK(BitSet(0).first_absent(0) == 0);
  for (const std::uint64_t bound : {1u, 63u, 64u, 65u, 128u, 130u}) {
    BitSet bits(bound);
    for (std::uint64_t i = 0; i < bound; ++i) {
      CHECK(bits.first_absent(bound) == i);
      bits.insert(i);
    }
    CHECK(bits.first_absent(bound) == bound);
  }
}

TEST_CASE("UTF-8 is checked as RFC 3629 says") {
  for (const char* good : {"", "a", "\x7f", "\xc2\x80", "\xdf\xbf", "\xe0\xa0\x80", "\xed\x9f\xbf", "\xee\x80\x80",
                           "\xef\xbf\xbf", "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf", "z\xc3\xbc\xe2\x82\xac"})
    CHECK(utf8_prefix(good) == std::string(good).size());
  // Continuation first, overlong, surrogate, above U+10FFFF, cut off, not continued.
  for (const char* bad :
       {"\x80", "\xbf", "\xc0\x80", "\xc1\xbf", "\xe0\x9f\xbf", "\xf0\x8f\xbf\xbf", "\xed\xa0\x80", "\xf4\x90\x80\x80",
        "\xf5\x80\x80\x80", "\xff", "\xc3", "\xe2\x82", "\xf0\x9f\x98", "\xc3(", "\xe2\x28\xa1", "\xe2\x82\x28"}) {
    CHECK(utf8_prefix(bad) == 0);
    CHECK(utf8_prefix(std::string("ok ") + bad) == 3);
  }
}

TEST_CASE("boxes intersect, grow and compare") {
  const Box a{{0, 0, 0}, {2, 2, 2}}, b{{1, 1, 1}, {3, 3, 3}}, apart{{2.5f, 0, 0}, {3, 1, 1}};
  CHECK(first_different_plane(intersection(a, b), Box{{1, 1, 1}, {2, 2, 2}}) == kNoPlane);
  CHECK(first_different_plane(intersection(a, apart), empty_box()) == kNoPlane);
  Box grown = empty_box();
  grow(grown, a);
  CHECK(first_different_plane(grown, a) == kNoPlane);
  grow(grown, b);
  CHECK(first_different_plane(grown, Box{{0, 0, 0}, {3, 3, 3}}) == kNoPlane);
  grow(grown, empty_box());
  CHECK(first_different_plane(grown, Box{{0, 0, 0}, {3, 3, 3}}) == kNoPlane);
  CHECK(first_plane_outside(a, grown) == kNoPlane);
  CHECK(first_plane_outside(grown, a) == 3);
  CHECK(first_plane_outside(b, apart) == 0);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(first_bad_plane(a) == kNoPlane);
  CHECK(first_bad_plane(Box{{0, nan, 0}, {1, 1, 1}}) == 1);
  CHECK(first_bad_plane(Box{{0, 0, 0}, {1, 1, nan}}) == 5);
  CHECK(first_bad_plane(Box{{0, 0, 2}, {1, 1, 1}}) == 2);
  CHECK(first_plane_outside(Box{{0, 0, 0}, {1, nan, 1}}, a) == 4);
}
