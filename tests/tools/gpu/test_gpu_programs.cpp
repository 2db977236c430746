/// The tools on a GPU: bvhtrace and bvhrender give the files that they give on the CPU, bvhbuild a valid one.

#include <tests/tools/run_command.h>
#include <tests/tools/temp_folder.h>

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/format/view.h>
#include <tests/gpu/random_scene.h>
#include <tests/oracle/builders.h>
#include <tools/cli/build/build_names.h>
#include <tools/scene_io/rays_file.h>

#include <tests/catch.h>
#include <nlohmann/json.hpp>

#include <cstdlib>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

constexpr std::uint64_t kSeed = 73;

std::string write_scene(const TempFolder& folder, NodeLayout layout) {
  const auto bvh = build::build(oracle::views(checks::star_in_soup(kSeed)), {.nodes = layout});
  REQUIRE(bvh.has_value());
  REQUIRE(build::write_file(folder / "a.bvh", bvh->buffer.bytes()).has_value());
  return folder / "a.bvh";
}

std::string write_rays(const TempFolder& folder) {
  const checks::SceneSource scene{"soup", checks::star_in_soup(kSeed)};
  oracle::Random random(kSeed);
  std::vector<Ray> rays(3000);
  for (Ray& ray : rays) ray = checks::random_ray(scene, random).ray;
  REQUIRE(tools::write_rays(folder / "r.rays", false, rays).has_value());
  return folder / "r.rays";
}

/// Runs a program with --json, which must succeed.
json run_well(std::vector<std::string> arguments) {
  arguments.push_back("--json");
  const CommandResult result = run(std::move(arguments));
  INFO(result.err);
  REQUIRE(result.status == 0);
  json value = json::parse(result.out, nullptr, false);
  REQUIRE(!value.is_discarded());
  return value;
}

}  // namespace

TEST_CASE("bvhbuild: a GPU builds as the options say; auto is the GPU for its builders and the CPU for others") {
  const TempFolder folder;
  std::string text;
  for (int i = 0; i < 40; ++i)
    text += "v " + std::to_string(i) + " 0 0\nv " + std::to_string(i) + " 1 " + std::to_string(i % 3) + "\n";
  // Every other one is turned round, so that all face the same direction.
  for (int i = 1; i < 78; ++i)
    text += "f " + std::to_string(i + i % 2) + " " + std::to_string(i + 1 - i % 2) + " " + std::to_string(i + 2) + "\n";
  const std::string mesh = folder.write("strip.obj", text), file = folder / "a.bvh";
  const auto build_with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {HIPRT_BVHBUILD, mesh, "-o", file});
    json report = run_well(more);
    const auto bytes = build::map_file(file);
    REQUIRE(bytes.has_value());
    REQUIRE(validate(bytes->bytes()).has_value());
    return report;
  };
  const json standard = build_with({"--device", "gpu"});
  CHECK(standard["device"] == "gpu");
  CHECK(standard["builder"] == "sbvh");
  CHECK(standard["triangles"] == 77);
  CHECK(standard["pairs"] > 30);
  CHECK(build_with({"--device", "gpu", "--builder", "lbvh", "--nodes", "quantized"})["layout"] == "quantized");
  CHECK(build_with({"--device", "gpu", "--quality", "fast"})["builder"] == "lbvh");
  CHECK(build_with({"--device", "auto", "--builder", "lbvh30"})["device"] == "gpu");
  CHECK(build_with({"--device", "auto", "--builder", "sbvh"})["device"] == "gpu");
  CHECK(build_with({"--device", "gpu", "--quality", "high"})["builder"] == "hq");
  CHECK(build_with({"--device", "gpu", "--presplit-budget", "1.5", "--reinsertion-rounds", "2"})["builder"] == "sbvh");
  CHECK(build_with({"--device", "auto", "--builder", build::name(oracle::kEmbreeHigh)})["device"] ==
        (oracle::kHasEmbree ? "cpu" : "gpu"));
  CHECK(build_with({})["device"] == "cpu");
}

TEST_CASE("bvhbuild: a scene whose tree over instances a GPU has built has the CPU's hits") {
  const TempFolder folder;
  folder.write("quad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 3\nf 2 4 3\n");
  json instances = json::array();
  for (int i = 0; i < 40; ++i)
    instances.push_back({{"object", "quad"}, {"translate", {0.3 * i - 6, 0.2 * (i % 7), 0.5 * (i % 3)}}, {"id", i}});
  const auto build_on = [&](const std::string& device, const json& all) {
    const json scene{{"format", "hiprt scene"},
                     {"version", 1},
                     {"scene", "row"},
                     {"objects", {{"quad", {"quad.obj"}}}},
                     {"groups", {{"row", all}}}};
    folder.write("s.json", scene.dump());
    return run({HIPRT_BVHBUILD, folder / "s.json", "-o", folder / (device + ".bvh"), "--device", device, "--json"});
  };
  const std::string rays = write_rays(folder);
  std::string hits[2];
  for (const std::string device : {"cpu", "gpu"}) {
    const CommandResult built = build_on(device, instances);
    INFO(built.err);
    REQUIRE(built.status == 0);
    CHECK(json::parse(built.out)["device"] == device);
    const auto file = build::map_file(folder / (device + ".bvh"));
    REQUIRE(validate(file->bytes()).has_value());
    CHECK((open_buffer(file->bytes())->provenance.find("\"gpu\"") != std::string_view::npos) == (device == "gpu"));
    const json traced = run_well(
        {HIPRT_BVHTRACE, folder / (device + ".bvh"), "--rays", rays, "--hits", folder / "h.hits", "--device", "cpu"});
    CHECK(traced["hits"] > 50);
    hits[device == "gpu" ? 1 : 0] = read_file(folder / "h.hits");
  }
  CHECK((hits[0] == hits[1]));
  instances[7]["translate"] = {3e38, 0, 0};
  instances[7]["scale"] = 2e38;
  const CommandResult refused = build_on("gpu", instances);
  CHECK(refused.status == 1);
  CHECK_THAT(refused.err, Contains("s.json: groups.row[7]: its bounds are beyond what floats hold"));
}

TEST_CASE("bvhtrace: the hit file of a GPU is the CPU's, in every layout, for closest and any hit") {
  const TempFolder folder;
  const std::string rays = write_rays(folder), hits = folder / "h.hits";
  for (const auto& [name, layout] : tools::kLayouts) {
    const std::string scene = write_scene(folder, layout);
    for (const std::string query : {"closest", "any"}) {
      CAPTURE(name, query);
      const std::vector<std::string> command{HIPRT_BVHTRACE, scene,     "--rays", rays,      "--hits",
                                             hits,           "--query", query,    "--device"};
      const auto on = [&](const std::string& device) {
        std::vector<std::string> arguments = command;
        arguments.push_back(device);
        return run_well(arguments);
      };
      const json cpu = on("cpu");
      const std::string expected = read_file(hits);
      const json gpu = on("gpu");
      CHECK((read_file(hits) == expected));
      CHECK(cpu["device"] == "cpu");
      CHECK(gpu["device"] == "gpu");
      CHECK_THAT(gpu["device_name"].get<std::string>(), Contains(std::getenv("HIPRT_TEST_GPU_ARCH")));
      CHECK(gpu["hits"] == cpu["hits"]);
      CHECK(gpu["hits"] > 1000);
      CHECK(gpu["median_seconds"] > 0);
    }
  }
}

TEST_CASE("bvhtrace and bvhrender: auto is the GPU") {
  const TempFolder folder;
  const std::string scene = write_scene(folder, NodeLayout::kPlanes), rays = write_rays(folder);
  CHECK(run_well({HIPRT_BVHTRACE, scene, "--rays", rays, "--hits", folder / "h.hits"})["device"] == "gpu");
  CHECK_THAT(run({HIPRT_BVHTRACE, scene, "--rays", rays, "--hits", folder / "h.hits"}).out, Contains("gpu "));
  const std::vector<std::string> picture{HIPRT_BVHRENDER, scene, "-o", folder / "a.png", "--size", "8x8", "--spp", "1"};
  CHECK(run_well(picture)["device"] == "gpu");
}

TEST_CASE("bvhrender: the pictures of a GPU are the CPU's") {
  const TempFolder folder;
  const std::string scene = write_scene(folder, NodeLayout::kPlanes);
  // From inside the star, where every ray hits: batches of shadow rays as large as those of primary rays.
  const std::vector<std::string> command{
      HIPRT_BVHRENDER, scene, "-o",       folder / "a.exr",           "-o",      folder / "a.png", "--size", "80x60",
      "--spp",         "2",   "--camera", "0,0,0/0.1,0.2,1/0,1,0/60", "--device"};
  const auto on = [&](const std::string& device) {
    std::vector<std::string> arguments = command;
    arguments.push_back(device);
    return run_well(arguments);
  };
  const json cpu = on("cpu");
  const std::string exr = read_file(folder / "a.exr"), png = read_file(folder / "a.png");
  const json gpu = on("gpu");
  CHECK((read_file(folder / "a.exr") == exr));
  CHECK((read_file(folder / "a.png") == png));
  CHECK(cpu["rays_on_gpu"] == 0);
  CHECK(gpu["primary_rays"] == 3 * 80 * 60);
  CHECK(gpu["shadow_rays"] == cpu["shadow_rays"]);
  // All but the rays through the centres, whose tests the EXR file counts.
  CHECK(gpu["rays_on_gpu"] == gpu["primary_rays"].get<int>() - 80 * 60 + gpu["shadow_rays"].get<int>());
}

TEST_CASE("bvhrender: a heatmap is the CPU's work, and --device gpu says so") {
  const TempFolder folder;
  const std::string scene = write_scene(folder, NodeLayout::kPlanes);
  const std::vector<std::string> command{HIPRT_BVHRENDER, scene,   "-o",     folder / "a.png",
                                         "--size",        "64x64", "--mode", "heatmap"};
  CHECK(run_well(command)["device"] == "cpu");
  std::vector<std::string> refused = command;
  refused.insert(refused.end(), {"--device", "gpu"});
  const CommandResult result = run(refused);
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Contains("heatmap counts tests, which only the CPU does"));
}
