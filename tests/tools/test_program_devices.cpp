/// --device of bvhtrace and bvhrender, with a GPU here and without one.

#include "programs.h"

#include <tools/scene_io/rays_file.h>

#include <tests/catch.h>
#include <tests/oracle/builders.h>
#include <nlohmann/json.hpp>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

const std::string kBvhRender = HIPRT_BVHRENDER;

struct Case {
  std::vector<std::string> command;
  std::filesystem::path output;
};

/// A run of each program, without --device.
std::vector<Case> cases(const TempFolder& folder) {
  const std::string mesh = folder.write("a.obj", grid_obj(8)), bvh = folder / "a.bvh", rays = folder / "r.rays";
  REQUIRE(run({kBvhBuild, mesh, "-o", bvh}).status == 0);
  std::vector<Ray> batch(64);
  for (std::size_t i = 0; i < batch.size(); ++i) batch[i].origin = Vec3(0.15f * static_cast<float>(i), 3.3f, -1.0f);
  REQUIRE(tools::write_rays(rays, false, batch).has_value());
  return {{{kBvhTrace, bvh, "--rays", rays, "--hits", folder / "h.hits"}, folder / "h.hits"},
          {{kBvhRender, bvh, "-o", folder / "a.png", "--size", "40x30", "--spp", "2"}, folder / "a.png"}};
}

CommandResult run_on(const Case& test, const std::vector<std::string>& more) {
  std::vector<std::string> arguments = test.command;
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run(arguments);
}

}  // namespace

TEST_CASE("Programs: --device auto is the default, has the results of cpu, and both name the device used") {
  const TempFolder folder;
  for (const Case& test : cases(folder)) {
    INFO(test.command.front());
    const json cpu = json::parse(run_on(test, {"--device", "cpu", "--json"}).out);
    const std::string expected = read_file(test.output);
    CHECK(cpu["device"] == "cpu");
    CHECK(cpu["device_name"] == cpu["instruction_set"]);
    const json chosen = json::parse(run_on(test, {"--json"}).out);
    CHECK((read_file(test.output) == expected));
    CHECK(json::parse(run_on(test, {"--device", "auto", "--json"}).out)["device"] == chosen["device"]);
    CHECK_THAT(run_on(test, {"--device", "cpu"}).out, Contains("cpu " + cpu["device_name"].get<std::string>()));
  }
}

TEST_CASE("Programs: --device gpu uses the GPU, or says why not, fails and writes nothing") {
  const TempFolder folder;
  for (const Case& test : cases(folder)) {
    INFO(test.command.front());
    const CommandResult result = run_on(test, {"--device", "gpu", "--json"});
    const bool used = result.status == 0;
    CHECK(std::filesystem::exists(test.output) == used);
    if (used) CHECK(json::parse(result.out)["device"] == "gpu");
    if (!used) {
      CHECK(result.status == 1);
      CHECK_THAT(result.err, Contains("GPU: no GPU code in this build (") || Contains("no GPU can be used here") ||
                                 Contains("is not among those that this build has code for"));
      CHECK_THAT(json::parse(result.out)["error"]["message"].get<std::string>(), Contains("GPU"));
    }
    CHECK(json::parse(run_on(test, {"--json"}).out)["device"] == (used ? "gpu" : "cpu"));
  }
}

TEST_CASE("bvhbuild: --device gpu builds there, or says why not, fails and writes nothing") {
  const TempFolder folder;
  const std::string mesh = folder.write("a.obj", grid_obj(8)), bvh = folder / "a.bvh";
  const CommandResult result = run({kBvhBuild, mesh, "-o", bvh, "--device", "gpu", "--json"});
  const bool used = result.status == 0;
  CHECK(std::filesystem::exists(bvh) == used);
  if (!used) {
    CHECK(result.status == 1);
    CHECK_THAT(result.err, Contains("GPU: "));
  }
  CHECK(json::parse(
            run({kBvhBuild, mesh, "-o", bvh, "--device", "auto", "--builder", "hploc", "--json"}).out)["device"] ==
        (used ? "gpu" : "cpu"));
  CHECK(json::parse(run({kBvhBuild, mesh, "-o", bvh, "--json"}).out)["device"] == "cpu");
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--builder", build::name(oracle::kEmbreeHigh)},
        std::vector<std::string>{"--builder", build::name(oracle::kEmbreeLow)}}) {
    std::vector<std::string> arguments{kBvhBuild, mesh, "-o", bvh, "--device", "gpu"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const CommandResult refused = run(arguments);
    CHECK(refused.status == 1);
    CHECK_THAT(refused.err, Contains("a GPU builds neither Embree's trees nor imported ones"));
  }
}

TEST_CASE("Programs: an unknown device is bad usage") {
  const TempFolder folder;
  for (const Case& test : cases(folder)) {
    const CommandResult result = run_on(test, {"--device", "tpu"});
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Contains("tpu") && Contains("auto"));
  }
}
