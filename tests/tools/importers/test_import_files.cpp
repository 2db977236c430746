#include <tests/tools/load.h>

#include <tools/base/interrupt.h>
#include <tools/scene_io/mesh/polygons.h>

#include <csignal>
#include <filesystem>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

/// While it exists, the program has been told to stop.
struct Interrupted {
  Interrupted() {
    const tools::InterruptGuard guard;
    std::raise(SIGTERM);
  }
  Interrupted(const Interrupted&) = delete;
  Interrupted& operator=(const Interrupted&) = delete;
  ~Interrupted() { const tools::InterruptGuard forgets; }
};

}  // namespace

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

TEST_CASE("Files: an interrupt stops every text format and PLY early") {
  const TempFolder folder;
  const auto repeated = [](const std::string& text, std::size_t count) {
    std::string result;
    for (std::size_t i = 0; i < count; ++i) result += text;
    return result;
  };
  const std::string header =
      " 1.0\nelement vertex 50000\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 0\nproperty list uchar int vertex_index\nend_header\n";
  // Without the interruption each of them would be refused at its end.
  const std::vector<std::filesystem::path> files{
      folder.write("a.obj", repeated("v 1 2 3\n", 50'000) + "f 0\n"),
      folder.write("a.ply", "ply\nformat ascii" + header + repeated("1 2 3\n", 49'999) + "x x x\n"),
      folder.write("b.ply", "ply\nformat binary_little_endian" + header + repeated("123456789012", 50'000)),
      folder.write("a.stl", "solid a\n" + repeated("facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                                                   "vertex 0 1 0\nendloop\nendfacet\n",
                                                   10'000))};
  const Interrupted now;
  for (const auto& file : files) {
    INFO(file);
    const auto mesh = tools::load_mesh(file);
    REQUIRE_FALSE(mesh);
    CHECK(mesh.error().code == build::ErrorCode::kCancelled);
  }
}

TEST_CASE("Polygons: an interrupt stops within a face") {
  Positions scattered;
  tools::Polygons face;
  constexpr std::uint32_t kCorners = 4096;
  for (std::uint32_t i = 0; i < kCorners; ++i) {
    scattered.push_back({static_cast<float>(i * 7919 % 4093), static_cast<float>(i * 104729 % 4091), 0});
    face.corners.push_back(i);
  }
  face.sizes = {kCorners};
  std::uint64_t skipped = 0;
  CHECK(tools::triangulate(scattered, face, skipped)->size() == kCorners - 2);
  const Interrupted now;
  const auto triangles = tools::triangulate(scattered, face, skipped);
  REQUIRE_FALSE(triangles);
  CHECK(triangles.error().code == build::ErrorCode::kCancelled);
}
