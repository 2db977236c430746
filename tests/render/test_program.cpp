/// bvhrender as a user runs it: the content of its pictures.

#include "read_images.h"
#include "renderer.h"

#include <hiprt_build/instances.h>
#include <hiprt_device/format/node.h>
#include <tools/render/image/color.h>

#include <nlohmann/json.hpp>

#include <cmath>
#include <set>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

template <class Values> std::set<std::string> names_of(const std::map<std::string, Values>& channels) {
  std::set<std::string> names;
  for (const auto& channel : channels) names.insert(channel.first);
  return names;
}

Vec3 vector_at(const ExrFile& file, const std::array<std::string, 3>& channels, std::uint32_t x, std::uint32_t y) {
  return {file.at(channels[0], x, y), file.at(channels[1], x, y), file.at(channels[2], x, y)};
}

/// The colours and layers, without the attributes.
bool same_picture(const ExrFile& a, const ExrFile& b) {
  return a.width == b.width && a.height == b.height && a.floats == b.floats && a.uints == b.uints;
}

}  // namespace

TEST_CASE("bvhrender: EXR layers have their names and the values of the middle pixel") {
  const TempFolder folder;
  render_well({write_squares(folder), "-o", folder / "a.exr", "--size", "65x49", "--camera", kFront, "--spp", "2"});
  const ExrFile file = read_exr(folder / "a.exr");
  CHECK(file.width == 65);
  CHECK(file.height == 49);
  CHECK(names_of(file.floats) ==
        std::set<std::string>{"R", "G", "B", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "Z", "cost.fill"});
  CHECK(names_of(file.uints) == std::set<std::string>{"id.geometry", "id.primitive", "cost.boxes", "cost.leaves",
                                                      "cost.triangles", "cost.steps"});
  // The middle: the back square at the edge that its triangles share.
  CHECK(file.at("Z", 32, 24) == 4.0f);
  CHECK(vector_at(file, {"P.X", "P.Y", "P.Z"}, 32, 24) == Vec3(0, 0, 0));
  CHECK(vector_at(file, {"N.X", "N.Y", "N.Z"}, 32, 24) == Vec3(0, 0, 1));
  CHECK(file.uint_at("id.geometry", 32, 24) == 0);
  CHECK(file.uint_at("id.primitive", 32, 24) == 0);
  CHECK(file.uint_at("cost.boxes", 32, 24) > 0);
  CHECK(file.uint_at("cost.leaves", 32, 24) > 0);
  CHECK(file.uint_at("cost.triangles", 32, 24) > 0);
  CHECK(file.uint_at("cost.steps", 32, 24) == file.uint_at("cost.boxes", 32, 24) + file.uint_at("cost.leaves", 32, 24));
  CHECK(file.at("cost.fill", 32, 24) == 1.0f);  // Both squares are pairs.
  CHECK(file.at("cost.fill", 0, 0) == 0.0f);
  // Half of the height is tan(20 degrees) * 4 in the plane z = 0, * 3 in the plane z = 1.
  const double pixels = 24.5 / std::tan(20.0 / 180.0 * 3.14159265358979323846);
  const auto column = [&](double x, double depth) { return static_cast<std::uint32_t>(32.5 + x / depth * pixels); };
  const auto row = [&](double y, double depth) { return static_cast<std::uint32_t>(24.5 - y / depth * pixels); };
  const std::uint32_t x = column(0.8, 3), y = row(0.6, 3);
  CHECK(file.uint_at("id.geometry", x, y) == 1);
  CHECK(file.uint_at("id.primitive", x, y) == 0);  // Below the diagonal.
  CHECK(file.uint_at("id.primitive", column(0.6, 3), row(0.8, 3)) == 1);
  CHECK(file.at("P.Z", x, y) == Approx(1.0).margin(1e-6));
  CHECK(file.at("Z", x, y) == Approx(std::sqrt(0.8 * 0.8 + 0.6 * 0.6 + 9)).epsilon(0.01));
  // Top left: past the scene.
  CHECK(std::isinf(file.at("Z", 0, 0)));
  CHECK(file.uint_at("id.geometry", 0, 0) == kInvalidId);
  CHECK(file.uint_at("id.primitive", 0, 0) == kInvalidId);
  CHECK(vector_at(file, {"N.X", "N.Y", "N.Z"}, 0, 0) == Vec3(0.0f));
}

TEST_CASE("bvhrender: the layers of a scene of instances have the hit instance and the number of visited instances") {
  const TempFolder folder;
  const auto object = build::map_file(write_squares(folder));
  REQUIRE(object.has_value());
  const std::vector<std::span<const std::byte>> files{object->bytes()};
  // The first to the left, the second to the right.
  std::vector<build::Instance> instances(2);
  instances[0].to_scene.row[0][3] = -1.5f;
  instances[1].to_scene.row[0][3] = 1.5f;
  const auto scene = build::build_instances(files, instances);
  REQUIRE(scene.has_value());
  REQUIRE(build::write_file(folder / "i.bvh", scene->buffer.bytes()).has_value());
  for (const std::string mode : {"ao", "primary", "normals", "heatmap"}) {
    INFO(mode);
    render_well({folder / "i.bvh", "-o", folder / "a.exr", "--size", "65x49", "--camera", "0,0,8/0,0,0/0,1,0/40",
                 "--spp", "2", "--mode", mode});
    const ExrFile file = read_exr(folder / "a.exr");
    CHECK(names_of(file.uints) == std::set<std::string>{"id.geometry", "id.primitive", "id.instance", "cost.boxes",
                                                        "cost.leaves", "cost.triangles", "cost.steps",
                                                        "cost.instances"});
    for (const std::uint32_t instance : {0u, 1u}) {
      const std::uint32_t x = instance == 0 ? 20 : 44;
      CHECK(file.uint_at("id.instance", x, 24) == instance);
      CHECK(file.uint_at("id.geometry", x, 24) == 0);
      CHECK(file.uint_at("cost.instances", x, 24) == 1);
      CHECK(vector_at(file, {"N.X", "N.Y", "N.Z"}, x, 24) == Vec3(0, 0, 1));
      CHECK(file.at("P.Z", x, 24) == Approx(0.0).margin(1e-6));
    }
    CHECK(file.uint_at("id.instance", 0, 0) == kInvalidId);
    CHECK(file.uint_at("cost.instances", 0, 0) == 0);
  }
}

TEST_CASE("bvhrender: EXR files name their source, and their camera reproduces the picture") {
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  const std::vector<std::string> rest{"--size", "40x30", "--spp", "3", "--seed", "5", "--mode", "primary"};
  const auto picture = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{scene, "-o", folder / name};
    arguments.insert(arguments.end(), rest.begin(), rest.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    render_well(arguments);
    return read_exr(folder / name);
  };
  const ExrFile first = picture("a.exr", {});
  CHECK_THAT(first.attributes.at("software"), Catch::Matches("bvhrender [0-9]+\\.[0-9]+\\.[0-9]+"));
  CHECK(first.attributes.at("scene") == scene);
  CHECK(first.attributes.at("mode") == "primary");
  CHECK(first.attributes.at("spp") == "3");
  CHECK(first.attributes.at("seed") == "5");
  CHECK_THAT(first.attributes.at("comments"), Contains("linear"));
  CHECK(same_picture(first, picture("b.exr", {"--camera", first.attributes.at("camera")})));
  CHECK_FALSE(same_picture(first, picture("c.exr", {"--camera", kFront})));
}

TEST_CASE("bvhrender: without a camera the whole scene is in the middle of the picture") {
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  for (const std::string size : {"160x120", "60x200", "300x40"}) {
    INFO(size);
    render_well({scene, "-o", folder / "a.exr", "--size", size, "--spp", "1"});
    const ExrFile file = read_exr(folder / "a.exr");
    std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
    std::size_t hits = 0, at_border = 0;
    for (std::uint32_t y = 0; y < file.height; ++y)
      for (std::uint32_t x = 0; x < file.width; ++x) {
        if (file.uint_at("id.primitive", x, y) == kInvalidId) continue;
        ++hits;
        seen.emplace(file.uint_at("id.geometry", x, y), file.uint_at("id.primitive", x, y));
        if (x == 0 || y == 0 || x + 1 == file.width || y + 1 == file.height) ++at_border;
      }
    CHECK(seen.size() == 4);
    CHECK(hits > 500);
    CHECK(at_border == 0);
  }
}

TEST_CASE("bvhrender: a camera by text, with negative numbers too, or by a .cam file") {
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  const auto picture = [&](const std::string& camera) {
    render_well({scene, "-o", folder / "a.exr", "--size", "32x24", "--spp", "1", "--camera", camera});
    return read_exr(folder / "a.exr");
  };
  const ExrFile text = picture("-1,0.5,-4/0,0,0.5/0,1,0/50");
  const std::string with_labels = folder.write("view.cam", "eye -1 0.5 -4 / at 0 0 0.5 / up 0 1 0 / fov 50\n");
  const std::string with_light =
      folder.write("view.txt", "eye -1 0.5 -4 / at 0 0 0.5 / up 0 1 0 / fov 50 / light 1 2 3\n");
  CHECK(text.at("N.Z", 16, 12) == -1.0f);
  CHECK(same_picture(text, picture(with_labels)));
  CHECK(same_picture(text, picture(with_light)));
  CHECK(same_picture(text, picture("eye -1 0.5 -4 / at 0 0 0.5 / up 0 1 0 / fov 50")));
  CHECK_FALSE(same_picture(text, picture("-1,0.5,-4/0,0,0.5/0,1,0/51")));
}

TEST_CASE("bvhrender: PNG and EXR of one run have the same size and colours") {
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  for (const std::string mode : {"ao", "primary", "normals", "heatmap"}) {
    INFO(mode);
    render_well({scene, "-o", folder / "a.exr", "-o", folder / "a.png", "--size", "260x70", "--mode", mode, "--spp",
                 "2", "--camera", kFront});
    const ExrFile exr = read_exr(folder / "a.exr");
    const PngFile png = read_png(folder / "a.png");
    REQUIRE((png.width == 260 && png.height == 70));
    REQUIRE((exr.width == 260 && exr.height == 70));
    float white = 1.0f;
    for (std::uint32_t y = 0; y < 70; ++y)
      for (std::uint32_t x = 0; x < 260; ++x)
        white = std::max(white, tools::luminance(vector_at(exr, {"R", "G", "B"}, x, y)));
    bool equal = true;
    for (std::uint32_t y = 0; y < 70; ++y)
      for (std::uint32_t x = 0; x < 260; ++x) {
        const Vec3 color = tools::reinhard(vector_at(exr, {"R", "G", "B"}, x, y), white);
        for (int i = 0; i < 3; ++i)
          equal = equal && png.at(x, y, static_cast<unsigned>(i)) == tools::srgb_byte(color[i]);
      }
    CHECK(equal);
  }
}

TEST_CASE("bvhrender: every mode draws its quantity") {
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  const auto picture = [&](const std::string& mode) {
    render_well({scene, "-o", folder / "a.png", "--size", "401x301", "--mode", mode, "--spp", "1", "--camera", kFront});
    return read_png(folder / "a.png");
  };
  const auto color = [](const PngFile& file, std::uint32_t x, std::uint32_t y) {
    return std::array{file.at(x, y, 0), file.at(x, y, 1), file.at(x, y, 2)};
  };
  // (0.5, 0.5, 1) of the normal (0, 0, 1), black where there is none.
  const PngFile normals = picture("normals");
  CHECK(color(normals, 200, 150) == std::array{128, 128, 255});
  CHECK(color(normals, 0, 0) == std::array{0, 0, 0});
  // Grey clay, darker where it is seen obliquely, before a blue backdrop that is darker above.
  const PngFile primary = picture("primary");
  CHECK(primary.at(200, 150, 0) > primary.at(200, 150, 2));
  CHECK(primary.at(200, 150, 0) > primary.at(110, 60, 0));
  CHECK(primary.at(0, 0, 2) > primary.at(0, 0, 0));
  CHECK(primary.at(0, 300, 1) > primary.at(0, 0, 1) + 20);
  const PngFile ao = picture("ao");
  CHECK(color(ao, 0, 0) == color(primary, 0, 0));
  CHECK(color(ao, 200, 150) != color(primary, 200, 150));
  // At the corner one box test, of the root's children, on a scale to 4. The legend at the bottom left has all colours.
  const PngFile heatmap = picture("heatmap");
  CHECK(color(heatmap, 400, 0) == std::array{59, 82, 139});
  bool has_highest = false;
  for (std::uint32_t y = 250; y < 301; ++y)
    for (std::uint32_t x = 0; x < 250; ++x)
      has_highest = has_highest || color(heatmap, x, y) == std::array{253, 231, 37};
  CHECK(has_highest);
}

TEST_CASE("bvhrender: the files do not depend on the number of threads; the seed counts") {
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  const auto bytes = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{scene, "-o", folder / name, "--size", "100x80", "--spp", "4"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    render_well(arguments);
    return read_file(folder / name);
  };
  for (const std::string name : {"a.exr", "a.png"}) {
    INFO(name);
    const std::string one = bytes(name, {"--threads", "1"});
    CHECK(bytes(name, {"--threads", "2"}) == one);
    CHECK(bytes(name, {"--threads", "5"}) == one);
    CHECK(bytes(name, {}) == one);
    CHECK(bytes(name, {"--seed", "1"}) != one);
  }
}

TEST_CASE("bvhrender: ao-distance lets distant surfaces cast no shadow") {
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  const auto shadow_at = [&](const std::string& distance) {
    render_well({scene, "-o", folder / "a.exr", "--size", "65x49", "--spp", "64", "--camera",
                 "0,0,4/0.75,0.75,0/0,1,0/5", "--ao-distance", distance});
    // Beside the picture's middle the back square is hidden; at its lower left corner it is seen.
    return read_exr(folder / "a.exr").at("G", 0, 48);
  };
  CHECK(shadow_at("0.4") > 1.01f * shadow_at("100"));
}

TEST_CASE("bvhrender: a scene without triangles gives a picture of the backdrop") {
  const TempFolder folder;
  const std::string scene = write_nothing(folder);
  for (const std::string mode : {"ao", "primary", "normals", "heatmap"}) {
    INFO(mode);
    render_well({scene, "-o", folder / "a.exr", "-o", folder / "a.png", "--mode", mode, "--size", "33x20"});
    CHECK(read_png(folder / "a.png").width == 33);
    const ExrFile file = read_exr(folder / "a.exr");
    for (const std::uint32_t id : file.uints.at("id.primitive")) CHECK(id == kInvalidId);
    for (const float depth : file.floats.at("Z")) CHECK(std::isinf(depth));
    for (const char* channel : {"R", "G", "B"})
      for (const float value : file.floats.at(channel)) CHECK((value >= 0.0f && value < 1.0f));
  }
}

TEST_CASE("bvhrender: --json reports the run; the default is a picture of 1024 x 768") {
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  const json small =
      json::parse(render_well({scene, "-o", folder / "a.exr", "-o", folder / "b.PNG", "--size", "20x10", "--spp", "2",
                               "--mode", "normals", "--seed", "7", "--threads", "2", "--camera", kFront, "--json"}));
  CHECK(small["file"] == scene);
  CHECK(small["outputs"].size() == 2);
  CHECK(small["outputs"][0]["path"] == (folder / "a.exr").string());
  CHECK(small["outputs"][0]["bytes"] == read_file(folder / "a.exr").size());
  CHECK(small["outputs"][1]["bytes"] == read_file(folder / "b.PNG").size());
  CHECK((small["width"] == 20 && small["height"] == 10));
  CHECK((small["spp"] == 2 && small["seed"] == 7 && small["mode"] == "normals" && small["threads"] == 2));
  CHECK(small["camera"] == kFront);
  CHECK(small["primary_rays"] == 20 * 10 * 3);
  CHECK(small["shadow_rays"] == 0);
  CHECK(small["seconds"] > 0);
  CHECK(small["mrays_per_second"] > 0);
  CHECK(small["instruction_set"].get<std::string>().size() > 2);
  const std::string text = render_well({scene, "-o", folder / "b.PNG", "--spp", "1"});
  CHECK_THAT(text, Contains("1024 x 768 pixels, 1 samples, ao") && Contains("Mrays/s") && Contains("b.PNG"));
  CHECK(read_png(folder / "b.PNG").height == 768);
}
