/// bvhinfo --upgrade: files of older versions, written by old libraries, become files of this version.

#include "json_result.h"
#include "programs.h"

#include <hiprt_build/file.h>
#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/view.h>
#include <tools/scene_io/rays_file.h>

#include <tests/catch.h>
#include <tests/oracle/random.h>
#include <nlohmann/json.hpp>

#include <cstring>
#include <set>

using namespace hiprt;
using namespace hiprt::test;
using nlohmann::json;

namespace {

const std::filesystem::path kVersions = HIPRT_VERSIONS_FOLDER;
const std::string kNewest = std::to_string(kVersionMajor) + "." + std::to_string(kVersionMinor);

/// A file in memory, aligned as views need it.
build::Buffer file_of(const std::string& content) {
  build::Buffer buffer(content.size());
  std::memcpy(buffer.bytes().data(), content.data(), content.size());
  return buffer;
}

/// The header of the file at @p offset in @p content, which may be an object's.
FileHeader header_at(const std::string& content, std::size_t offset) {
  FileHeader header;
  std::memcpy(&header, content.data() + offset, sizeof(header));
  return header;
}

/// Where the files of a scene begin: its own, and those of its objects.
std::set<std::size_t> file_offsets(const std::string& content) {
  const build::Buffer buffer = file_of(content);
  const auto view = open_buffer(buffer.bytes());
  REQUIRE(view);
  std::set<std::size_t> offsets{0};
  for (const ObjectRecord& object : view->objects) offsets.insert(object.offset);
  return offsets;
}

/// The content without what an upgrade changes: minor versions and checksums.
std::string unversioned(std::string content) {
  for (const std::size_t offset : file_offsets(content)) {
    std::memset(content.data() + offset + offsetof(FileHeader, version_minor), 0, sizeof(FileHeader::version_minor));
    std::memset(content.data() + offset + offsetof(FileHeader, checksum), 0, sizeof(FileHeader::checksum));
  }
  return content;
}

/// Writes @p minor into the file at @p offset, with checksums that fit.
std::string with_minor(const std::string& content, std::size_t offset, std::uint16_t minor) {
  const build::Buffer all = file_of(content);
  const auto view = open_buffer(all.bytes());
  build::Buffer buffer = file_of(content);
  const auto seal = [&](std::size_t at, std::size_t size) {
    const std::span<std::byte> file = buffer.bytes().subspan(at, size);
    const std::uint64_t sum = file_checksum(file);
    std::memcpy(file.data() + offsetof(FileHeader, checksum), &sum, sizeof(sum));
  };
  std::memcpy(buffer.bytes().data() + offset + offsetof(FileHeader, version_minor), &minor, sizeof(minor));
  for (const ObjectRecord& object : view->objects) seal(object.offset, object.size);
  seal(0, content.size());
  return {reinterpret_cast<const char*>(buffer.bytes().data()), buffer.size()};
}

/// Rays down onto the scenes of tests/format/versions, at times from 0 to 1.
std::string write_down_rays(const TempFolder& folder) {
  oracle::Random random(34);
  std::vector<Ray> rays(3000);
  for (Ray& ray : rays) {
    // Half of them at the object at the origin, the others at instances too.
    const bool near = random.below(2) == 0;
    const float x = near ? random.uniform_float(0, 7) : random.uniform_float(-25, 40);
    const float y = near ? random.uniform_float(0, 4) : random.uniform_float(-5, 130);
    ray.origin = {x, y, 20};
    ray.direction = {0, 0, -1};
    ray.time = random.uniform_float(0, 1);
  }
  std::string path = folder / "down.rays";
  REQUIRE(tools::write_rays(path, false, rays));
  return path;
}

}  // namespace

TEST_CASE("Programs: bvhinfo --upgrade changes versions and checksums, and no other byte") {
  const TempFolder folder;
  std::size_t upgraded = 0;
  const std::string out = folder / "out.bvh";
  for (unsigned minor = 0; minor < kVersionMinor; ++minor)
    for (const char* name : {"quantized", "split", "nested", "motion", "shape_instances"}) {
      const std::filesystem::path in = kVersions / ("1." + std::to_string(minor)) / (std::string(name) + ".bvh");
      if (!std::filesystem::exists(in)) continue;
      INFO(in);
      const CommandResult result = run({kBvhInfo, "--upgrade", in, out});
      check_good(result);
      CHECK(result.out ==
            in.string() + ": version 1." + std::to_string(minor) + "; " + out + " has version " + kNewest + "\n");
      const std::string before = read_file(in), after = read_file(out);
      CHECK(unversioned(before) == unversioned(after));
      for (const std::size_t offset : file_offsets(after))
        CHECK(header_at(after, offset).version_minor == kVersionMinor);
      check_good(run({kBvhInfo, "--validate", out}));
      ++upgraded;
    }
  CHECK(upgraded == 5 * kVersionMinor - 8u);
  CHECK(folder.names() == std::vector<std::string>{"out.bvh"});
}

TEST_CASE("Programs: hits in upgraded files are those of the old ones, bit for bit") {
  const TempFolder folder;
  const std::string rays = write_down_rays(folder), out = folder / "out.bvh";
  for (const char* name : {"1.0/float", "1.1/half", "1.2/motion", "1.3/shape_instances", "1.4/nested", "1.4/motion"}) {
    INFO(name);
    const std::string in = (kVersions / (std::string(name) + ".bvh")).string();
    check_good(run({kBvhInfo, "--upgrade", in, out}));
    const auto hits_of = [&](const std::string& bvh) {
      const std::string hits = folder / "hits";
      const CommandResult traced = run({kBvhTrace, bvh, "--rays", rays, "--hits", hits});
      check_good(traced);
      CHECK_THAT(traced.out, !Catch::Contains(" 0 hits"));
      return read_file(hits);
    };
    CHECK(hits_of(in) == hits_of(out));
  }
}

TEST_CASE("Programs: bvhinfo --upgrade says that a file has the newest version, and copies it") {
  const TempFolder folder;
  const std::string first = folder / "first.bvh", second = folder / "second.bvh";
  check_good(run({kBvhInfo, "--upgrade", kVersions / "1.3/instances.bvh", first}));
  const CommandResult again = run({kBvhInfo, "--upgrade", first, second});
  check_good(again);
  CHECK(again.out == first + ": has the newest version, " + kNewest + ", already; " + second + " is a copy\n");
  CHECK(read_file(first) == read_file(second));
  json report = json_of(run({kBvhInfo, "--upgrade", first, second, "--json"}));
  CHECK(report == json{{"file", second},
                       {"from", {kVersionMajor, kVersionMinor}},
                       {"version", {kVersionMajor, kVersionMinor}},
                       {"upgraded", false}});
  // One old object is enough.
  const std::string content = read_file(first);
  const std::string mixed = folder.write("mixed.bvh", with_minor(content, *file_offsets(content).rbegin(), 2));
  report = json_of(run({kBvhInfo, "--upgrade", mixed, second, "--json"}));
  CHECK(report["upgraded"] == true);
  CHECK(report["from"] == json{1, 2});
  CHECK(read_file(second) == content);
}

TEST_CASE("Programs: bvhinfo --upgrade replaces a file as a whole, and no file after an error") {
  const TempFolder folder;
  const std::string good = (kVersions / "1.3/instances.bvh").string(), out = folder / "out.bvh";
  const std::string content = read_file(good);
  const auto fails = [&](const std::string& input, const std::string& output, const std::string& word) {
    check_failure(folder, {kBvhInfo, "--upgrade", input, output}, word, folder.names());
  };
  fails(folder / "none.bvh", out, "none.bvh");
  fails(folder.write("text.bvh", "no BVH file"), out, "not a valid BVH file");
  std::string damaged = content;
  damaged[damaged.find("write_files")] ^= 1;
  fails(folder.write("damaged.bvh", damaged), out, "the file was changed or damaged");
  fails(folder.write("short.bvh", content.substr(0, content.size() - 1)), out, "short.bvh");
  const std::string own = folder.write("own.bvh", content);
  fails(own, own, "the output is one of the inputs");
  std::filesystem::create_hard_link(own, folder / "link.bvh");
  fails(own, folder / "link.bvh", "the output is one of the inputs");
  fails(good, folder.path().string(), "it is a directory");
  fails(good, folder / "no/out.bvh", "there is no folder");
  const std::uint16_t future = kVersionMinor + 1;
  const std::string limit = ", and this program knows versions up to " + kNewest;
  fails(folder.write("new.bvh", with_minor(content, 0, future)), out,
        "new.bvh: has version 1." + std::to_string(future) + limit);
  fails(folder.write("new_object.bvh", with_minor(content, *file_offsets(content).rbegin(), future)), out,
        "new_object.bvh: an object in it has version 1." + std::to_string(future) + limit);
  // An old output stays after an error, and is replaced else.
  folder.write("out.bvh", "old");
  fails(folder / "damaged.bvh", out, "damaged.bvh");
  CHECK(read_file(out) == "old");
  check_good(run({kBvhInfo, "--upgrade", good, out}));
  CHECK(read_file(out).size() == content.size());
}

TEST_CASE("Programs: bvhinfo --upgrade needs both files, and excludes other outputs") {
  const std::string in = (kVersions / "1.3/float.bvh").string();
  for (const std::vector<std::string>& words : {std::vector<std::string>{in, "out.bvh"},
                                                {"--upgrade", in},
                                                {"--upgrade", in, "out.bvh", "--dump"},
                                                {"--upgrade", in, "out.bvh", "--export", "tree.json"},
                                                {"--upgrade", in, "out.bvh", "more.bvh"}}) {
    std::vector<std::string> command{kBvhInfo};
    command.insert(command.end(), words.begin(), words.end());
    const CommandResult result = run(command);
    INFO(result.err);
    CHECK(result.status == 2);
    CHECK(result.out.empty());
  }
}
