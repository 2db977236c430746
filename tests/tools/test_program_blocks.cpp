/// bvhtrace in blocks and under mpirun: the files are those of one process that traces all rays at once.

#include "mpi_run.h"
#include "programs.h"

#include <hiprt_build/build.h>
#include <hiprt_build/file.h>
#include <hiprt_build/instances.h>
#include <tests/amount.h>
#include <tests/oracle/random.h>
#include <tools/cli/trace/block_journal.h>
#include <tools/scene_io/ray_stream.h>
#include <tools/scene_io/rays_file.h>

#include <tests/catch.h>
#include <nlohmann/json.hpp>

#include <csignal>
#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using std::chrono::milliseconds;

namespace {

const std::string& mpirun() {
  static const std::string path = find_mpirun(kBvhTrace);
  return path;
}

std::vector<Ray> random_rays(std::size_t count) {
  oracle::Random random(20261127);
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    ray.origin = {random.uniform_float(-1, 4), random.uniform_float(-1, 4), 3};
    ray.direction = {random.uniform_float(-0.2, 0.2), random.uniform_float(-0.2, 0.2), -1};
    ray.tmin = 0.0f;
    ray.tmax = std::numeric_limits<float>::infinity();
  }
  return rays;
}

/// Three instances of a square of two triangles, as s.bvh, and rays, as r.rays.
void write_inputs(const TempFolder& folder, std::size_t rays) {
  const std::vector<build::Position> corners{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const std::vector<build::Triangle> triangles{{0, 1, 2}, {0, 2, 3}};
  const build::TriangleMesh mesh{.positions = corners, .triangles = triangles};
  const auto object = build::build({&mesh, 1});
  REQUIRE(object.has_value());
  std::vector<build::Instance> instances(3);
  for (std::uint32_t i = 0; i < 3; ++i) {
    instances[i].id = 10 + i;
    instances[i].to_scene.row[0][3] = static_cast<float>(i);
  }
  const std::span<const std::byte> file = object->buffer.bytes();
  const auto scene = build::build_instances({&file, 1}, instances);
  REQUIRE(scene.has_value());
  REQUIRE(build::write_file(folder / "s.bvh", scene->buffer.bytes()).has_value());
  REQUIRE(tools::write_rays(folder / "r.rays", false, random_rays(rays)).has_value());
}

/// bvhtrace on these files.
Words trace(const TempFolder& folder, const std::string& name, const Words& more = {}) {
  return Words{kBvhTrace,   folder / "s.bvh",
               "--rays",    folder / "r.rays",
               "--hits",    folder / (name + ".hits"),
               "--paths",   folder / (name + ".paths"),
               "--threads", "1"} +
         more;
}

void check_same(const TempFolder& folder, const std::string& name) {
  CHECK(read_file(folder / (name + ".hits")) == read_file(folder / "whole.hits"));
  CHECK(read_file(folder / (name + ".paths")) == read_file(folder / "whole.paths"));
}

Words under_mpirun(unsigned ranks, const Words& words, const Words& more = {}) {
  return test::under_mpirun(mpirun(), ranks, words, more);
}

}  // namespace

TEST_CASE("bvhtrace in blocks: the bytes of all rays at once, for any size of blocks") {
  const TempFolder folder;
  for (const std::size_t rays : {0u, 1u, 1000u}) {
    write_inputs(folder, rays);
    const auto whole = nlohmann::json::parse(run(trace(folder, "whole", {"--json"})).out);
    for (const char* block : {"1", "7", "1000", "4096"}) {
      CAPTURE(rays, block);
      const CommandResult result = run(trace(folder, "blocks", {"--block", block, "--json"}));
      INFO(result.err);
      REQUIRE(result.status == 0);
      const auto told = nlohmann::json::parse(result.out);
      CHECK(told.at("rays") == rays);
      CHECK(told.at("hits") == whole.at("hits"));
      check_same(folder, "blocks");
    }
  }
  CHECK(folder.names() == Words{"blocks.hits", "blocks.paths", "r.rays", "s.bvh", "whole.hits", "whole.paths"});
  CHECK(run(trace(folder, "x", {"--block", "7", "--repeat", "2"})).status == 2);
  CHECK(run(trace(folder, "x", {"--block", "0"})).status == 2);
}

TEST_CASE("bvhtrace --resume: killed at random moments, then whole; other work is refused") {
  if (skip_kills("killed runs")) return;
  const TempFolder folder;
  write_inputs(folder, 200'000);
  run(trace(folder, "whole"));
  const std::string kept = folder / "kept";
  const Words words = trace(folder, "parts", {"--resume", kept, "--block", "1000", "--resume-every", "0"});
  const std::uint64_t seed = 20261127;
  CAPTURE(seed);
  oracle::Random random(seed);
  unsigned kills = 0;
  for (unsigned i = 0; i < 40 && !std::filesystem::exists(folder / "parts.hits"); ++i) {
    Command command(words);
    if (command.ends_within(milliseconds(20 + random.below(300)))) {
      CHECK(command.finish().status == 0);
      break;
    }
    command.signal(SIGKILL);
    if (command.finish().status != 0) ++kills;
    if (i == 3 && std::filesystem::exists(kept)) {
      const auto refuses = [&](const Words& other, const std::string& word) {
        const CommandResult result = run(other);
        CHECK(result.status == 1);
        CHECK_THAT(result.err, Contains(word));
      };
      refuses(trace(folder, "parts", {"--resume", kept, "--block", "1001"}), "block is 1000 there and 1001 here");
      refuses(trace(folder, "parts", {"--resume", kept, "--block", "1000", "--query", "any"}),
              "query is closest there");
      const std::string bytes = read_file(kept);
      folder.write("kept", bytes.substr(0, bytes.size() - 1));
      refuses(words, "damaged");
      folder.write("kept", bytes);
    }
  }
  CHECK(kills > 0);
  if (!std::filesystem::exists(folder / "parts.hits")) {
    CHECK(run(words).status == 0);
  }
  check_same(folder, "parts");
  CHECK(folder.names() == Words{"parts.hits", "parts.paths", "r.rays", "s.bvh", "whole.hits", "whole.paths"});
}

TEST_CASE("bvhtrace in blocks: faults leave nothing behind") {
  const TempFolder folder;
  write_inputs(folder, 50'000);
  // No file may become larger than 64 KiB.
  std::string line = "ulimit -f 64; exec";
  for (const std::string& word : trace(folder, "out", {"--block", "1000"})) line += " '" + word + "'";
  const CommandResult full = run({"/bin/bash", "-c", line});
  CHECK(full.status == 1);
  CHECK_THAT(full.err, Contains("out.hits.part") && Contains("File too large"));
  std::string rays = read_file(folder / "r.rays");
  folder.write("r.rays", rays.substr(0, rays.size() - 4));
  const CommandResult truncated = run(trace(folder, "out", {"--block", "1000"}));
  CHECK(truncated.status == 1);
  CHECK_THAT(truncated.err, Contains("r.rays: the header says 50000 rays"));
  CHECK(folder.names() == Words{"r.rays", "s.bvh"});
}

TEST_CASE("bvhtrace under mpirun: 1, 2, 3 and 5 ranks, a killed rank, and a resumed run") {
  if (skip_without(mpirun(), "bvhtrace under mpirun")) return;
  const TempFolder folder;
  write_inputs(folder, checks::kWorkDivisor < 25 ? 400'000 : 40'000);
  run(trace(folder, "whole"));
  for (const unsigned ranks : {1u, 2u, 3u, 5u}) {
    CAPTURE(ranks);
    MpiRun one(under_mpirun(ranks, trace(folder, "ranks", {"--block", "9999"})));
    const CommandResult result = run_bounded(one);
    INFO(result.err);
    CHECK(result.status == 0);
    CHECK(result.err.empty());
    check_same(folder, "ranks");
  }
  if (skip_kills("killed ranks of bvhtrace")) return;
  const std::string kept = folder / "kept";
  const auto kill_one = [&](const Words& more) {
    std::error_code none;
    const auto old = std::filesystem::last_write_time(kept, none);
    MpiRun three(
        under_mpirun(3, trace(folder, "killed", {"--block", "20", "--resume", kept, "--resume-every", "0"}) + more,
                     with_recovery()));
    const pid_t process = three.wait_for(1);
    REQUIRE(process > 0);
    CHECK(three.writes(kept, none ? std::filesystem::file_time_type{} : old));
    // A rank that dies while the ranks meet holds the others up for a minute. So it mostly dies later.
    CHECK_FALSE(three.mpirun().ends_within(milliseconds(500)));
    kill(process, SIGKILL);
    return run_bounded(three, std::chrono::seconds(150));
  };
  const CommandResult ended = kill_one({});
  CHECK(ended.status == 1);
  CHECK_THAT(ended.err, Contains("bvhtrace: rank 1 (process ") && Contains("was lost") && Contains("go on from"));
  CHECK_FALSE(std::filesystem::exists(folder / "killed.hits"));
  const CommandResult whole = kill_one({"--lossy-ranks"});
  INFO(whole.err);
  CHECK(whole.status == 0);
  check_same(folder, "killed");
  CHECK_FALSE(std::filesystem::exists(kept));
}

TEST_CASE("a ray file of more rays than 32 bits can count") {
  const TempFolder folder;
  const std::string path = folder.write("many.rays", std::string("\xff\xff\xff\xff\0\0\0\0", 8));
  const std::uint64_t count = (std::uint64_t{1} << 32) + 5;
  std::error_code error;
  // All rays but the last are holes of the file.
  std::filesystem::resize_file(path, 8 + count * 32, error);
  if (error) {
    std::puts("SKIPPED: more rays than 32 bits can count: the disk has no files with holes");
    return;
  }
  const float last[8] = {1, 2, 3, 4, 5, 6, 7, 8};
  std::fstream out(path, std::ios::binary | std::ios::in | std::ios::out);
  out.seekp(static_cast<std::streamoff>(8 + (count - 1) * 32));
  out.write(reinterpret_cast<const char*>(last), sizeof(last));
  out.close();
  const auto stream = tools::RayStream::open(path);
  REQUIRE(stream.has_value());
  CHECK(stream->count() == count);
  const auto rays = stream->read(count - 2, 2);
  REQUIRE(rays.has_value());
  CHECK((*rays)[0].tmax == 0.0f);
  CHECK((*rays)[1].tmax == 8.0f);
  CHECK_FALSE(stream->read(count - 1, 2).has_value());
  std::filesystem::resize_file(path, 8 + count * 32 + 1);
  CHECK_FALSE(tools::RayStream::open(path).has_value());
}

TEST_CASE("a journal of blocks comes back, and a damaged one is refused") {
  const tools::PictureKey key{{"scene", "abc"}};
  tools::BlockJournal journal{{0, 1, 1, 0, 1}, std::uint64_t{1} << 40, 2.5};
  auto bytes = encode(key, journal);
  const auto back = tools::decode_journal(bytes, key, 5);
  REQUIRE(back.has_value());
  CHECK(back->done == journal.done);
  CHECK(back->hits == journal.hits);
  CHECK(back->seconds == journal.seconds);
  CHECK_FALSE(tools::decode_journal(bytes, key, 6).has_value());
  CHECK_FALSE(tools::decode_journal(bytes, {{"scene", "abd"}}, 5).has_value());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    CHECK_FALSE(tools::decode_journal(std::span(bytes).first(i), key, 5).has_value());
    bytes[i] ^= std::byte{4};
    CHECK_FALSE(tools::decode_journal(bytes, key, 5).has_value());
    bytes[i] ^= std::byte{4};
  }
}
