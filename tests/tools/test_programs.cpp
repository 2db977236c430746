/// The programs end to end: files in, files out, and nothing left behind when something is wrong.

#include <tests/tools/importers/gltf_builder.h>
#include "json_result.h"
#include "programs.h"

#include <tools/scene_io/rays_file.h>

#include <tests/catch.h>
#include <tests/oracle/builders.h>
#include <nlohmann/json.hpp>

#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

Ray down(float x, float y) {
  Ray ray;
  ray.origin = {x, y, 10};
  ray.direction = {0, 0, -2};
  return ray;
}

/// 100 by 100 rays down to a grid, beside all edges, where all triangle tests agree.
std::vector<Ray> rays_beside_edges() {
  std::vector<Ray> rays;
  for (unsigned row = 0; row < 100; ++row)
    for (unsigned column = 0; column < 100; ++column)
      rays.push_back(
          down(static_cast<float>(column) * 0.17f - 0.4f + 0.003f, static_cast<float>(row) * 0.17f + 0.0011f));
  return rays;
}

}  // namespace

TEST_CASE("Programs: meshes to BVH to hits, with primitive numbers that continue over the geometries") {
  const TempFolder folder;
  const std::string bvh = folder / "s.bvh", rays = folder / "r.rays", hits = folder / "r.hits";
  const std::string low = folder.write("low.obj", grid_obj(8)), high = folder.write("high.obj", grid_obj(2, 4));
  const std::vector<std::string> modes[] = {
      {"--nodes", "float"}, {"--nodes", "planes"}, {"--builder", build::name(oracle::kEmbreeHigh)},
      {"--no-pairs"},       {"--max-leaf", "1"},   {"--target", "amd"}};
  std::vector<Ray> batch{down(0.75f, 0.25f), down(1.25f, 1.75f), down(7.75f, 7.5f), down(-1, 0), down(3.75f, 0.25f)};
  batch[4].tmax = 4.5f;  // In lengths of the direction, 2: the plane z = 0 is at t = 5.
  REQUIRE(tools::write_rays(rays, false, batch));
  for (const auto& mode : modes) {
    INFO(mode.front());
    std::vector<std::string> command{kBvhBuild, low, high, "-o", bvh};
    command.insert(command.end(), mode.begin(), mode.end());
    check_quiet(run(command));
    CHECK(run({kBvhInfo, "--validate", bvh}).status == 0);
    const CommandResult traced = run({kBvhTrace, bvh, "--rays", rays, "--hits", hits});
    REQUIRE(traced.status == 0);
    CHECK(traced.err.empty());
    CHECK_THAT(traced.out, Contains("5 rays, 3 hits") && Contains("Mrays/s"));
    const auto records = tools::read_hits(hits);
    REQUIRE(records);
    REQUIRE(records->size() == 5);
    const float inf = std::numeric_limits<float>::infinity();
    const tools::HitRecord expected[] = {{3, 128}, {3, 128 + 7}, {5, 126}, {inf, kInvalidId}, {inf, kInvalidId}};
    for (std::size_t i = 0; i < 5; ++i) {
      INFO("ray " << i);
      CHECK((*records)[i].primitive == expected[i].primitive);
      CHECK((*records)[i].t == expected[i].t);
    }
  }
  CHECK(folder.names() == std::vector<std::string>{"high.obj", "low.obj", "r.hits", "r.rays", "s.bvh"});
}

TEST_CASE("Programs: --target amd widens boxes by the margin that bvhinfo shows, and hits stay the same") {
  const TempFolder folder;
  const std::string obj = folder.write("a.obj", grid_obj(16)), bvh = folder / "s.bvh", rays = folder / "r.rays",
                    hits = folder / "r.hits";
  REQUIRE(tools::write_rays(rays, false, rays_beside_edges()));
  const auto built = [&](std::vector<std::string> choices) {
    choices.insert(choices.begin(), {kBvhBuild, obj, "-o", bvh});
    check_quiet(run(choices));
    return json_of(run({kBvhInfo, "--validate", bvh, "--json"}));
  };
  const auto traced = [&] {
    check_good(run({kBvhTrace, bvh, "--rays", rays, "--hits", hits}));
    return tools::read_hits(hits).value();
  };
  for (const std::string layout : {"float", "half"}) {
    INFO(layout);
    const json plain = built({"--nodes", layout});
    const auto expected = traced();
    const json wide = built({"--nodes", layout, "--target", "amd"});
    const auto found = traced();
    CHECK(plain["box_margin"] == 0);
    CHECK(plain["features"] == json::parse(R"(["triangles"])"));
    CHECK(wide["features"] == json::parse(R"(["triangles", "widened boxes"])"));
    // Nodes, leaves and maps take the same bytes. The provenance says "true" instead of "false".
    CHECK(wide["bytes"].get<int>() == plain["bytes"].get<int>() - 1);
    const double margin = wide["box_margin"].get<double>();
    // The proof's constants: reach 3 * 16, magnitude 2 * 16 + 2 * 16.
    CHECK(margin == Approx(std::ldexp(28.0 * 48 + 8 * 64, -24)));
    const double low = wide["bounds"]["min"][0].get<double>(), high = wide["bounds"]["max"][0].get<double>();
    CHECK(low <= -margin);
    CHECK(high >= 16 + margin * 0.5);
    REQUIRE(found.size() == expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      CHECK(found[i].primitive == expected[i].primitive);
      CHECK(found[i].t == expected[i].t);
    }
  }
  for (const std::string layout : {"planes", "quantized"})
    CHECK(built({"--nodes", layout, "--target", "amd"})["box_margin"] == 0);
  CHECK(built({"--target", "amd"})["layout"] == "float");
}

TEST_CASE("Programs: --quality gives the tree of its builder, and other options still apply") {
  const TempFolder folder;
  const std::string obj = folder.write("a.obj", grid_obj(16)), bvh = folder / "s.bvh";
  const auto report = [&](std::vector<std::string> choices) {
    choices.insert(choices.begin(), {kBvhBuild, obj, "-o", bvh, "--json"});
    json result = json_of(run(choices));
    for (const char* key : {"seconds", "mtriangles_per_second", "peak_bytes"}) result.erase(key);
    return result;
  };
  for (const auto& [word, builder] :
       {std::pair("fast", "lbvh"), std::pair("balanced", "sbvh"), std::pair("high", "hq")}) {
    const json chosen = report({"--quality", word});
    CHECK(chosen["builder"] == builder);
    CHECK(chosen == report({"--builder", builder}));
  }
  CHECK(report({"--quality", "high", "--reinsertion-rounds", "0"}) ==
        report({"--builder", "hq", "--reinsertion-rounds", "0"}));
  CHECK(report({"--quality", "high", "--split-budget", "auto"}) == report({"--quality", "high"}));
}

TEST_CASE("Programs: every choice of bvhtrace gives the same hits; any-hit finds some") {
  const TempFolder folder;
  const std::string bvh = folder / "s.bvh", rays = folder / "r.rays", hits = folder / "r.hits";
  check_quiet(run({kBvhBuild, folder.write("a.obj", grid_obj(16)), "-o", bvh}));
  REQUIRE(tools::write_rays(rays, true, rays_beside_edges()));
  const auto trace = [&](std::vector<std::string> choices) {
    choices.insert(choices.begin(), {kBvhTrace, bvh, "--rays", rays, "--hits", hits, "--json"});
    return json_of(run(choices));
  };
  const auto primitives = [&] {
    std::vector<std::uint32_t> result;
    const auto records = tools::read_hits(hits);
    REQUIRE(records);
    for (const tools::HitRecord& hit : *records) result.push_back(hit.primitive);
    return result;
  };
  const json first = trace({"--query", "closest", "--threads", "1"});
  const auto first_primitives = primitives();
  CHECK(first["query"] == "closest");
  CHECK(first["rays"] == 10000);
  CHECK(first["hits"] > 5000);
  for (const std::vector<std::string>& choices :
       {std::vector<std::string>{"--threads", "2"},
        {"--triangle-test", "fast"},
        {"--triangle-test", "reference"},
        {"--box-test", "plain"},
        {"--triangle-test", "fast", "--box-test", "plain", "--repeat", "3"}}) {
    std::vector<std::string> all{"--query", "closest"};
    all.insert(all.end(), choices.begin(), choices.end());
    const json other = trace(all);
    CHECK(primitives() == first_primitives);
    CHECK(other["seconds"].size() == (choices.size() > 2 ? 3 : 1));
  }
  const json any = trace({});  // The flag of the ray file says any.
  CHECK(any["query"] == "any");
  CHECK(any["hits"] == first["hits"]);
  CHECK(any["mrays_per_second"] > 0);
}

TEST_CASE("Programs: the file does not depend on the number of threads") {
  const TempFolder folder;
  const std::string mesh = folder.write("a.obj", grid_obj(150) + "v nan 0 0\nf 1 2 22802\n");
  const auto build = [&](const std::string& name, const std::string& threads) {
    CHECK(run({kBvhBuild, mesh, "-o", folder / name, "--threads", threads}).status == 0);
    return read_file(folder / name);
  };
  const std::string one = build("1.bvh", "1");
  CHECK(build("2.bvh", "2") == one);
  CHECK(build("7.bvh", "7") == one);
  CHECK(build("0.bvh", "0") == one);
}

TEST_CASE("Programs: bvhbuild reports dropped triangles and skipped faces on stderr") {
  const TempFolder folder;
  const std::string obj = grid_obj(2) + "v nan 0 0\nf 1 2 10\nf 1 1 2\nf 3 4\n";
  const CommandResult result = run({kBvhBuild, folder.write("a.obj", obj), "-o", folder / "a.bvh"});
  CHECK(result.status == 0);
  CHECK(result.out.empty());
  CHECK_THAT(result.err, Contains("dropped 2 of 10 triangles: 1 with a corner that is not finite, 1 with two corners"));
  CHECK_THAT(result.err, Contains("skipped 1 faces"));
  CHECK(run({kBvhInfo, "--validate", folder / "a.bvh"}).status == 0);
}

TEST_CASE("Programs: --stats and --json report the same figures") {
  const TempFolder folder;
  const std::string mesh = folder.write("a.obj", grid_obj(16)), bvh = folder / "a.bvh";
  const CommandResult text = run({kBvhBuild, mesh, "-o", bvh, "--stats"});
  CHECK(text.status == 0);
  for (const char* label : {"triangles", "dropped", "pairs", "nodes", "leaves", "SAH cost", "bytes per triangle",
                            "time to build", "Mtriangles/s", "peak memory"})
    CHECK_THAT(text.out, Contains(label));
  const json built = json_of(run({kBvhBuild, mesh, "-o", bvh, "--json"}));
  const json info = json_of(run({kBvhInfo, bvh, "--json"}));
  CHECK(built["triangles"] == 512);
  CHECK(built["layout"] == "planes");
  CHECK(built["bytes"] == read_file(bvh).size());
  CHECK(info["bytes"] == built["bytes"]);
  CHECK(info["triangles"] == 512);
  CHECK(info["valid"] == true);
  CHECK(info["tree"] == built["tree"]);
  CHECK(info["tree"]["leaf_triangles"] == 512);
  CHECK(info["tree"]["sah_cost"] > 1);
  CHECK(info["geometries"].size() == 1);
  CHECK(info["provenance"].is_object());
  const CommandResult plain = run({kBvhInfo, bvh});
  CHECK(plain.status == 0);
  for (const char* label : {"layout", "depth", "stack bound", "sibling overlap", "provenance", "geometry 0"})
    CHECK_THAT(plain.out, Contains(label));
}

TEST_CASE("Programs: bvhinfo --dump lists every node and every triangle") {
  const TempFolder folder;
  const std::string bvh = folder / "a.bvh";
  check_quiet(run({kBvhBuild, folder.write("a.obj", grid_obj(4)), "-o", bvh}));
  const json info = json_of(run({kBvhInfo, bvh, "--json"}));
  const CommandResult dump = run({kBvhInfo, bvh, "--dump", "--json"});
  REQUIRE(dump.status == 0);
  std::size_t nodes = 0, leaves = 0;
  std::vector<json> corners(32);
  std::istringstream lines(dump.out);
  for (std::string line; std::getline(lines, line);) {
    const json record = json::parse(line);
    nodes += record.contains("node") ? 1 : 0;
    leaves += record.contains("leaf") ? 1 : 0;
    if (!record.contains("leaf")) continue;
    for (const json& triangle : record["triangles"]) corners.at(triangle["primitive"]) = triangle["corners"];
  }
  CHECK(nodes == info["tree"]["nodes"]);
  CHECK(leaves == info["tree"]["leaves"]);
  // Triangle 2 of the grid: corners 1, 2 and 7 of rows of five.
  CHECK(corners[2] == json::parse("[[1, 0, 0], [2, 0, 0], [2, 1, 0]]"));
  CHECK(corners[3] == json::parse("[[1, 0, 0], [2, 1, 0], [1, 1, 0]]"));
  const CommandResult text = run({kBvhInfo, bvh, "--dump"});
  CHECK(text.status == 0);
  CHECK_THAT(text.out, Contains("primitive 2 (1 0 0) (2 0 0) (2 1 0)"));
}

TEST_CASE("Programs: inputs without triangles give an empty scene that can be traced") {
  const TempFolder folder;
  const std::string bvh = folder / "e.bvh", rays = folder / "r.rays", hits = folder / "r.hits";
  const CommandResult built = run({kBvhBuild, folder.write("e.obj", "v 0 0 0\n"), "-o", bvh});
  CHECK(built.status == 0);
  CHECK_THAT(built.err, Contains("e.obj: no triangles"));
  CHECK(run({kBvhInfo, "--validate", bvh}).status == 0);
  REQUIRE(tools::write_rays(rays, false, std::vector<Ray>{down(0, 0)}));
  CHECK_THAT(run({kBvhTrace, bvh, "--rays", rays, "--hits", hits}).out, Contains("1 rays, 0 hits"));
}

TEST_CASE("Programs: bvhbuild fails on bad input with status 1, names it and leaves no file") {
  const TempFolder folder;
  const std::string good = folder.write("a.obj", grid_obj(2)), out = folder / "out.bvh";
  const auto fails = [&](const std::string& name, const std::string& content, const std::string& word) {
    const std::string bad = folder.write(name, content);
    INFO(name);
    check_failure(folder, {kBvhBuild, good, bad, "-o", out}, word, {"a.obj", name});
    std::filesystem::remove(bad);
  };
  fails("empty.obj", "", "empty.obj");
  fails("text.xyz", "hello", "text.xyz");
  fails("huge.obj", "v 0 0 0\nf 1 1 4294967297\n", "4294967297");
  fails("cut.ply", "ply\nformat ascii 1.0\n", "cut.ply");
  fails("cut.mesh", "1234567", "cut.mesh");
  fails("bad.gltf", "{", "bad.gltf");
  check_failure(folder, {kBvhBuild, folder / "none.obj", "-o", out}, "none.obj", {"a.obj"});
  check_failure(folder, {kBvhBuild, folder.path(), "-o", out}, "directory", {"a.obj"});
}

TEST_CASE("Programs: outputs that cannot be written are failures and leave no file") {
  const TempFolder folder;
  const std::string mesh = folder.write("a.obj", grid_obj(2)), text = read_file(mesh);
  check_failure(folder, {kBvhBuild, mesh, "-o", folder / "no/such/out.bvh"}, "out.bvh", {"a.obj"});
  check_failure(folder, {kBvhBuild, mesh, "-o", "/proc/out.bvh"}, "/proc/out.bvh", {"a.obj"});
  check_failure(folder, {kBvhBuild, mesh, "-o", mesh}, "one of the inputs", {"a.obj"});
  CHECK(read_file(mesh) == text);
  // Known before the work: the input is not even looked for.
  check_failure(folder, {kBvhBuild, folder / "none.obj", "-o", folder / "no/out.bvh"}, "there is no folder", {"a.obj"});
  std::filesystem::create_directory(folder / "folder");
  check_failure(folder, {kBvhBuild, mesh, "-o", folder / "folder"}, "folder", {"a.obj", "folder"});
  CHECK(std::filesystem::is_empty(folder / "folder"));
  check_quiet(run({kBvhBuild, mesh, "-o", folder / "a.bvh"}));
  REQUIRE(tools::write_rays(folder / "r.rays", false, std::vector<Ray>{down(0, 0)}));
  check_failure(folder, {kBvhTrace, folder / "a.bvh", "--rays", folder / "r.rays", "--hits", folder / "folder"},
                "folder", {"a.bvh", "a.obj", "folder", "r.rays"});
  for (const std::string input : {"a.bvh", "r.rays"}) {
    const std::string before = read_file(folder / input);
    check_failure(folder, {kBvhTrace, folder / "a.bvh", "--rays", folder / "r.rays", "--hits", folder / input},
                  "one of the inputs", {"a.bvh", "a.obj", "folder", "r.rays"});
    CHECK(read_file(folder / input) == before);
  }
}

TEST_CASE("Programs: bvhbuild does not replace the buffer of its own glTF") {
  const TempFolder folder;
  GltfBuilder b;
  b.json["nodes"] = {{{"mesh", b.add_mesh(b.add_positions({0, 0, 3, 4, 0, 3, 0, 4, 3}))}}};
  b.json["scenes"] = {{{"nodes", {0}}}};
  const std::string scene = folder.write("scene.gltf", b.with_external_buffer("scene.bin"));
  folder.write("scene.bin", b.buffer);
  check_failure(folder, {kBvhBuild, scene, "-o", folder / "scene.bin"}, "one of the inputs",
                {"scene.bin", "scene.gltf"});
  CHECK(read_file(folder / "scene.bin") == b.buffer);
}

TEST_CASE("Programs: a file may have any name") {
  const TempFolder folder;
  folder.write("[a,b]",
               "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
               "endsolid a\n");
  const std::string script = "cd '" + folder.path().string() + "' && '" + kBvhBuild + "' '[a,b]' -o '[x].bvh' && '" +
                             kBvhInfo + "' --validate '[x].bvh'";
  CHECK(run({"/bin/sh", "-c", script}).status == 0);
}

TEST_CASE("Programs: bvhinfo and bvhtrace refuse damaged files") {
  const TempFolder folder;
  check_quiet(run({kBvhBuild, folder.write("a.obj", grid_obj(8)), "-o", folder / "a.bvh"}));
  const std::string whole = read_file(folder / "a.bvh");
  REQUIRE(tools::write_rays(folder / "r.rays", false, std::vector<Ray>{down(0, 0)}));
  const std::vector<std::string> names{"a.bvh", "a.obj", "bad.bvh", "r.rays"};
  const auto refused_everywhere = [&](const std::string& bytes, const std::string& word) {
    const std::string bad = folder.write("bad.bvh", bytes);
    check_failure(folder, {kBvhInfo, bad, "--validate"}, word, names);
    check_failure(folder, {kBvhInfo, bad, "--dump"}, word, names);
    check_failure(folder, {kBvhTrace, bad, "--rays", folder / "r.rays", "--hits", folder / "h.hits"}, word, names);
  };
  refused_everywhere("", "empty");
  refused_everywhere("HIPRTBVH", "TooSmall");
  refused_everywhere(std::string(4096, 'x'), "BadMagic");
  refused_everywhere(whole.substr(0, whole.size() - 128), "SizeMismatch");
  std::string flipped = whole;
  flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 0x10);
  refused_everywhere(flipped, "BadChecksum");
  // Header and sections are right: bvhinfo describes them and names the fault.
  const CommandResult lenient = run({kBvhInfo, folder / "bad.bvh", "--json"});
  CHECK(lenient.status == 0);
  CHECK_THAT(lenient.err, Contains("warning") && Contains("BadChecksum"));
  const json report = json::parse(lenient.out);
  CHECK(report["valid"] == false);
  CHECK(report["error"]["name"] == "BadChecksum");
  CHECK(report["tree"].is_null());
  CHECK(report["triangles"] == 128);
}

TEST_CASE("Programs: bvhtrace refuses bad ray files") {
  const TempFolder folder;
  check_quiet(run({kBvhBuild, folder.write("a.obj", grid_obj(2)), "-o", folder / "a.bvh"}));
  std::string bytes;
  append(bytes, 3u, 0u, 1.0f);
  const std::string truncated = folder.write("cut.rays", bytes);
  check_failure(folder, {kBvhTrace, folder / "a.bvh", "--rays", truncated, "--hits", folder / "h.hits"}, "cut.rays",
                {"a.bvh", "a.obj", "cut.rays"});
  check_failure(folder, {kBvhTrace, folder / "a.bvh", "--rays", folder / "none.rays", "--hits", folder / "h.hits"},
                "none.rays", {"a.bvh", "a.obj", "cut.rays"});
}

TEST_CASE("Programs: formats can be mixed") {
  const TempFolder folder;
  GltfBuilder b;
  b.json["nodes"] = {{{"mesh", b.add_mesh(b.add_positions({0, 0, 3, 4, 0, 3, 0, 4, 3}))}}};
  b.json["scenes"] = {{{"nodes", {0}}}};
  std::string raw;
  append(raw, 3u, 1u, 0.f, 0.f, 1.f, 4.f, 0.f, 1.f, 0.f, 4.f, 1.f, 0u, 1u, 2u);
  const json built = json_of(run({kBvhBuild, folder.write("a.glb", b.glb()), folder.write("b.mesh", raw),
                                  folder.write("c.obj", grid_obj(4)), "-o", folder / "a.bvh", "--json"}));
  CHECK(built["geometries"] == 3);
  CHECK(built["triangles"] == 34);
  REQUIRE(tools::write_rays(folder / "r.rays", false, std::vector<Ray>{down(0.5f, 0.5f), down(3.5f, 3.25f)}));
  CHECK(run({kBvhTrace, folder / "a.bvh", "--rays", folder / "r.rays", "--hits", folder / "r.hits"}).status == 0);
  const auto hits = tools::read_hits(folder / "r.hits");
  REQUIRE(hits);
  CHECK((*hits)[0].primitive == 0);
  CHECK((*hits)[0].t == 3.5f);
  CHECK((*hits)[1].primitive == 2 + 30);
}
