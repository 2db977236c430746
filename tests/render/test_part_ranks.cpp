/// bvhbuild --parts and bvhrender of its parts, under mpirun: the picture is that of one file, or there is a clear
/// error in bounded time.

#include "read_images.h"
#include "renderer.h"

#include <tests/amount.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/random.h>
#include <tests/tools/importers/gltf_builder.h>
#include <tests/tools/mpi_run.h>

#include <nlohmann/json.hpp>

#include <csignal>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

const std::string kBvhBuild = HIPRT_BVHBUILD;

const std::string& mpirun() {
  static const std::string path = find_mpirun(kBvhRender);
  return path;
}

Words under_mpirun(unsigned ranks, const Words& program, const Words& more = {}) {
  return test::under_mpirun(mpirun(), ranks, Words{kBvhRender} + program, more);
}

CommandResult bvhbuild(const Words& words) { return run(Words{kBvhBuild} + words); }

void build_well(const Words& words) {
  const CommandResult result = bvhbuild(words);
  INFO(result.err);
  REQUIRE(result.status == 0);
}

/// A ball and a lamp below a sky, in groups on two levels: "scene.json" and the files that it names.
/// @return its path.
std::string write_scene(const TempFolder& folder) {
  const auto ball = oracle::icosphere(2);
  std::string obj;
  for (const auto& p : ball.positions)
    obj += "v " + std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]) + "\n";
  for (const auto& t : ball.triangles)
    obj += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " + std::to_string(t[2] + 1) + "\n";
  folder.write("ball.obj", obj);
  const auto square = [&](const char* name, const json& material) {
    GltfBuilder b;
    const int mesh = b.add_mesh(b.add_positions({-1, 0, -1, 1, 0, -1, 1, 0, 1, -1, 0, 1}),
                                b.add_accessor(std::vector<std::uint16_t>{0, 2, 1, 0, 3, 2}, 5123, "SCALAR", 6));
    b.json["meshes"][static_cast<std::size_t>(mesh)]["primitives"][0]["material"] = 0;
    b.json["nodes"].push_back({{"mesh", mesh}});
    b.json["materials"] = {material};
    b.json["scenes"] = {{{"nodes", {0}}}};
    folder.write(name, b.embedded());
  };
  square("lamp.gltf", {{"emissiveFactor", {1, 0.8, 0.5}}});
  square("tile.gltf", {{"pbrMetallicRoughness",
                        {{"baseColorFactor", {0.2, 0.6, 0.3, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.4}}}});
  json grove = json::array(), scene = json::array();
  for (int i = 0; i < 4; ++i)
    grove.push_back({{"object", i == 3 ? "lamp" : "ball"}, {"translate", {2.2 * i, 1 + 0.3 * i, 0}}, {"scale", 0.8}});
  for (int i = 0; i < 6; ++i) {
    scene.push_back({{"object", "tile"}, {"translate", {3 * i - 8, -1, 0}}, {"scale", 4}});
    scene.push_back({{"object", "grove"}, {"translate", {i - 6, 0, 2.5 * i - 6}}});
  }
  // Twice at one place: hits tie.
  scene.push_back(scene.back());
  const json document = {{"format", "hiprt scene"},
                         {"version", 1},
                         {"scene", "all"},
                         {"objects", {{"ball", {"ball.obj"}}, {"lamp", {"lamp.gltf"}}, {"tile", {"tile.gltf"}}}},
                         {"groups", {{"grove", grove}, {"all", scene}}}};
  return folder.write("scene.json", document.dump());
}

/// The scene as one file and in parts, and its picture of one process.
struct PartFolder {
  explicit PartFolder(unsigned parts, const Words& more = {}) : scene(write_scene(folder)) {
    build_well(Words{scene, "-o", folder / "whole.bvh"} + more);
    std::filesystem::create_directory(folder / "parts");
    build_well(Words{scene, "-o", manifest(), "--parts", std::to_string(parts)} + more);
  }

  std::string manifest() const { return folder / "parts/p.json"; }
  /// Without the file to render.
  static Words picture(unsigned samples = 3) {
    return {"--integrator",          "path",      "--size", "61x47", "--camera", "2,9,16/0,0,0/0,1,0/50", "--spp",
            std::to_string(samples), "--threads", "1"};
  }
  void render_whole(const std::string& to, unsigned samples = 3) const {
    render_well(Words{folder / "whole.bvh", "--materials", scene, "-o", folder / to} + picture(samples));
  }

  TempFolder folder;
  std::string scene;
};

}  // namespace

TEST_CASE("bvhrender of parts: 1, 2, 3 and 5 ranks give the picture of one file") {
  if (skip_without(mpirun(), "parts under mpirun")) return;
  const PartFolder parts(4);
  parts.render_whole("whole.exr");
  parts.render_whole("whole.png");
  const ExrFile expected = read_exr(parts.folder / "whole.exr");
  std::string first;
  for (const unsigned ranks : {1u, 2u, 3u, 5u})
    for (const Words& memory : {Words{}, Words{"--ray-memory", "100K"}}) {
      CAPTURE(ranks, memory);
      const std::string exr = parts.folder / "parts.exr", png = parts.folder / "parts.png";
      const Words words = Words{parts.manifest(), "-o", exr, "-o", png, "--json"} + PartFolder::picture() + memory;
      const CommandResult result = ranks == 1 ? render(words) : run_bounded(under_mpirun(ranks, words));
      INFO(result.out << result.err);
      REQUIRE(result.status == 0);
      CHECK(result.err.empty());
      CHECK(read_file(png) == read_file(parts.folder / "whole.png"));
      const ExrFile found = read_exr(exr);
      for (const auto& [name, values] : expected.floats)
        if (!name.starts_with("cost.")) {
          CAPTURE(name);
          CHECK(found.floats.at(name) == values);
        }
      for (const auto& [name, values] : expected.uints)
        if (!name.starts_with("cost.")) {
          CAPTURE(name);
          CHECK(found.uints.at(name) == values);
        }
      CHECK(!found.uints.contains("cost.boxes"));
      // All numbers of ranks write the same bytes.
      if (first.empty()) first = read_file(exr);
      CHECK(read_file(exr) == first);
      const json told = json::parse(result.out);
      CHECK(told.at("ranks") == ranks);
      CHECK(told.at("primary_rays") == 61 * 47 * 3);
      const json& exchange = told.at("exchange");
      CHECK((exchange.at("visits_of_other_ranks") != 0) == (ranks > 1));
      CHECK((exchange.at("messages") != 0) == (ranks > 1));
    }
}

TEST_CASE("bvhrender of parts: a rank needs its own files and the shared part only") {
  if (skip_without(mpirun(), "files of parts")) return;
  const PartFolder parts(2);
  parts.render_whole("whole.png");
  // Each rank has a separate folder with its part.
  for (const std::string rank : {"0", "1"}) {
    std::filesystem::create_directory(parts.folder / rank);
    for (const std::string file : {"p.json", "p.shared.bvh", "p.shared.data"})
      std::filesystem::copy(parts.folder / ("parts/" + file), parts.folder / (rank + "/" + file));
    for (const std::string end : {".bvh", ".data"})
      std::filesystem::copy(parts.folder / ("parts/p." + rank + end), parts.folder / (rank + "/p." + rank + end));
  }
  const auto ranks = [&] {
    std::string line =
        "cd '" + parts.folder.path().string() + "'/$OMPI_COMM_WORLD_RANK && exec '" + kBvhRender + "' p.json";
    for (const std::string& word : Words{"-o", parts.folder / "parts.png"} + PartFolder::picture())
      line += " '" + word + "'";
    return run_bounded(Words{mpirun(), "--oversubscribe", "-n", "2", "/bin/bash", "-c", line});
  };
  const CommandResult good = ranks();
  INFO(good.err);
  CHECK(good.status == 0);
  CHECK(read_file(parts.folder / "parts.png") == read_file(parts.folder / "whole.png"));
  std::filesystem::remove(parts.folder / "parts.png");
  const auto fails = [&](const std::string& word) {
    const CommandResult bad = ranks();
    INFO(bad.err);
    CHECK(bad.status == 1);
    CHECK_THAT(bad.err, Contains(word));
    CHECK_FALSE(std::filesystem::exists(parts.folder / "parts.png"));
  };
  // A message of a part that was corrupted on its way to the rank's disk.
  const std::string whole = read_file(parts.folder / "1/p.1.data");
  std::string damaged = whole;
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 1);
  parts.folder.write("1/p.1.data", damaged);
  fails("p.1.data: the checksum is ");
  parts.folder.write("1/p.1.data", whole);
  std::string bvh = read_file(parts.folder / "1/p.1.bvh");
  bvh[bvh.size() / 2] = static_cast<char>(bvh[bvh.size() / 2] ^ 1);
  parts.folder.write("1/p.1.bvh", bvh);
  fails("p.1.bvh: ");
  std::filesystem::remove(parts.folder / "1/p.1.bvh");
  fails("p.1.bvh");
  // Another manifest.
  parts.folder.write("1/p.json", read_file(parts.folder / "1/p.json") + " ");
  fails("p.json: the checksum is ");
}

TEST_CASE("bvhrender of parts: a rank that is killed ends the run soon, and it goes on with --resume") {
  if (skip_without(mpirun(), "killed ranks of parts") || skip_kills("killed ranks of parts")) return;
  const std::uint64_t seed = 20261128;
  CAPTURE(seed);
  oracle::Random random(seed);
  const PartFolder parts(3);
  const bool full = checks::kWorkDivisor == 1;
  const unsigned samples = 400, kills = full ? 100 : 3;
  parts.render_whole("whole.png", samples);
  const std::string out = parts.folder / "parts.png", kept = parts.folder / "kept";
  const Words words =
      Words{parts.manifest(), "-o", out, "--resume", kept, "--resume-every", "0"} + PartFolder::picture(samples);
  unsigned ended = 0;
  for (unsigned i = 0; i < kills; ++i) {
    const int victim = static_cast<int>(random.below(3));
    const unsigned moment = random.below(1000);
    CAPTURE(i, victim, moment);
    MpiRun run(under_mpirun(3, words, (i & 1u) != 0 ? with_recovery() : Words{}));
    const pid_t process = run.wait_for(victim);
    // Before the ranks have met a death holds the others up for a minute.
    if (!full && !run.writes(kept)) continue;
    if (!run.mpirun().ends_within(milliseconds(moment)) && process > 0) kill(process, SIGKILL);
    const CommandResult result = run_bounded(run, seconds(90));
    INFO(result.out << result.err);
    if (result.status == 0) {
      CHECK(read_file(out) == read_file(parts.folder / "whole.png"));
      std::filesystem::remove(out);
      continue;
    }
    ++ended;
    CHECK_FALSE(result.err.empty());
    // The picture so far may be there, of fewer samples, and the temporary file of a writer that was killed.
    CHECK(parts.folder.names().size() <= 10);
  }
  std::printf("killed ranks of parts: %u of %u runs ended early\n", ended, kills);
  const CommandResult rest = run_bounded(under_mpirun(2, words));
  INFO(rest.err);
  CHECK(rest.status == 0);
  CHECK(read_file(out) == read_file(parts.folder / "whole.png"));
  CHECK_FALSE(std::filesystem::exists(kept));
}

TEST_CASE("bvhrender of parts: a lost rank is named, and a rank that stands still changes nothing") {
  if (skip_without(mpirun(), "lost ranks of parts") || skip_kills("lost ranks of parts")) return;
  const PartFolder parts(3);
  const unsigned samples = 600;
  const std::string out = parts.folder / "parts.png", kept = parts.folder / "kept";
  const Words words = Words{parts.manifest(), "-o", out} + PartFolder::picture(samples);
  {
    MpiRun run(under_mpirun(3, words + Words{"--resume", kept, "--resume-every", "0"}, with_recovery()));
    const pid_t process = run.wait_for(2);
    REQUIRE(process > 0);
    REQUIRE(run.writes(kept));
    kill(process, SIGKILL);
    const CommandResult result = run_bounded(run);
    CHECK(result.status == 1);
    CHECK_THAT(result.err, Contains("bvhrender: rank 2 (process " + std::to_string(process)) && Contains("was lost"));
    CHECK_THAT(result.err, !Contains("--lossy-ranks"));
  }
  parts.render_whole("whole.png", samples);
  std::filesystem::remove(out);
  MpiRun run(under_mpirun(3, words));
  const pid_t process = run.wait_for(1);
  REQUIRE(process > 0);
  CHECK_FALSE(run.mpirun().ends_within(milliseconds(700)));
  kill(process, SIGSTOP);
  CHECK_FALSE(run.mpirun().ends_within(milliseconds(1000)));
  kill(process, SIGCONT);
  const CommandResult result = run_bounded(run);
  INFO(result.err);
  CHECK(result.status == 0);
  CHECK(read_file(out) == read_file(parts.folder / "whole.png"));
}

TEST_CASE("bvhrender of parts: two network spaces joined by a virtual cable") {
  if (skip_without(mpirun(), "network spaces of parts")) return;
  const PartFolder parts(2);
  parts.render_whole("whole.png");
  const std::string out = parts.folder / "parts.png";
  const CommandResult result = run_bounded(
      Words{HIPRT_NETWORK_SPACES, mpirun(), kBvhRender, parts.manifest(), "-o", out} + PartFolder::picture());
  if (result.status == 77) {
    std::puts("SKIPPED: network spaces of parts: this machine does not permit them");
    return;
  }
  INFO(result.err);
  CHECK(result.status == 0);
  CHECK(read_file(out) == read_file(parts.folder / "whole.png"));
}

TEST_CASE("bvhrender of parts: wrong options and files are told") {
  const PartFolder parts(2);
  const std::string out = parts.folder / "out.png";
  const auto fails = [&](const Words& words, int status, const std::string& word) {
    const CommandResult result = render(words + Words{"-o", out});
    INFO(result.err);
    CHECK(result.status == status);
    CHECK_THAT(result.err, Contains(word));
    CHECK_FALSE(std::filesystem::exists(out));
  };
  const Words path = PartFolder::picture();
  fails({parts.manifest()}, 1, "p.json is a scene in parts: only --integrator path renders it");
  fails(Words{parts.manifest(), "--lossy-ranks"} + path, 1, "so --lossy-ranks cannot go on");
  fails(Words{parts.manifest(), "--broadcast"} + path, 1, "--broadcast has none to send");
  fails(Words{parts.manifest(), "--materials", parts.scene} + path, 1, "--materials: a scene in parts has");
  fails(Words{parts.manifest(), "--ray-memory", "64"} + path, 1, "--ray-memory is too small for 1 threads and 1 ranks");
  fails(Words{parts.manifest(), "--ray-memory", "x"} + path, 2, "--ray-memory");
  fails(Words{parts.scene} + path, 1, "format: 'hiprt scene'; expected 'hiprt parts'");
  json manifest = json::parse(read_file(parts.manifest()));
  manifest["levels"] = 1;
  parts.folder.write("parts/q.json", manifest.dump());
  fails(Words{parts.folder / "parts/q.json"} + path, 1, "levels of instances, the manifest says 1 to 1");
  manifest["levels"] = 33;
  parts.folder.write("parts/q.json", manifest.dump());
  fails(Words{parts.folder / "parts/q.json"} + path, 1, "33 levels of instances, the limit is 32");
  // Data of another part.
  manifest = json::parse(read_file(parts.manifest()));
  manifest["parts"][0]["data"] = manifest["parts"][1]["data"];
  parts.folder.write("parts/q.json", manifest.dump());
  fails(Words{parts.folder / "parts/q.json"} + path, 1, "p.1.data: ");
}

TEST_CASE("bvhbuild --parts: a report, the same bytes again, and errors") {
  const TempFolder folder;
  const std::string scene = write_scene(folder), out = folder / "p.json";
  const CommandResult result = bvhbuild({scene, "-o", out, "--parts", "3", "--json"});
  INFO(result.err);
  REQUIRE(result.status == 0);
  CHECK(result.err.empty());
  const json told = json::parse(result.out);
  CHECK(told.at("parts").size() == 3);
  CHECK(told.at("levels") == 2);
  CHECK(told.at("materials") == true);
  CHECK(told.at("shared").at("instances") == 7);
  const json manifest = json::parse(read_file(out));
  for (unsigned i = 0; i < 3; ++i) {
    const std::string name = "p." + std::to_string(i);
    CHECK(manifest.at("parts")[i].at("bvh").at("name") == name + ".bvh");
    CHECK(std::filesystem::file_size(folder / (name + ".bvh")) == manifest.at("parts")[i].at("bvh").at("bytes"));
    CHECK(std::filesystem::file_size(folder / (name + ".data")) == manifest.at("parts")[i].at("data").at("bytes"));
  }
  const std::string before = read_file(out);
  build_well({scene, "-o", out, "--parts", "3", "--threads", "1"});
  CHECK(read_file(out) == before);
  CHECK_THAT(bvhbuild({scene, "-o", out, "--parts", "2", "--stats"}).out, Contains("2 parts of "));
  const auto fails = [&](const Words& words, int status, const std::string& word) {
    const CommandResult bad = bvhbuild(words);
    INFO(bad.err);
    CHECK(bad.status == status);
    CHECK_THAT(bad.err, Contains(word));
  };
  fails({scene, "-o", folder / "p.bvh", "--parts", "2"}, 2, "--output has to end with .json");
  fails({scene, "-o", out, "--parts", "0"}, 2, "--parts");
  fails({scene, "-o", out, "--parts", "65537"}, 2, "--parts");
  fails({scene, "-o", out, "--parts", "2", "--flatten"}, 2, "--parts");
  fails({folder / "ball.obj", "-o", out, "--parts", "2"}, 2, "--parts takes a scene of instances");
  fails({scene, "-o", out, "--parts", "999"}, 1, "999 parts need as many instances");
  fails({scene, "-o", scene, "--parts", "2"}, 1, "scene.json");
  fails({scene, "-o", folder / "none/p.json", "--parts", "2"}, 1, "there is no folder");
}

TEST_CASE("bvhbuild --parts: on a full disk there is no manifest") {
  const TempFolder folder;
  const std::string scene = write_scene(folder), disk = folder / "disk";
  std::filesystem::create_directory(disk);
  // A disk of 16 KiB in a space of mounts that ends with the shell.
  const std::string mount = "mount -t tmpfs -o size=16k tmpfs '" + disk + "'";
  if (run({"/usr/bin/unshare", "-m", "/bin/sh", "-c", mount}).status != 0) {
    std::puts("SKIPPED: parts on a full disk: tmpfs cannot be mounted here");
    return;
  }
  const CommandResult result = run({"/usr/bin/unshare", "-m", "/bin/sh", "-c",
                                    mount + " && { '" + kBvhBuild + "' '" + scene + "' -o '" + disk +
                                        "/p.json' --parts 3; echo status $?; ls '" + disk + "'; }"});
  INFO(result.out << result.err);
  CHECK_THAT(result.out, Contains("status 1"));
  CHECK_THAT(result.err, Contains("No space left"));
  CHECK_THAT(result.out, !Contains("p.json"));
}
