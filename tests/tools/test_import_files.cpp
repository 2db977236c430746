#include "load.h"

#include <filesystem>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

TEST_CASE("Files: missing, empty, folders, link loops and unknown formats are told apart") {
  const TempFolder folder;
  for (const std::string ending : {".obj", ".ply", ".stl", ".gltf", ".glb", ".mesh", ".mesh.zst"}) {
    INFO(ending);
    CHECK_THAT(refusal(folder / ("missing" + ending)), Contains("No such file"));
    CHECK_THAT(refusal(folder.write("empty" + ending, "")), Contains("empty"));
    std::filesystem::create_directory(folder / ("folder" + ending));
    CHECK_THAT(refusal(folder / ("folder" + ending)), Contains("directory"));
    std::filesystem::create_symlink("loop" + ending, folder / ("loop" + ending));
    CHECK_THAT(refusal(folder / ("loop" + ending)), Contains("symbolic links"));
  }
  CHECK_THAT(refusal(folder.write("a.xyz", "1 2 3\n")), Contains("unknown mesh format") && Contains(".mesh.zst"));
  CHECK_THAT(refusal(folder.write("noextension", "1 2 3\n")), Contains("unknown mesh format"));
}

TEST_CASE("Files: every format refuses the bytes of every other") {
  const TempFolder folder;
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const std::string ending : {".ply", ".stl", ".gltf", ".glb", ".mesh"})
    refusal(folder.write("wrong" + ending, obj));
}
