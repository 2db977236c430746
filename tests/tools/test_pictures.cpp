/// PNG and JPEG files become the texels that were put in, or are refused.

#include "picture_files.h"

#include <tests/oracle/random.h>
#include <tools/scene_io/surface/material_library.h>
#include <tools/scene_io/surface/picture.h>

#include <tests/catch.h>

#include <cmath>
#include <cstdlib>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

using Texels = std::vector<std::uint32_t>;

build::Result<tools::Texture> decode(const std::string& file, std::uint64_t most = tools::kMostTexels) {
  return tools::decode_picture(std::as_bytes(std::span(file)), most);
}

tools::Texture decoded(const std::string& file) {
  auto texture = decode(file);
  if (!texture) FAIL(texture.error().message);
  REQUIRE(texture->texels.size() == std::size_t{texture->width} * texture->height);
  return std::move(*texture);
}

std::string fault(const std::string& file, build::ErrorCode code = build::ErrorCode::kInvalidInput,
                  std::uint64_t most = tools::kMostTexels) {
  const auto texture = decode(file, most);
  if (texture) FAIL("accepted");
  CHECK(texture.error().code == code);
  return texture.error().message;
}

std::vector<unsigned char> random_bytes(std::size_t count, std::uint64_t seed) {
  oracle::Random random(seed);
  std::vector<unsigned char> bytes(count);
  for (auto& byte : bytes) byte = static_cast<unsigned char>(random.below(256));
  return bytes;
}

/// A picture of one smooth ramp in every channel, which JPEG keeps well.
std::vector<unsigned char> ramp(int width, int height) {
  std::vector<unsigned char> rgb;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (const int value : {4 * x, 4 * y, 128}) rgb.push_back(static_cast<unsigned char>(value));
  return rgb;
}

/// The offset of the first marker of a kind.
std::size_t marker_at(const std::string& jpeg, char kind) { return jpeg.find(std::string("\xff") + kind); }

}  // namespace

TEST_CASE("pictures: PNG of every kind of texels") {
  using P = PngContent;
  const int grey = PNG_COLOR_TYPE_GRAY, grey_alpha = PNG_COLOR_TYPE_GRAY_ALPHA, rgb = PNG_COLOR_TYPE_RGB;
  const auto texels = [](const P& content) { return decoded(png_file(content)).texels; };
  CHECK(texels(P{2, 1, PNG_COLOR_TYPE_RGBA, 8, {1, 2, 3, 4, 5, 6, 7, 8}}) ==
        Texels{texel(1, 2, 3, 4), texel(5, 6, 7, 8)});
  CHECK(texels(P{2, 1, rgb, 8, {1, 2, 3, 4, 5, 6}}) == Texels{texel(1, 2, 3), texel(4, 5, 6)});
  CHECK(texels(P{1, 2, grey, 8, {7, 9}}) == Texels{texel(7, 7, 7), texel(9, 9, 9)});
  CHECK(texels(P{1, 1, grey_alpha, 8, {7, 9}}) == Texels{texel(7, 7, 7, 9)});
  CHECK(texels(P{4, 1, grey, 2, {0x1b}}) ==
        Texels{texel(0, 0, 0), texel(85, 85, 85), texel(170, 170, 170), texel(255, 255, 255)});
  CHECK(texels(P{2, 1, grey, 1, {0x40}}) == Texels{texel(0, 0, 0), texel(255, 255, 255)});
  P palette{3, 1, PNG_COLOR_TYPE_PALETTE, 8, {1, 0, 1}};
  palette.palette = {{10, 20, 30}, {40, 50, 60}};
  CHECK(texels(palette) == Texels{texel(40, 50, 60), texel(10, 20, 30), texel(40, 50, 60)});
  palette.transparent = {5};
  CHECK(texels(palette) == Texels{texel(40, 50, 60), texel(10, 20, 30, 5), texel(40, 50, 60)});
  P keyed{2, 1, grey, 8, {7, 9}};
  keyed.transparent_grey = 9;
  CHECK(texels(keyed) == Texels{texel(7, 7, 7), texel(9, 9, 9, 0)});
}

TEST_CASE("pictures: 16 bits of PNG are rounded to the nearest of 8") {
  std::vector<unsigned char> rows;
  Texels expected;
  for (unsigned value = 0; value < 65536; ++value) {
    rows.push_back(static_cast<unsigned char>(value >> 8));
    rows.push_back(static_cast<unsigned char>(value));
    const auto near = static_cast<unsigned>(std::lround(value / 257.0));
    expected.push_back(texel(near, near, near));
  }
  CHECK(decoded(png_file(PngContent{256, 256, PNG_COLOR_TYPE_GRAY, 16, rows})).texels == expected);
}

TEST_CASE("pictures: interlaced PNG; gamma is not applied") {
  const auto bytes = random_bytes(4 * 13 * 11, 1);
  PngContent content{13, 11, PNG_COLOR_TYPE_RGBA, 8, bytes};
  const Texels plain = decoded(png_file(content)).texels;
  CHECK(plain[13 * 10 + 12] == texel(bytes[568], bytes[569], bytes[570], bytes[571]));
  content.interlaced = true;
  content.gamma = 1.0;
  CHECK(decoded(png_file(content)).texels == plain);
}

TEST_CASE("pictures: JPEG to within its compression error") {
  const auto rgb = ramp(50, 30);
  const auto texture = decoded(jpeg_file(50, 30, rgb));
  REQUIRE(texture.width == 50);
  REQUIRE(texture.height == 30);
  int worst = 0;
  for (std::size_t i = 0; i < texture.texels.size(); ++i) {
    CHECK(texture.texels[i] >> 24 == 255);
    for (unsigned c = 0; c < 3; ++c)
      worst = std::max(worst, std::abs(static_cast<int>(texture.texels[i] >> (8 * c) & 255u) - rgb[3 * i + c]));
  }
  CHECK(worst <= 4);
}

TEST_CASE("pictures: files that are neither PNG nor JPEG, or truncated, are refused") {
  CHECK(fault("") == "it is neither PNG nor JPEG");
  CHECK(fault("GIF89a") == "it is neither PNG nor JPEG");
  const std::string png = png_file(5, 4, random_bytes(80, 2)), jpeg = jpeg_file(50, 30, ramp(50, 30));
  for (std::size_t size = 0; size < png.size(); ++size) fault(png.substr(0, size));
  for (std::size_t size = 0; size < jpeg.size(); ++size) fault(jpeg.substr(0, size));
  CHECK_THAT(fault(png.substr(0, 50)), Contains("damaged PNG: truncated"));
  CHECK_THAT(fault(jpeg.substr(0, 500)), Contains("damaged JPEG: truncated after 500 bytes"));
  CHECK_THAT(fault(std::string("\xff\xd8\xff\xd9")), Contains("ends without a picture"));
}

TEST_CASE("pictures: a PNG with any byte changed is refused") {
  const std::string png = png_file(5, 4, random_bytes(80, 3));
  // The last four bytes are the checksum of the empty chunk IEND, which libpng 1.6.48 does not compare.
  for (std::size_t i = 0; i + 4 < png.size(); ++i) {
    std::string damaged = png;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    INFO("byte " << i);
    const auto texture = decode(damaged);
    CHECK(!texture);
  }
  std::string damaged = png;
  damaged[png.find("IEND") - 5] ^= 1;  // Of the checksum before the last chunk.
  CHECK(fault(damaged) == "damaged PNG: IDAT: CRC error");
}

TEST_CASE("pictures: a JPEG with damaged bytes is refused, or a picture of its size") {
  oracle::Random random(4);
  const std::string jpeg = jpeg_file(20, 10, ramp(20, 10));
  for (int i = 0; i < 3000; ++i) {
    std::string damaged = jpeg;
    for (int k = 0; k < 3; ++k)
      damaged[3 + random.below(static_cast<std::uint32_t>(jpeg.size() - 3))] = static_cast<char>(random.below(256));
    INFO("file " << i << " of seed 4");
    const auto texture = decode(damaged, 1u << 20);
    if (texture) CHECK(texture->texels.size() == std::size_t{texture->width} * texture->height);
  }
}

TEST_CASE("pictures: sizes are refused before anything is decoded") {
  std::string png = png_file(5, 4, random_bytes(80, 5)), jpeg = jpeg_file(50, 30, ramp(50, 30));
  using build::ErrorCode;
  CHECK(fault(png, ErrorCode::kTooLarge, 19) == "5 x 4 texels, and only 19 are left of the limit for all pictures");
  CHECK(decode(png, 20));
  CHECK_THAT(fault(jpeg, ErrorCode::kTooLarge, 1499), Contains("50 x 30 texels"));
  // Start of frame 0: length, precision, height, width.
  const std::size_t frame = marker_at(jpeg, '\xc0');
  REQUIRE(frame != std::string::npos);
  jpeg[frame + 7] = '\x40';
  jpeg[frame + 8] = '\x01';
  CHECK(fault(jpeg, ErrorCode::kTooLarge) == "16385 x 30 texels, the limit is 16384 a side");
  jpeg[frame + 7] = jpeg[frame + 8] = 0;
  CHECK(fault(jpeg) == "0 x 30 texels");
  const std::string wide = png_file(PngContent{16385, 1, PNG_COLOR_TYPE_GRAY, 8, std::vector<unsigned char>(16385)});
  CHECK(fault(wide, ErrorCode::kTooLarge) == "16385 x 1 texels, the limit is 16384 a side");
  const std::string widest = png_file(PngContent{16384, 1, PNG_COLOR_TYPE_GRAY, 8, std::vector<unsigned char>(16384)});
  CHECK(decoded(widest).width == 16384);
}
