/// Reading pictures: every kind of OpenEXR file, and damaged files.

#include "write_images.h"

#include <hiprt_build/file.h>
#include <tests/oracle/random.h>
#include <tests/tools/temp_folder.h>
#include <tools/render/image/image_read.h>
#include <tools/render/image/image_write.h>

#include <tests/catch.h>

#include <cstring>
#include <string>
#include <utility>
#include <vector>

using namespace hiprt;
using namespace hiprt::tools;
using namespace hiprt::test;
using Catch::Contains;

namespace {

constexpr std::uint64_t kSeed = 20240612;

void check_colors(const std::filesystem::path& path, const ExrKind& kind) {
  const auto image = read_exr_colors(path);
  INFO((image ? std::string() : image.error().message));
  REQUIRE(image.has_value());
  REQUIRE((image->width == kind.width && image->height == kind.height));
  REQUIRE(image->colors.size() == std::size_t{kind.width} * kind.height);
  bool same = true;
  for (std::uint32_t y = 0; y < kind.height; ++y)
    for (std::uint32_t x = 0; x < kind.width; ++x)
      same = same && image->colors[std::size_t{y} * kind.width + x] ==
                         Vec3(exr_value(0, x, y), exr_value(1, x, y), exr_value(2, x, y));
  CHECK(same);
}

void check_refused(const std::filesystem::path& path, build::ErrorCode code, const std::string& word) {
  const auto image = read_exr_colors(path);
  REQUIRE_FALSE(image.has_value());
  CHECK(image.error().code == code);
  CHECK_THAT(image.error().message, Contains(path.string()) && Contains(word));
  CHECK(image.error().message.find_first_of("\r\n") == std::string::npos);
}

constexpr auto kInvalid = build::ErrorCode::kInvalidInput;

/// What a damaged file may give: an error of one line, or a picture as large as it says. @return is it an error?
bool refused_or_whole(const std::string& bytes) {
  const auto image = decode_exr_colors(std::as_bytes(std::span(bytes)), "bad.exr");
  if (image)
    CHECK((image->colors.size() == std::size_t{image->width} * image->height && image->width <= kMaxSide &&
           image->height <= kMaxSide));
  else
    CHECK_THAT(image.error().message, Catch::StartsWith("bad.exr: "));
  return !image;
}

/// Small files whose every byte counts: name and content.
std::vector<std::pair<std::string, std::string>> small_files(const TempFolder& folder) {
  ExrKind kind;
  kind.width = 9;
  kind.height = 18;
  std::vector<std::pair<std::string, std::string>> files;
  for (const auto compression : {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION,
                                 Imf::PXR24_COMPRESSION, Imf::B44_COMPRESSION, Imf::DWAA_COMPRESSION}) {
    kind.compression = compression;
    kind.type = compression == Imf::B44_COMPRESSION ? Imf::HALF : Imf::FLOAT;
    files.emplace_back("compression " + std::to_string(compression), read_file(write_lines(folder / "a.exr", kind)));
  }
  kind.tiles = Imf::TileDescription(8, 8);
  kind.compression = Imf::ZIP_COMPRESSION;
  files.emplace_back("tiles", read_file(write_tiles(folder / "a.exr", kind)));
  files.emplace_back("part", read_file(write_parts(folder / "a.exr", {kind})));
  return files;
}

}  // namespace

TEST_CASE("Reading EXR: halves and floats, in any data window, with every lossless compression") {
  const TempFolder folder;
  for (const auto type : {Imf::HALF, Imf::FLOAT})
    for (const auto compression : {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION,
                                   Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION, Imf::PXR24_COMPRESSION})
      for (const auto order : {Imf::INCREASING_Y, Imf::DECREASING_Y})
        for (const int corner : {0, 7, -1000}) {
          INFO("type " << type << ", compression " << compression << ", order " << order << ", corner " << corner);
          ExrKind kind;
          kind.type = type;
          kind.compression = compression;
          kind.order = order;
          kind.left = corner;
          kind.top = 3 - corner;
          check_colors(write_lines(folder / "a.exr", kind), kind);
        }
}

TEST_CASE("Reading EXR: tiles, of one level and of many") {
  const TempFolder folder;
  for (const auto mode : {Imf::ONE_LEVEL, Imf::MIPMAP_LEVELS, Imf::RIPMAP_LEVELS})
    for (const unsigned side : {1u, 8u, 16u, 64u})
      for (const int corner : {0, -5}) {
        INFO("mode " << mode << ", side " << side << ", corner " << corner);
        ExrKind kind;
        kind.left = kind.top = corner;
        kind.tiles = Imf::TileDescription(side, 8, mode);
        check_colors(write_tiles(folder / "a.exr", kind), kind);
      }
}

TEST_CASE("Reading EXR: the first of several parts, and R, G and B among other channels") {
  const TempFolder folder;
  ExrKind kind, small;
  small.width = 2;
  small.height = 3;
  check_colors(write_parts(folder / "a.exr", {kind, small}), kind);
  check_colors(write_parts(folder / "b.exr", {small, kind}), small);
  kind.channels = {"R", "G", "B", "A", "Z", "layer.R", "Albedo.G"};
  check_colors(write_lines(folder / "c.exr", kind), kind);
}

TEST_CASE("Reading EXR: pictures of bvhrender are read back") {
  const TempFolder folder;
  Image image(19, 40);
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = 0; x < image.width; ++x)
      image.at(x, y).color = Vec3(exr_value(0, x, y), exr_value(1, x, y), 1.0f / (1.0f + static_cast<float>(x)));
  image.at(3, 4).color = Vec3(std::numeric_limits<float>::infinity());
  REQUIRE(write_exr(folder / "a.exr", image, {}));
  const auto read = read_exr_colors(folder / "a.exr");
  REQUIRE(read.has_value());
  CHECK((read->width == 19 && read->height == 40));
  CHECK(read->colors == colors_of(image).colors);
}

TEST_CASE("Reading EXR: other files and pictures are refused with path and reason") {
  const TempFolder folder;
  const auto of = [&](auto change) {
    ExrKind kind;
    change(kind);
    return write_lines(folder / "kind.exr", kind);
  };
  check_refused(folder / "none.exr", build::ErrorCode::kIo, "No such file");
  check_refused(folder.path(), build::ErrorCode::kIo, "directory");
  check_refused(folder.write("empty.exr", ""), build::ErrorCode::kIo, "empty");
  check_refused(folder.write("text.exr", "a picture"), kInvalid, "not an OpenEXR file");
  check_refused(folder.write("short.exr", "v/"), kInvalid, "not an OpenEXR file");
  check_refused(folder.write("magic.exr", "v/1\x01"), kInvalid, "damaged: ");
  check_refused(of([](ExrKind& kind) { kind.channels = {"R", "B", "A"}; }), kInvalid, "lacks channel G");
  check_refused(of([](ExrKind& kind) { kind.channels = {"Y"}; }), kInvalid, "lacks channel R");
  check_refused(of([](ExrKind& kind) { kind.type = Imf::UINT; }), kInvalid, "channel R is of integers");
  const auto halved = [](ExrKind& kind) {
    kind.sampling = 2;
    kind.width = kind.height = 16;
  };
  check_refused(of(halved), kInvalid, "channel R is subsampled");
  check_refused(write_deep(folder / "deep.exr"), kInvalid, "of type 'deepscanline', not scan lines or tiles");
}

TEST_CASE("Reading EXR: pictures and tiles above the limits are refused with their size") {
  const TempFolder folder;
  const auto of = [&](std::uint32_t width, std::uint32_t height) {
    ExrKind kind;
    kind.width = width;
    kind.height = height;
    return kind;
  };
  const auto large = build::ErrorCode::kTooLarge;
  check_refused(write_lines(folder / "a.exr", of(32769, 1)), large, "32769 x 1 pixels, the limits are 32768 per side");
  check_refused(write_lines(folder / "a.exr", of(1, 32769)), large, "1 x 32769 pixels");
  check_colors(write_lines(folder / "a.exr", of(32768, 1)), of(32768, 1));
  ExrKind tiled;
  tiled.tiles = Imf::TileDescription(1, 40000);
  check_refused(write_tiles(folder / "a.exr", tiled), large, "tiles of 1 x 40000 pixels, the limit is 32768 per side");
}

TEST_CASE("Reading EXR: attributes that every picture has are of their type, and there once") {
  const TempFolder folder;
  const std::string zero(1, '\0');
  const std::string whole = read_file(write_lines(folder / "a.exr", {}));
  const std::vector<std::pair<std::string, std::string>> known{
      {"channels", "chlist"},        {"compression", "compression"}, {"dataWindow", "box2i"},
      {"displayWindow", "box2i"},    {"lineOrder", "lineOrder"},     {"pixelAspectRatio", "float"},
      {"screenWindowCenter", "v2f"}, {"screenWindowWidth", "float"}};
  for (const auto& [name, type] : known) {
    const std::string begin = name + zero + type + zero;
    const std::size_t at = whole.find(begin);
    REQUIRE(at != std::string::npos);
    std::string other = whole;
    other[at + begin.size() - 2] ^= 1;
    const std::string wrong = other.substr(at + name.size() + 1, type.size());
    check_refused(folder.write("type.exr", other), kInvalid,
                  "attribute '" + name + "' is of type '" + wrong + "', not '" + type + "'");
    std::uint32_t size = 0;
    std::memcpy(&size, whole.data() + at + begin.size(), sizeof(size));
    std::string twice = whole;
    twice.insert(at, whole.substr(at, begin.size() + sizeof(size) + size));
    check_refused(folder.write("twice.exr", twice), kInvalid, "attribute '" + name + "' is there twice");
  }
}

TEST_CASE("Reading EXR: a file truncated anywhere is refused") {
  const TempFolder folder;
  for (const auto& [name, whole] : small_files(folder)) {
    INFO(name << ", " << whole.size() << " bytes");
    std::size_t accepted = 0;
    for (std::size_t size = 1; size < whole.size(); ++size)
      if (!refused_or_whole(whole.substr(0, size))) ++accepted;
    CHECK(accepted == 0);
    CHECK_FALSE(refused_or_whole(whole));
  }
}

TEST_CASE("Reading EXR: a file with a wrong byte anywhere is refused or read completely") {
  INFO("seed " << kSeed);
  const TempFolder folder;
  oracle::Random random(kSeed);
  for (const auto& [name, whole] : small_files(folder)) {
    std::size_t refused = 0;
    for (std::size_t at = 0; at < whole.size(); ++at) {
      INFO(name << ", byte " << at);
      std::string bytes = whole;
      bytes[at] = static_cast<char>(bytes[at] ^ static_cast<char>(1 + random.below(255)));
      try {
        if (refused_or_whole(bytes)) ++refused;
      } catch (const std::bad_alloc&) {
        ++refused;
      }
    }
    INFO(name);
    CHECK(refused > 50);  // The header alone has more bytes that matter.
  }
}
