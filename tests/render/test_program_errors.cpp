/// Errors of bvhrender: exit status, a message of one line, and no unfinished picture.

#include "renderer.h"

#include <hiprt_build/format/view.h>
#include <tools/cli/bvh_file.h>

#include <algorithm>

#include <sys/stat.h>

using namespace hiprt::test;
using Catch::Contains;

namespace {

using Names = std::vector<std::string>;

void check_one_line(const CommandResult& result, int status, const std::string& word) {
  INFO(result.out << result.err);
  CHECK(result.status == status);
  CHECK(result.out.empty());
  CHECK_THAT(result.err, Catch::StartsWith("bvhrender: ") && Contains(word));
  CHECK(std::count(result.err.begin(), result.err.end(), '\n') == 1);
}

void check_usage_error(const std::vector<std::string>& arguments, const std::string& word) {
  const CommandResult result = render(arguments);
  check_one_line(result, 2, word);
  CHECK_THAT(result.err, Contains("--help"));
}

/// A failure that leaves only @p names in the folder.
void check_failure(const TempFolder& folder, const std::vector<std::string>& arguments, const std::string& word,
                   const Names& names) {
  check_one_line(render(arguments), 1, word);
  CHECK(folder.names() == names);
}

}  // namespace

TEST_CASE("bvhrender: --help shows examples, --version the version") {
  const std::string help = render_well({"--help"});
  CHECK_THAT(help, Contains("Examples:\n  bvhrender ") && Contains("--json") && Contains("Exit status"));
  for (const char* option : {"--output", "--size", "--spp", "--camera", "--mode", "--threads", "--seed"})
    CHECK_THAT(help, Contains(option));
  CHECK_THAT(render_well({"--version"}),
             Catch::Matches("bvhrender [0-9]+\\.[0-9]+\\.[0-9]+\nGPU code: .+\nEmbree: .+\nMPI: .+\nassimp: .+\n"));
}

TEST_CASE("bvhrender: bad usage is status 2, before any file is read") {
  check_usage_error({}, "required");
  check_usage_error({"none.bvh"}, "--output");
  check_usage_error({"none.bvh", "more.bvh", "-o", "a.png"}, "more.bvh");
  check_usage_error({"none.bvh", "-o", "a.jpg"}, "neither in .exr nor in .png");
  check_usage_error({"none.bvh", "-o", "png"}, "neither in .exr nor in .png");
  check_usage_error({"none.bvh", "-o", "a.png", "--frobnicate"}, "--frobnicate");
  const auto refuses = [](const std::string& option, const std::vector<std::string>& values) {
    for (const std::string& value : values) {
      INFO(option << " " << value);
      check_usage_error({"none.bvh", "-o", "a.png", option, value}, option);
    }
  };
  refuses("--size", {"", "640", "x480", "640x", "640x480x2", "0x10", "10x0", "-5x5", "32769x1", "32768x4097", "1e3x10",
                     " 8x8", "99999999999x1"});
  refuses("--spp", {"0", "-1", "65537", "many", "1.5"});
  refuses("--mode", {"", "AO", "path"});
  refuses("--threads", {"-1", "4097", "two"});
  refuses("--seed", {"-1", "x", "4294967296"});
  refuses("--ao-distance", {"0", "-1", "nan", "far"});
  refuses("--camera", {"0,0,4/0,0,0/0,1,0", "0,0/0,0,0/0,1,0/40", "0,0,4/0,0,0/0,1,0/0", "0,0,4/0,0,0/0,1,0/180",
                       "0,0,4/0,0,4/0,1,0/40", "0,0,4/0,0,0/0,0,1/40", "0,0,4/0,0,0/0,0,0/40", "0,0,x/0,0,0/0,1,0/40",
                       "0,0,inf/0,0,0/0,1,0/40"});
  check_usage_error({"none.bvh", "-o", "a.png", "--camera", "0,0/0,0,0/0,1,0/40"}, "eye: expected 3 numbers, got 2");
}

TEST_CASE("bvhrender: scenes that cannot be read or are damaged are failures that leave no file") {
  const TempFolder folder;
  const std::string whole = read_file(write_squares(folder));
  const auto refuses = [&](const std::string& bytes, const std::string& word) {
    const std::string bad = folder.write("bad.bvh", bytes);
    check_failure(folder, {bad, "-o", folder / "a.png", "-o", folder / "a.exr"}, word, {"bad.bvh", "s.bvh"});
  };
  refuses("", "empty");
  refuses("HIPRTBVH", "TooSmall");
  refuses(std::string(4096, 'x'), "BadMagic");
  refuses(whole.substr(0, whole.size() - 128), "SizeMismatch");
  std::string flipped = whole;
  flipped.back() = static_cast<char>(flipped.back() ^ 0x10);
  refuses(flipped, "BadChecksum");
  check_failure(folder, {folder / "none.bvh", "-o", folder / "a.png"}, "none.bvh", {"bad.bvh", "s.bvh"});
  check_failure(folder, {folder.path(), "-o", folder / "a.png"}, "directory", {"bad.bvh", "s.bvh"});
}

TEST_CASE("bvhrender: a camera file that cannot be read or makes no sense is a failure with its name") {
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  const auto refuses = [&](const std::string& camera, const std::string& word, const Names& names) {
    check_failure(folder, {scene, "-o", folder / "a.png", "--camera", camera}, word, names);
  };
  refuses(folder / "none.cam", "none.cam", {"s.bvh"});
  refuses(folder.write("bad.cam", "eye 0 0 / at 0 0 0 / up 0 1 0 / fov 40"), "bad.cam: eye: expected 3 numbers, got 2",
          {"bad.cam", "s.bvh"});
  refuses(folder.write("bad.cam", ""), "bad.cam", {"bad.cam", "s.bvh"});
  refuses(folder.write("bad.cam", std::string(100000, '\0')), "bad.cam", {"bad.cam", "s.bvh"});
  refuses(scene, "s.bvh", {"bad.cam", "s.bvh"});
  std::filesystem::create_directory(folder / "folder.cam");
  refuses(folder / "folder.cam", "folder.cam", {"bad.cam", "folder.cam", "s.bvh"});
  REQUIRE(::mkfifo((folder / "fifo.cam").c_str(), 0600) == 0);
  refuses(folder / "fifo.cam", "not a regular file", {"bad.cam", "fifo.cam", "folder.cam", "s.bvh"});
}

TEST_CASE("bvhrender: pictures that cannot be written are failures that leave no file") {
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  const Names before{"folder.exr", "folder.png", "s.bvh"};
  std::filesystem::create_directory(folder / "folder.png");
  std::filesystem::create_directory(folder / "folder.exr");
  // Known before any ray is traced, so that the other picture is not written either.
  check_failure(folder, {scene, "-o", folder / "a.png", "-o", folder / "no/such/b.png"}, "no/such/b.png", before);
  check_failure(folder, {scene, "-o", folder / "a.png", "-o", folder / "folder.png"}, "folder.png", before);
  check_failure(folder, {scene, "-o", folder / "folder.exr"}, "folder.exr", before);
  check_failure(folder, {scene, "-o", "/proc/a.png", "--size", "8x8"}, "/proc/a.png", before);
  // A scene whose name ends like a picture's must not be overwritten.
  const std::string odd = write_squares(folder, "scene.png"), bytes = read_file(odd);
  const Names with_odd{"folder.exr", "folder.png", "s.bvh", "scene.png"};
  check_failure(folder, {odd, "-o", odd}, "one of the inputs", with_odd);
  check_failure(folder, {odd, "-o", folder / "folder.png/../scene.png"}, "one of the inputs", with_odd);
  CHECK(read_file(odd) == bytes);
}

TEST_CASE(
    "bvhrender: a tree too deep for its stack, instances in too many others, and custom primitives are refused with "
    "the reason") {
  hiprt::FileHeader header{};
  hiprt::BufferView view;
  view.header = &header;
  header.stack_bound = 8193;
  const auto deep = hiprt::tools::check_traceable("deep.bvh", view);
  REQUIRE_FALSE(deep);
  CHECK(deep.error().message == "deep.bvh: 8193 stack entries needed, the limit is 8192");
  header.stack_bound = 8192;
  CHECK(hiprt::tools::check_traceable("deep.bvh", view));
  header.levels = 33;
  const auto nested = hiprt::tools::check_traceable("dolls.bvh", view);
  REQUIRE_FALSE(nested);
  CHECK(nested.error().message == "dolls.bvh: 33 levels of instances, the limit is 32");
  header.levels = 32;
  CHECK(hiprt::tools::check_traceable("dolls.bvh", view));
  header.features = hiprt::feature_bit(hiprt::Feature::kTriangles) | hiprt::feature_bit(hiprt::Feature::kCustom);
  const hiprt::GeometryRecord balls{0, 1, 0, 0xffffffffu, hiprt::custom_geometry_flags(0)};
  view.geometries = {&balls, 1};
  const auto custom = hiprt::tools::check_traceable("balls.bvh", view);
  REQUIRE_FALSE(custom);
  CHECK_THAT(custom.error().message, Catch::Contains("balls.bvh: has custom primitives"));
}

TEST_CASE("bvhrender: a scene that the automatic camera cannot show needs --camera") {
  const TempFolder folder;
  const std::vector<hiprt::build::Position> positions{{-3e38f, 0, 0}, {3e38f, 0, 0}, {0, 3e38f, 0}};
  const std::vector<hiprt::build::Triangle> triangles{{0, 1, 2}};
  const auto bvh = hiprt::build::build(std::vector<hiprt::build::TriangleMesh>{{positions, triangles}});
  REQUIRE(bvh.has_value());
  REQUIRE(hiprt::build::write_file(folder / "s.bvh", bvh->buffer.bytes()));
  check_failure(folder, {folder / "s.bvh", "-o", folder / "a.png"}, "--camera", {"s.bvh"});
}

TEST_CASE("bvhrender: a picture is replaced as a whole") {
  const TempFolder folder;
  const std::string scene = write_squares(folder), picture = folder.write("a.png", "old");
  check_failure(folder, {folder / "none.bvh", "-o", picture}, "none.bvh", {"a.png", "s.bvh"});
  CHECK(read_file(picture) == "old");
  render_well({scene, "-o", picture, "--size", "8x8", "--spp", "1"});
  CHECK(read_file(picture).substr(1, 3) == "PNG");
  CHECK(folder.names() == Names{"a.png", "s.bvh"});
}

TEST_CASE("bvhrender: an interrupted run says so, fails and leaves the old picture") {
  const TempFolder folder;
  const std::string scene = write_squares(folder), picture = folder.write("a.png", "old");
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    // Hours of work, so that it cannot have ended; the signal may arrive before the program waits for it.
    bool said = false;
    for (const int delay : {100, 400, 2000, 8000}) {
      Command command({kBvhRender, scene, "-o", picture, "--spp", "65536", "--size", "512x512"});
      REQUIRE_FALSE(command.ends_within(std::chrono::milliseconds(delay)));
      command.signal(signal);
      const CommandResult result = command.finish();
      CHECK(read_file(picture) == "old");
      CHECK(folder.names() == Names{"a.png", "s.bvh"});
      if (result.status == 128 + signal) continue;
      CHECK(result.status == 1);
      CHECK(result.out.empty());
      CHECK(result.err == "bvhrender: cancelled, nothing was written\n");
      said = true;
      break;
    }
    CHECK(said);
  }
}

TEST_CASE("bvhrender: output that cannot be printed is a failure") {
  const CommandResult result = run({"/bin/sh", "-c", "'" + kBvhRender + "' --help > /dev/full"});
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Contains("standard output"));
}
