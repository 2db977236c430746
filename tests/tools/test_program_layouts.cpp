/// bvhbuild and bvhinfo on every layout, and bvhinfo on custom primitives.

#include <tests/tools/importers/gltf_builder.h>
#include "json_result.h"
#include "programs.h"

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <hiprt_device/format/buffer.h>

#include <tests/catch.h>
#include <nlohmann/json.hpp>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

/// Records of a dump with the given key ("node", "leaf").
std::vector<json> dumped(const std::string& bvh, const char* key) {
  const CommandResult dump = run({kBvhInfo, bvh, "--dump", "--json"});
  REQUIRE(dump.status == 0);
  std::vector<json> records;
  std::istringstream lines(dump.out);
  for (std::string line; std::getline(lines, line);)
    if (json record = json::parse(line); record.contains(key)) records.push_back(std::move(record));
  return records;
}

/// A square and a custom geometry of type 9 with four primitives, one of them dropped.
std::string write_custom(const TempFolder& folder) {
  const std::vector<build::Position> positions{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const std::vector<build::Triangle> triangles{{0, 1, 2}, {0, 2, 3}};
  const std::vector<Box> boxes{
      {{5, 0, 0}, {6, 1, 1}}, {{6, 0, 0}, {7, 1, 1}}, {{1, 0, 0}, {0, 1, 1}}, {{50, 0, 0}, {51, 1, 1}}};
  const std::vector<build::TriangleMesh> meshes{{positions, triangles}};
  const std::vector<build::CustomGeometry> customs{{boxes, 9}};
  const auto bvh = build::build(build::SceneInput{meshes, customs});
  REQUIRE(bvh.has_value());
  REQUIRE(build::write_file(folder / "c.bvh", bvh->buffer.bytes()).has_value());
  return folder / "c.bvh";
}

}  // namespace

TEST_CASE("Programs: every layout is built, described and dumped") {
  const TempFolder folder;
  const std::string mesh = folder.write("a.obj", grid_obj(16)), bvh = folder / "a.bvh";
  std::vector<json> leaves;
  for (const std::string layout : {"float", "planes", "half", "quantized"}) {
    INFO(layout);
    const json built = json_of(run({kBvhBuild, mesh, "-o", bvh, "--nodes", layout, "--json"}));
    const json info = json_of(run({kBvhInfo, "--validate", bvh, "--json"}));
    CHECK(built["layout"] == layout);
    CHECK(info["layout"] == layout);
    CHECK(info["version"] == json{kVersionMajor, kVersionMinor});
    CHECK(info["provenance"]["options"]["nodes"] == layout);
    // Nodes of planes have gaps: there are more than 64.
    CHECK(info["sections"][0]["stride"] == (layout == "float" ? 128 : 64));
    CHECK(info["tree"] == built["tree"]);
    CHECK(info["bytes_per_triangle"].get<double>() == built["bytes_per_triangle"].get<double>());
    const std::vector<json> nodes = dumped(bvh, "node");
    CHECK(nodes.size() == info["tree"]["nodes"]);
    for (const json& node : nodes)
      for (const json& child : node["children"]) CHECK(child["min"][0].get<double>() <= child["max"][0].get<double>());
    const std::vector<json> other = dumped(bvh, "leaf");
    if (leaves.empty()) leaves = other;
    REQUIRE(other.size() == leaves.size());
    for (std::size_t i = 0; i < leaves.size(); ++i) CHECK(other[i]["triangles"] == leaves[i]["triangles"]);
    const CommandResult text = run({kBvhInfo, bvh});
    CHECK_THAT(text.out, Contains("layout               " + layout) && Contains("bytes per triangle"));
  }
}

TEST_CASE("Programs: half nodes with infinite planes are dumped with the file's bounds") {
  const TempFolder folder;
  const std::string mesh = folder.write(
                        "a.obj", "v 0 0 0\nv 1e6 0 0\nv 0 1 0\nv 2e6 0 9\nv 3e6 0 9\nv 2e6 1 9\nf 1 2 3\nf 4 5 6\n"),
                    bvh = folder / "a.bvh";
  REQUIRE(run({kBvhBuild, mesh, "-o", bvh, "--nodes", "half", "--max-leaf", "1"}).status == 0);
  const std::vector<json> nodes = dumped(bvh, "node");
  REQUIRE(nodes.size() == 1);
  for (const json& child : nodes[0]["children"]) CHECK(child["max"][0] == 3e6);
}

TEST_CASE("Programs: coordinates that quantized nodes cannot hold are an error with the file's name") {
  const TempFolder folder;
  const std::string mesh = folder.write("far.obj", "v 0 0 0\nv 1e38 0 0\nv 0 1 0\nf 1 2 3\n");
  const CommandResult refused = run({kBvhBuild, mesh, "-o", folder / "a.bvh", "--nodes", "quantized"});
  CHECK(refused.status == 1);
  CHECK_THAT(refused.err, Contains("far.obj") && Contains("2^126") && Contains("float, planes and half"));
  CHECK(folder.names() == std::vector<std::string>{"far.obj"});
  CHECK(run({kBvhBuild, mesh, "-o", folder / "a.bvh", "--nodes", "half"}).status == 0);
}

TEST_CASE("Programs: custom primitives are refused on every device") {
  const TempFolder folder;
  const std::string bvh = write_custom(folder), rays = folder.write("none.rays", "");
  for (const std::string device : {"cpu", "auto", "gpu"}) {
    INFO(device);
    const CommandResult refused =
        run({kBvhTrace, bvh, "--rays", rays, "--hits", folder / "a.hits", "--device", device});
    CHECK(refused.status == 1);
    CHECK_THAT(refused.err, Contains("c.bvh: has custom primitives"));
  }
  CHECK(folder.names() == std::vector<std::string>{"c.bvh", "none.rays"});
}

TEST_CASE("Programs: bvhinfo reports custom primitives") {
  const TempFolder folder;
  const std::string bvh = write_custom(folder);
  const json info = json_of(run({kBvhInfo, "--validate", bvh, "--json"}));
  CHECK(info["features"] == json::parse(R"(["triangles", "custom primitives"])"));
  CHECK(info["triangles"] == 2);
  CHECK(info["customs"] == 4);
  CHECK(info["geometries"][0]["triangles"] == 2);
  CHECK(info["geometries"][1]["customs"] == 4);
  CHECK(info["geometries"][1]["type"] == 9);
  CHECK(info["geometries"][1]["dropped"] == 1);
  CHECK(info["tree"]["leaf_customs"] == 3);
  CHECK(info["tree"]["custom_leaves"] == 2);
  CHECK(info["tree"]["leaf_triangles"] == 2);
  const CommandResult text = run({kBvhInfo, bvh});
  CHECK_THAT(text.out, Contains("custom primitives    4") && Contains("4 custom primitives of type 9, 1 dropped") &&
                           Contains("2 with 3 primitives") && Contains("bytes per primitive"));
  const std::vector<json> leaves = dumped(bvh, "customs");
  REQUIRE(leaves.size() == 2);
  CHECK(leaves[0]["geometry"] == 1);
  CHECK(leaves[0]["customs"] == json::parse(R"([{"primitive": 0, "min": [5, 0, 0], "max": [6, 1, 1]},
                                                {"primitive": 1, "min": [6, 0, 0], "max": [7, 1, 1]}])"));
  CHECK_THAT(run({kBvhInfo, bvh, "--dump"}).out, Contains("custom primitive 3 (50 0 0) - (51 1 1)"));
}
