/// What ends a program early, interruption and the limit of file sizes, leaves nothing half-written.

#include "programs.h"

#include <tests/catch.h>

using namespace hiprt::test;
using Catch::Contains;

TEST_CASE("Programs: at the limit of file sizes bvhbuild fails, says so and leaves no file") {
  const TempFolder folder;
  const std::string mesh = folder.write("a.obj", grid_obj(40));
  const CommandResult result =
      run({"/bin/sh", "-c",
           "ulimit -f 8; exec '" + kBvhBuild + "' '" + mesh + "' -o '" + (folder / "a.bvh").string() + "'"});
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Contains("File too large"));
  CHECK(folder.names() == std::vector<std::string>{"a.obj"});
}

TEST_CASE("Programs: a signal that the parent ignores stays ignored") {
  const TempFolder folder;
  const std::string mesh = folder.write("a.obj", grid_obj(300)), out = folder / "a.bvh";
  Command command({"/bin/sh", "-c", "trap '' INT; exec '" + kBvhBuild + "' '" + mesh + "' -o '" + out + "'"});
  command.ends_within(std::chrono::milliseconds(60));
  command.signal(SIGINT);
  CHECK(command.finish().status == 0);
  CHECK(std::filesystem::exists(out));
}

TEST_CASE("Programs: an interrupted bvhbuild says so, fails and leaves no file, not even a half-written one") {
  const TempFolder folder;
  // Large enough to be interrupted; when the machine is faster than that, the attempt is repeated earlier.
  std::string mesh;
  const std::uint32_t n = 700;
  append(mesh, (n + 1) * (n + 1), 2 * n * n);
  for (std::uint32_t y = 0; y <= n; ++y)
    for (std::uint32_t x = 0; x <= n; ++x)
      append(mesh, static_cast<float>(x), static_cast<float>(y), static_cast<float>((y * (n + 1) + x) * 7919 % 13));
  for (std::uint32_t i = 0; i < n * n; ++i) {
    const std::uint32_t a = i / n * (n + 1) + i % n;
    append(mesh, a, a + 1, a + n + 2, a, a + n + 2, a + n + 1);
  }
  const std::string path = folder.write("large.mesh", mesh);
  bool cancelled = false;
  for (const int delay : {150, 75, 40, 20, 10}) {
    Command command({kBvhBuild, path, "-o", folder / "out.bvh"});
    if (command.ends_within(std::chrono::milliseconds(delay))) {
      CHECK(command.finish().status == 0);
      std::filesystem::remove(folder / "out.bvh");
      continue;
    }
    command.signal(SIGINT);
    const CommandResult result = command.finish();
    if (result.status == 0) {
      // It was past the last point of cancelling: then the whole file is there.
      CHECK(run({kBvhInfo, "--validate", folder / "out.bvh"}).status == 0);
      std::filesystem::remove(folder / "out.bvh");
      continue;
    }
    CHECK(result.status == 1);
    CHECK(result.err == "bvhbuild: cancelled\n");
    CHECK(folder.names() == std::vector<std::string>{"large.mesh"});
    cancelled = true;
    break;
  }
  CHECK(cancelled);
}
