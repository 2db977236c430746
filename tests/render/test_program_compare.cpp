/// bvhrender --compare as a user runs it.

#include "read_images.h"
#include "renderer.h"

#include <tools/render/image/image_compare.h>
#include <tools/render/image/image_read.h>
#include <tools/render/image/image_write.h>

#include <nlohmann/json.hpp>

#include <algorithm>

using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

using Arguments = std::vector<std::string>;

/// A small picture of the squares, whose noise depends on the seed.
Arguments with(const std::string& scene, const Arguments& more) {
  Arguments arguments{scene, "--size", "48x36", "--camera", "1,1,4/0.3,0,0/0,1,0/40"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

/// A failure of one line that leaves only @p names in the folder.
void check_failure(const TempFolder& folder, int status, const Arguments& arguments, const std::string& word,
                   const std::vector<std::string>& names) {
  const CommandResult result = render(arguments);
  INFO(result.out << result.err);
  CHECK(result.status == status);
  CHECK_THAT(result.err, Catch::StartsWith("bvhrender: ") && Contains(word));
  CHECK(std::count(result.err.begin(), result.err.end(), '\n') == 1);
  CHECK(folder.names() == names);
}

}  // namespace

TEST_CASE("bvhrender --compare: the numbers are those of the two files, as JSON and as text") {
  const TempFolder folder;
  const std::string scene = write_squares(folder), reference = folder / "ref.exr", map = folder / "map.png";
  render_well(with(scene, {"-o", reference, "--spp", "64"}));
  const Arguments run = with(scene, {"-o", folder / "a.exr", "--spp", "1", "--compare", reference});
  Arguments with_json = run, with_map = run;
  with_json.push_back("--json");
  with_map.insert(with_map.end(), {"--json", "--difference", map});
  const json found = json::parse(render_well(with_map)).at("comparison");
  const auto picture = hiprt::tools::read_exr_colors(folder / "a.exr");
  const auto expected = hiprt::tools::compare(*picture, *hiprt::tools::read_exr_colors(reference));
  REQUIRE(expected.has_value());
  CHECK(expected->flip > 0.0);
  CHECK(found.at("mse") == expected->mse);
  CHECK(found.at("relative_mse") == expected->relative_mse);
  CHECK(found.at("psnr") == expected->psnr);
  CHECK(found.at("flip") == expected->flip);
  CHECK(found.at("reference") == reference);
  CHECK(found.at("difference").at("path") == map);
  CHECK(found.at("difference").at("bytes") == std::filesystem::file_size(map));
  // The map, encoded as any picture is.
  REQUIRE(hiprt::tools::write_png(folder / "expected.png", flip_picture(*expected)));
  CHECK(read_file(map) == read_file(folder / "expected.png"));
  const json without_map = json::parse(render_well(with_json)).at("comparison");
  CHECK(without_map.at("difference").is_null());
  CHECK(without_map.at("flip") == found.at("flip"));
  CHECK_THAT(render_well(run), Contains("against " + reference + ": MSE ") && Contains("relative MSE ") &&
                                   Contains("PSNR ") && Contains(" dB, FLIP 0."));
}

TEST_CASE(
    "bvhrender --compare: equal pictures differ by 0, more samples by less; without it no difference is printed") {
  const TempFolder folder;
  const std::string scene = write_squares(folder), reference = folder / "ref.exr";
  render_well(with(scene, {"-o", reference, "--spp", "256", "--seed", "7"}));
  const auto comparison = [&](const std::string& samples, const std::string& seed) {
    return json::parse(render_well(with(scene, {"-o", folder / "a.png", "--spp", samples, "--seed", seed, "--compare",
                                                reference, "--json"})))
        .at("comparison");
  };
  const json same = comparison("256", "7"), near = comparison("64", "1"), far = comparison("1", "1");
  CHECK((same.at("mse") == 0.0 && same.at("relative_mse") == 0.0 && same.at("flip") == 0.0));
  CHECK(same.at("psnr").is_null());
  CHECK((near.at("mse") > 0.0 && near.at("mse") < far.at("mse") && near.at("relative_mse") < far.at("relative_mse")));
  CHECK((near.at("psnr") > far.at("psnr") && near.at("flip") < far.at("flip")));
  CHECK_THAT(render_well(with(scene, {"-o", folder / "a.png", "--spp", "256", "--seed", "7", "--compare", reference})),
             Contains("MSE 0.000e+00, relative MSE 0.000e+00, PSNR infinite, FLIP 0.0000\n"));
  const Arguments alone = with(scene, {"-o", folder / "a.png", "--spp", "1"});
  CHECK_THAT(render_well(alone), !Contains("against"));
  Arguments as_json = alone;
  as_json.push_back("--json");
  CHECK(json::parse(render_well(as_json)).at("comparison").is_null());
}

TEST_CASE("bvhrender --compare: bad usage is status 2") {
  const TempFolder folder;
  check_failure(folder, 2, {"none.bvh", "-o", "a.png", "--difference", "d.png"}, "--difference", {});
  check_failure(folder, 2, {"none.bvh", "-o", "a.png", "--compare", "r.exr", "--difference", "d.exr"},
                "does not end in .png", {});
  check_failure(folder, 2, {"none.bvh", "-o", "a.png", "--compare"}, "--compare", {});
  CHECK_THAT(render_well({"--help"}), Contains("--compare") && Contains("--difference"));
}

TEST_CASE("bvhrender --compare: an invalid reference is a failure before any ray is traced") {
  const TempFolder folder;
  const std::string scene = write_squares(folder), reference = folder / "ref.exr", picture = folder / "a.png";
  render_well({scene, "-o", reference, "--size", "40x30", "--spp", "1"});
  const std::vector<std::string> names{"bad.exr", "ref.exr", "s.bvh"};
  const std::string whole = read_file(reference);
  const std::string bad = folder.write("bad.exr", whole.substr(0, whole.size() / 2));
  // Hours of work, which a failure must not wait for.
  const auto refuses = [&](const std::string& path, const std::string& word, const Arguments& more = {}) {
    Arguments arguments = with(scene, {"-o", picture, "--spp", "65536", "--compare", path});
    arguments.insert(arguments.end(), more.begin(), more.end());
    check_failure(folder, 1, arguments, word, names);
  };
  refuses(folder / "none.exr", "none.exr");
  refuses(folder.path(), "directory");
  refuses(scene, "s.bvh: not an OpenEXR file");
  refuses(bad, "bad.exr: damaged: ");
  refuses(reference, "ref.exr: 40 x 30 pixels, the picture 48 x 36");
  refuses(reference, "no/such/d.png", {"--difference", folder / "no/such/d.png"});
  hiprt::tools::Image odd(48, 36);
  odd.at(5, 6).color.y = std::numeric_limits<float>::quiet_NaN();
  REQUIRE(hiprt::tools::write_exr(bad, odd, {}));
  refuses(bad, "bad.exr: channel G of pixel 5, 6 is not finite");
}

TEST_CASE("bvhrender --compare: no file is both input and output") {
  const TempFolder folder;
  const std::string scene = write_squares(folder, "scene.png"), reference = folder / "ref.exr";
  render_well(with(scene, {"-o", reference, "--spp", "1"}));
  const std::string bytes = read_file(reference), scene_bytes = read_file(scene);
  const std::vector<std::string> names{"ref.exr", "scene.png"};
  const auto refuses = [&](const Arguments& more, const std::string& word) {
    Arguments arguments = with(scene, {"--spp", "1", "--compare", reference});
    arguments.insert(arguments.end(), more.begin(), more.end());
    check_failure(folder, 1, arguments, word, names);
  };
  refuses({"-o", reference}, "one of the inputs");
  refuses({"-o", folder / "a.png", "--difference", scene}, "one of the inputs");
  refuses({"-o", folder / "a.png", "--difference", folder / "a.png"}, "both the picture and its --difference");
  refuses({"-o", folder / "a.png", "--difference", folder / "./a.png"}, "both the picture and its --difference");
  CHECK(read_file(reference) == bytes);
  CHECK(read_file(scene) == scene_bytes);
}
