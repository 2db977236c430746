/// Rules that the command lines of all tools follow, for bvhbuild, bvhinfo and bvhtrace.

#include "limited_child.h"
#include "programs.h"

#include <tools/scene_io/rays_file.h>

#include <tests/catch.h>
#include <nlohmann/json.hpp>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

struct Tool {
  std::string name, path;
};
const std::vector<Tool> kTools{{"bvhbuild", kBvhBuild}, {"bvhinfo", kBvhInfo}, {"bvhtrace", kBvhTrace}};

void check_usage_error(const Tool& tool, std::vector<std::string> arguments, const std::string& word) {
  arguments.insert(arguments.begin(), tool.path);
  const CommandResult result = run(arguments);
  INFO(result.err);
  CHECK(result.status == 2);
  CHECK(result.out.empty());
  CHECK_THAT(result.err, Catch::StartsWith(tool.name + ": ") && Contains(word) && Contains("--help"));
  CHECK(std::count(result.err.begin(), result.err.end(), '\n') == 1);
}

}  // namespace

TEST_CASE("Command lines: --help shows examples, --version the version") {
  for (const Tool& tool : kTools) {
    INFO(tool.name);
    const CommandResult help = run({tool.path, "--help"});
    CHECK(help.status == 0);
    CHECK(help.err.empty());
    CHECK_THAT(help.out, Contains("Examples:\n  " + tool.name + " ") && Contains("--json") && Contains("Exit status"));
    const CommandResult version = run({tool.path, "--version"});
    CHECK(version.status == 0);
    CHECK(version.err.empty());
    CHECK_THAT(version.out, Catch::Matches(tool.name + " [0-9]+\\.[0-9]+\\.[0-9]+\nGPU code: .+\nEmbree: .+\nMPI: .+\n"
                                                       "assimp: .+\n"));
  }
}

TEST_CASE("Command lines: bad usage is status 2 with one line that names the fault") {
  for (const Tool& tool : kTools) {
    INFO(tool.name);
    check_usage_error(tool, {}, "required");
    check_usage_error(tool, {"file", "--frobnicate"}, "--frobnicate");
    check_usage_error(tool, {"file", "--json=5"}, "json");
  }
  const Tool& build = kTools[0];
  check_usage_error(build, {"a.obj"}, "--output");
  check_usage_error(build, {"a.obj", "-o", "b", "--builder", "fast"}, "fast");
  check_usage_error(build, {"a.obj", "-o", "b", "--quality", "best"}, "best");
  check_usage_error(build, {"a.obj", "-o", "b", "--quality", "high", "--builder", "hq"}, "excludes");
  check_usage_error(build, {"a.obj", "-o", "b", "--nodes", "eighth"}, "eighth");
  check_usage_error(build, {"a.obj", "-o", "b", "--target", "toaster"}, "--target: toaster not in {cpu,amd,nvidia}");
  check_usage_error(build, {"a.obj", "-o", "b", "--threads", "-1"}, "--threads");
  check_usage_error(build, {"a.obj", "-o", "b", "--threads", "5000"}, "--threads");
  check_usage_error(build, {"a.obj", "-o", "b", "--threads", "two"}, "--threads");
  check_usage_error(build, {"a.obj", "-o", "b", "--max-leaf", "0"}, "--max-leaf");
  check_usage_error(build, {"a.obj", "-o", "b", "--max-leaf", "65"}, "--max-leaf");
  for (const char* budget : {"0", "0.9", "17", "many"})
    check_usage_error(build, {"a.obj", "-o", "b", "--split-budget", budget},
                      std::string("'") + budget + "' is no split budget: expected 1 to 16, or auto");
  check_usage_error(kTools[1], {"a.bvh", "b.bvh"}, "OUT requires --upgrade");
  const Tool& trace = kTools[2];
  check_usage_error(trace, {"a.bvh", "--hits", "h"}, "--rays");
  check_usage_error(trace, {"a.bvh", "--rays", "r"}, "--hits");
  check_usage_error(trace, {"a.bvh", "--rays", "r", "--hits", "h", "--query", "all"}, "all");
  check_usage_error(trace, {"a.bvh", "--rays", "r", "--hits", "h", "--repeat", "0"}, "--repeat");
  check_usage_error(trace, {"a.bvh", "--rays", "r", "--hits", "h", "--triangle-test", "exact"}, "exact");
  check_usage_error(trace, {"a.bvh", "--rays", "r", "--hits", "h", "--box-test", "loose"}, "loose");
  check_usage_error(trace,
                    {"a.bvh", "--rays", "r", "--hits", "h", "--triangle-test", "reference", "--box-test", "plain"},
                    "--triangle-test reference is with --box-test conservative");
}

TEST_CASE("Command lines: output that cannot be written is a failure") {
  const CommandResult result = run({"/bin/sh", "-c", "'" + kBvhInfo + "' --help > /dev/full"});
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Contains("standard output"));
}

TEST_CASE("Command lines: a terminal gets no control characters from names and files") {
  const CommandResult result = run({kBvhInfo, "\x1b[31mred\x07\xff.bvh"});
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Contains("\\x1b[31mred\\x07\\xff.bvh"));
  CHECK(result.err.find('\x1b') == std::string::npos);
}

TEST_CASE("Command lines: with --json a failure is JSON too") {
  const TempFolder folder;
  const std::string bad = folder.write("bad.bvh", std::string(4096, 'x'));
  for (const std::vector<std::string>& words : {std::vector<std::string>{kBvhInfo, bad, "--json"},
                                                {kBvhInfo, bad, "--json", "--dump"},
                                                {kBvhTrace, bad, "--rays", bad, "--hits", folder / "h", "--json"},
                                                {kBvhBuild, folder / "none.obj", "-o", folder / "x.bvh", "--json"}}) {
    const CommandResult result = run(words);
    CHECK(result.status == 1);
    const auto value = nlohmann::json::parse(result.out, nullptr, false);
    REQUIRE(value.is_object());
    CHECK_FALSE(value["error"]["message"].get<std::string>().empty());
    CHECK_THAT(result.err, Contains(value["error"]["message"].get<std::string>()));
  }
}

TEST_CASE("--max-memory: a file that needs more is an error with the option's name; sizes have units") {
  if (!kCanLimitMemory) return;
  const TempFolder folder;
  std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (unsigned i = 0; i < 400'000; ++i) obj += "f 1 2 3\n";
  const std::string path = folder.write("a.obj", obj), out = folder / "a.bvh";
  const CommandResult few = run({kBvhBuild, path, "-o", out, "--max-memory", "2M"});
  INFO(few.err);
  CHECK(few.status == 1);
  CHECK_THAT(few.err, Catch::Contains("a.obj: not enough memory to read it; the limit is 2097152 bytes, --max-memory"));
  CHECK(folder.names() == std::vector<std::string>{"a.obj"});
  check_good(run({kBvhBuild, path, "-o", out, "--max-memory", "1G", "--builder", "lbvh"}));
  CHECK(run({kBvhBuild, path, "-o", out, "--max-memory", "much"}).status == 2);
  for (const std::string& tool : {kBvhInfo, kBvhTrace})
    CHECK_THAT(run({tool, "--help"}).out, Catch::Contains("--max-memory SIZE"));

  // BVH files are inputs, too.
  const std::string message = "a.bvh: not enough memory to read it; the limit is 1048576 bytes, --max-memory sets it";
  const std::string rays = folder / "r.rays";
  REQUIRE(tools::write_rays(rays, false, std::vector<Ray>(1)).has_value());
  REQUIRE(std::filesystem::file_size(out) > (4u << 20));
  for (const std::vector<std::string>& command : {std::vector<std::string>{kBvhInfo, out},
                                                  {kBvhInfo, "--upgrade", out, folder / "b.bvh"},
                                                  {kBvhTrace, out, "--rays", rays, "--hits", folder / "h"},
                                                  {HIPRT_BVHQUERY, out, "--points", rays, "-o", folder / "q"},
                                                  {kBvhBuild, out, "--refit", path, "-o", folder / "b.bvh"},
                                                  {HIPRT_BVHRENDER, out, "-o", folder / "a.png"}}) {
    std::vector<std::string> limited = command;
    limited.insert(limited.end(), {"--max-memory", "1M"});
    const CommandResult result = run(limited);
    CAPTURE(command, result.err);
    CHECK(result.status == 1);
    CHECK_THAT(result.err, Catch::Contains(message));
  }
  CHECK(folder.names() == std::vector<std::string>{"a.bvh", "a.obj", "r.rays"});
}
