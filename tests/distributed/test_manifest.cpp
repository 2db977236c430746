// Manifests with faults: each error says where and what was expected.

#include <tests/catch.h>
#include <tests/tools/temp_folder.h>
#include <tools/farm/manifest.h>

using namespace hiprt;
using namespace hiprt::tools;

namespace {

/// @return the error of a manifest with these assets.
std::string fault_of(const std::string& assets) {
  const auto result =
      parse_manifest(R"({"format": "hiprt assets", "version": 1, "assets": )" + assets + "}", "/m/assets.json");
  return result ? std::string() : result.error().message;
}

void check_fault(const std::string& assets, const std::string& expected) {
  CHECK(fault_of(assets) == "/m/assets.json: " + expected);
}

}  // namespace

TEST_CASE("manifest: files, and options that replace those of the command line") {
  const auto assets = parse_manifest(R"({"format": "hiprt assets", "version": 1, "assets": [
      {"name": "a", "files": ["a.obj", "/b.hair"]}, {"name": "b", "files": ["x/b.ply"],
       "builder": "lbvh", "target": "amd"},
      {"name": "c", "files": ["c.ply"], "quality": "high", "nodes": "half"}]})",
                                     "/m/assets.json");
  REQUIRE(assets);
  REQUIRE(assets->size() == 3);
  CHECK((*assets)[0].meshes == std::vector<std::string>{"/m/a.obj"});
  CHECK((*assets)[0].shapes == std::vector<std::string>{"/b.hair"});
  CHECK((*assets)[1].meshes == std::vector<std::string>{"/m/x/b.ply"});
  BuildCommand defaults;
  defaults.quality = "fast";
  defaults.nodes = "quantized";
  CHECK((*assets)[0].command(defaults).quality == "fast");
  const BuildCommand second = (*assets)[1].command(defaults), third = (*assets)[2].command(defaults);
  CHECK(second.quality.empty());
  CHECK(second.builder == "lbvh");
  CHECK(second.nodes == "auto");
  CHECK(third.quality == "high");
  CHECK(third.nodes == "half");
}

TEST_CASE("manifest: every fault is named with its location") {
  check_fault("7", "assets: 7, an array expected");
  check_fault("[7]", "assets[0]: 7, an object expected");
  check_fault(R"([{"files": ["a"]}])", "assets[0]: 'name' is missing");
  check_fault(R"([{"name": "a"}])", "assets[0]: 'files' is missing");
  check_fault(R"([{"name": "", "files": ["a"]}])", "assets[0].name: the name is empty");
  check_fault(R"([{"name": "a", "files": []}])", "assets[0].files: there is no file in it; an asset has one or more");
  check_fault(R"([{"name": "a", "files": ["a", 3]}])", "assets[0].files[1]: 3, a string expected");
  check_fault(R"([{"name": "a", "files": ["a"], "size": 3}])",
              "assets[0]: unknown key 'size'; known keys: name, files, quality, builder, target, nodes");
  check_fault(R"([{"name": "a", "files": ["a"], "quality": "best"}])",
              "assets[0].quality: 'best' is unknown; expected one of fast, balanced, high");
  check_fault(R"([{"name": "a", "files": ["a"], "quality": "high", "builder": "hq"}])",
              "assets[0]: has both 'quality' and 'builder'");
  check_fault(R"([{"name": "a", "files": ["a"]}, {"name": "a", "files": ["b"]}])",
              "assets[1].name: 'a' is also the name of assets[0]; names tell assets apart");
  CHECK_THAT(fault_of(R"([{"name": "a", "files": ["a.json"]}])"),
             Catch::Contains("assets[0].files[0]: 'a.json' is a scene"));
  CHECK_THAT(fault_of(R"([{"name": "a", "name": "b", "files": ["a"]}])"), Catch::Contains("name"));
  CHECK_THAT(fault_of("["), Catch::Contains("/m/assets.json: "));
  const auto other = parse_manifest(R"({"format": "hiprt scene", "version": 1, "assets": []})", "m");
  REQUIRE_FALSE(other);
  CHECK(other.error().message == "m: format: 'hiprt scene'; expected 'hiprt assets'");
  const auto later = parse_manifest(R"({"format": "hiprt assets", "version": 2, "assets": []})", "m");
  REQUIRE_FALSE(later);
  CHECK(later.error().message == "m: version: 2; this bvhbuild reads version 1");
}

TEST_CASE("manifest: a file that is not there is named with its asset") {
  const test::TempFolder folder;
  folder.write("a.obj", "1234");
  std::vector<Asset> assets(2);
  assets[0].meshes = {(folder / "a.obj").string()};
  REQUIRE(measure_assets(assets, "m.json"));
  CHECK(assets[0].cost == 4);
  assets[1].shapes = {(folder / "b.hair").string()};
  const auto missing = measure_assets(assets, "m.json");
  REQUIRE_FALSE(missing);
  CHECK_THAT(missing.error().message,
             Catch::Contains("m.json: assets[1].files: cannot open") && Catch::Contains("No such file"));
}
