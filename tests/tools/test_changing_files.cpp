// Another program shortens or changes an input while a tool reads it. The tool says so: it neither crashes nor goes on
// with half a file. changing_file.cpp makes the change at the worst moment.

#include <tests/tools/importers/gltf_builder.h>
#include <tests/tools/importers/hair_files.h>
#include "programs.h"
#include "scene_file.h"

#include <chrono>

using namespace hiprt;
using namespace hiprt::test;

namespace {

const std::string kBvhQuery = HIPRT_BVHQUERY, kBvhRender = HIPRT_BVHRENDER;

struct Use {
  std::string changed;  ///< Name of the file that changes.
  std::vector<std::string> command;
};

/// Small inputs of every kind, and commands that read them.
class Inputs {
 public:
  Inputs() {
    folder_.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder_.write("a.ply",
                  "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                  "element face 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    folder_.write("a.stl",
                  "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                  "endloop\nendfacet\nendsolid a\n");
    std::string raw;
    append(raw, 3u, 1u, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0u, 1u, 2u);
    folder_.write("a.mesh", raw);
    folder_.write("a.hair", HairFile().bytes());
    folder_.write("a.xyzr", "0 0 0 1\n");
    folder_.write("a.scene", SceneFile().triangle(0).group({{0, 1.0f}}).bytes());
    folder_.write("a.json", R"({"format": "hiprt scene", "version": 1, "scene": "g", "objects": {"a": ["a.obj"]},
                               "groups": {"g": [{"object": "a"}]}})");
    GltfBuilder gltf;
    gltf.add_mesh(gltf.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0}));
    gltf.json["nodes"] = {{{"mesh", 0}}};
    gltf.json["scenes"] = {{{"nodes", {0}}}};
    folder_.write("a.glb", gltf.glb());
    folder_.write("b.gltf", gltf.with_external_buffer("b.bin"));
    folder_.write("b.bin", gltf.buffer);
    std::string rays;
    append(rays, 1u, 0u, 0.1f, 0.1f, 1.f, 0.f, 0.f, 0.f, -1.f, 9.f);
    folder_.write("a.rays", rays);
    std::string points;
    append(points, 1u, 3u, 0.1f, 0.1f, 1.f);
    folder_.write("a.points", points);
    check_good(run({kBvhBuild, at("a.obj"), "-o", at("a.bvh")}));
    check_good(run({kBvhInfo, at("a.bvh"), "--export", at("tree.json")}));
  }

  std::string at(const std::string& name) const { return (folder_ / name).string(); }

  std::vector<Use> uses() const {
    const std::string out = at("out");
    std::vector<Use> uses{
        {"a.bvh", {kBvhInfo, at("a.bvh")}},
        {"a.bvh", {kBvhInfo, "--validate", at("a.bvh")}},
        {"a.bvh", {kBvhInfo, at("a.bvh"), "--export", out}},
        {"a.bvh", {kBvhTrace, at("a.bvh"), "--rays", at("a.rays"), "--hits", out}},
        {"a.rays", {kBvhTrace, at("a.bvh"), "--rays", at("a.rays"), "--hits", out}},
        {"a.bvh", {kBvhQuery, at("a.bvh"), "--points", at("a.points"), "-o", out}},
        {"a.points", {kBvhQuery, at("a.bvh"), "--points", at("a.points"), "-o", out}},
        {"a.bvh", {kBvhRender, at("a.bvh"), "-o", at("out.png"), "--size", "8x8"}},
        {"a.bvh", {kBvhBuild, at("a.bvh"), "--refit", at("a.obj"), "-o", out}},
        {"tree.json", {kBvhBuild, at("a.obj"), "--import", at("tree.json"), "-o", out}},
        {"b.bin", {kBvhBuild, at("b.gltf"), "-o", out}},
    };
    for (const char* name : {"a.obj", "a.ply", "a.stl", "a.mesh", "a.hair", "a.xyzr", "a.scene", "a.json", "a.glb"})
      uses.push_back({name, {kBvhBuild, at(name), "-o", out}});
    return uses;
  }

  /// Runs the command while the file changes; the file is as before when it returns.
  CommandResult run_with(const Use& use, const char* change) const {
    const std::string file = at(use.changed), before = test::read_file(file);
    // A file that was written long ago: the next write changes its time.
    std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
    std::vector<std::string> command{"/usr/bin/env", "LD_PRELOAD=" HIPRT_CHANGING_FILE, "HIPRT_TEST_FILE=" + file,
                                     std::string("HIPRT_TEST_CHANGE=") + change};
    command.insert(command.end(), use.command.begin(), use.command.end());
    CommandResult result = run(command);
    CHECK(test::read_file(file) != before);
    folder_.write(use.changed, before);
    return result;
  }

  const TempFolder& folder() const { return folder_; }

 private:
  TempFolder folder_;
};

void check_refused(const char* change, const std::string& words) {
  const Inputs inputs;
  const auto names = inputs.folder().names();
  for (const Use& use : inputs.uses()) {
    const CommandResult result = inputs.run_with(use, change);
    INFO(use.command[0] << " reads " << use.changed << ": " << result.err);
    CHECK(result.status == 1);
    CHECK_THAT(result.err, Catch::Contains(words) && Catch::Contains(use.changed));
    CHECK(std::count(result.err.begin(), result.err.end(), '\n') == 1);
    CHECK(inputs.folder().names() == names);
  }
}

}  // namespace

TEST_CASE("Changing files: an input that another program shortens is an error of every tool") {
  check_refused("shorten", "another program shortened it");
}

TEST_CASE("Changing files: an input that another program writes to is an error of every tool") {
  check_refused("overwrite", "another program changed it");
}
