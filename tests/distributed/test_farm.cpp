// bvhbuild --manifest as users run it, in one process.

#include "farm_inputs.h"

#include <tests/catch.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::test;

namespace {

/// The start of a command line that runs a script in a new mount namespace. @p folder is $1, and the words that are
/// added are the program that the script starts.
std::vector<std::string> with_mounts(const std::string& script, const fs::path& folder) {
  return {"/usr/bin/unshare", "-m", "/bin/sh", "-c", script, "sh", folder.string()};
}

}  // namespace

TEST_CASE("farm: one process builds all assets, a second run finds them all") {
  const TempFolder folder;
  const std::string manifest = write_assets(folder);
  const auto first = json_of(run(farm(manifest, folder / "c", {"--json"})));
  CHECK(first["complete"] == true);
  CHECK(first["misses"] == kSizes.size());
  const auto second = json_of(run(farm(manifest, folder / "c", {"--json"})));
  CHECK(second["hits"] == kSizes.size());
  for (std::size_t i = 0; i < kSizes.size(); ++i) {
    const auto& asset = second["assets"][i];
    CHECK(asset["triangles"] == 2 * kSizes[i] * kSizes[i]);
    CHECK(fs::file_size(asset["file"].get<std::string>()) == asset["bytes"]);
  }
  // The same file as without a farm.
  const fs::path alone = folder / "alone.bvh";
  check_quiet(run({kBvhBuild, (folder / "grid40.obj").string(), "-o", alone.string(), "--quality", "high"}));
  CHECK(read_file(alone) == read_file(second["assets"][1]["file"].get<std::string>()));
}

TEST_CASE("farm: two farms on one folder make the files of one") {
  const TempFolder folder;
  const std::string manifest = write_assets(folder);
  const auto expected = expected_content(folder, manifest);
  for (int i = 0; i < 3; ++i) {
    const fs::path cache = folder / ("two" + std::to_string(i));
    Command first(farm(manifest, cache)), second(farm(manifest, cache));
    check_quiet(first.finish());
    check_quiet(second.finish());
    CHECK(content_of(cache) == expected);
  }
}

TEST_CASE("farm: a file that cannot be read fails alone, with status 1") {
  const TempFolder folder;
  const std::string manifest = write_assets(folder);
  const auto expected = expected_content(folder, manifest);
  folder.write("grid10.obj", "v 0 0 0\nf 1 2 3\n");
  const CommandResult result = run(farm(manifest, folder / "c", {"--json"}));
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Catch::Contains("1 of 8 assets were not built") && Catch::Contains("'grid10'"));
  const auto report = nlohmann::json::parse(result.out);
  CHECK(report["failed"] == 1);
  CHECK(report["misses"] == 7);
  CHECK_THAT(report["assets"][2]["error"].get<std::string>(), Catch::Contains("grid10.obj"));
}

TEST_CASE("farm: damaged entries are built again, with a warning") {
  const TempFolder folder;
  const std::string manifest = write_assets(folder);
  const auto expected = expected_content(folder, manifest);
  const fs::path damaged = folder / "expected" / expected.begin()->first;
  fs::resize_file(damaged, fs::file_size(damaged) / 2);
  const CommandResult result = run(farm(manifest, folder / "expected", {"--json"}));
  CHECK(result.status == 0);
  CHECK_THAT(result.err, Catch::Contains("it was built again"));
  CHECK(nlohmann::json::parse(result.out)["damaged"] == 1);
  CHECK(content_of(folder / "expected") == expected);
}

TEST_CASE("farm: a full disk ends the run with the reason, and leaves whole files only") {
  const TempFolder folder;
  const std::string manifest = write_assets(folder);
  const auto expected = expected_content(folder, manifest);
  fs::create_directory(folder / "disk");
  // A file system of 300 KiB.
  std::vector<std::string> command = with_mounts(
      R"(d=$1; shift; mount -t tmpfs -o size=300k none "$d" || exit 99; "$@"
         s=$?; find "$d" -type f -size +0; exit $s)",
      folder / "disk");
  for (const std::string& word : farm(manifest, folder / "disk" / "c")) command.push_back(word);
  const CommandResult result = run(command);
  if (result.status == 99 || result.status == 127) {
    std::printf("no mount namespace: the full disk is not tested\n");
    return;
  }
  INFO(result.out << result.err);
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Catch::Contains("No space left on device") && Catch::Contains("asset '"));
  CHECK_THAT(result.out, !Catch::Contains(".tmp"));
}

TEST_CASE("farm: a cache that cannot be written serves hits, and misses are an error") {
  const TempFolder folder;
  const std::string manifest = write_assets(folder);
  const auto expected = expected_content(folder, manifest);
  const auto read_only = [&](const std::vector<std::string>& arguments) {
    std::vector<std::string> command =
        with_mounts(R"(d=$1; shift; mount --bind "$d" "$d" && mount -o remount,bind,ro "$d" || exit 99; "$@")",
                    folder / "expected");
    command.insert(command.end(), arguments.begin(), arguments.end());
    return run(command);
  };
  const CommandResult hits = read_only(farm(manifest, folder / "expected"));
  if (hits.status == 99 || hits.status == 127) {
    std::printf("no mount namespace: the read-only cache is not tested\n");
    return;
  }
  check_quiet(hits);
  fs::remove(folder / "expected" / expected.begin()->first);
  const CommandResult misses = read_only(farm(manifest, folder / "expected"));
  CHECK(misses.status == 1);
  CHECK_THAT(misses.err, Catch::Contains("Read-only file system"));
}

TEST_CASE("cache: a scene builds only the objects that are new, and its file is the same") {
  const TempFolder folder;
  for (const unsigned size : {4u, 9u}) folder.write("grid" + std::to_string(size) + ".obj", grid_obj(size));
  const auto scene = [&](const std::string& name, const std::string& second) {
    return folder
        .write(name, R"({"format": "hiprt scene", "version": 1, "scene": "all",
                         "objects": {"a": ["grid4.obj"], "b": [")" +
                         second +
                         R"("]}, "groups": {"all": [{"object": "a"}, {"object": "b", "translate": [9, 0, 0]}]}})")
        .string();
  };
  const std::string first = scene("first.json", "grid9.obj"), out = (folder / "out.bvh").string();
  const std::vector<std::string> cached{kBvhBuild, first, "-o", out, "--cache", (folder / "c").string(), "--json"};
  check_quiet(run({kBvhBuild, first, "-o", (folder / "plain.bvh").string()}));
  CHECK(json_of(run(cached))["cache"] == nlohmann::json{{"hits", 0}, {"misses", 2}, {"damaged", 0}});
  CHECK(read_file(out) == read_file(folder / "plain.bvh"));
  const auto again = json_of(run(cached));
  CHECK(again["cache"] == nlohmann::json{{"hits", 2}, {"misses", 0}, {"damaged", 0}});
  CHECK(again["triangles"] == 2 * (16 + 81));
  CHECK(read_file(out) == read_file(folder / "plain.bvh"));
  folder.write("grid5.obj", grid_obj(5));
  auto other = cached;
  other[1] = scene("other.json", "grid5.obj");
  CHECK(json_of(run(other))["cache"] == nlohmann::json{{"hits", 1}, {"misses", 1}, {"damaged", 0}});
  // There is a file of the name of the cache.
  const CommandResult none = run({kBvhBuild, first, "-o", out, "--cache", first});
  CHECK(none.status == 1);
  CHECK_THAT(none.err, Catch::Contains("cannot make the folder of the cache"));
}

TEST_CASE("farm: wrong command lines are status 2 and say what is missing") {
  const auto check_usage = [](std::vector<std::string> arguments, const std::string& word) {
    arguments.insert(arguments.begin(), kBvhBuild);
    const CommandResult result = run(arguments);
    INFO(result.err);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Catch::Contains(word));
  };
  check_usage({"--manifest", "m.json"}, "--cache");
  check_usage({"--prune", "20G"}, "--cache");
  check_usage({"--cache", "c"}, "INPUT is required");
  check_usage({"--cache", "c", "--prune", "20X"}, "expected a size such as 20G or a time such as 30d");
  check_usage({"--cache", "c", "--manifest", "m.json", "a.obj"}, "takes no INPUT");
  check_usage({"--cache", "c", "--manifest", "m.json", "-o", "x"}, "--manifest excludes --output");
  check_usage({"--cache", "c", "--lossy-ranks", "a.obj", "-o", "x"}, "--manifest");
  check_usage({"--cache", "c", "--prune", "1G", "a.obj", "-o", "x"}, "--prune goes alone");
}
