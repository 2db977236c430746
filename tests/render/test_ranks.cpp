/// bvhrender under mpirun: the picture is that of one process, or there is a clear error, in bounded time.

#include "renderer.h"

#include <tests/amount.h>
#include <tests/oracle/random.h>
#include <tests/tools/mpi_run.h>

#include <nlohmann/json.hpp>

#include <csignal>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

const std::string& mpirun() {
  static const std::string path = find_mpirun(kBvhRender);
  return path;
}

/// @param more options of mpirun.
Words under_mpirun(unsigned ranks, const Words& program, const Words& more = {}) {
  return test::under_mpirun(mpirun(), ranks, Words{kBvhRender} + program, more);
}

/// A picture without outputs. @param seconds that it takes about, on one core.
Words picture(const std::string& scene, bool paths, unsigned seconds = 0) {
  const std::string samples = std::to_string(seconds == 0 ? 5 : (paths ? 40 : 80) * seconds);
  return Words{scene, "--size", "203x131", "--camera", "0.3,0.4,3/0,0,0/0,1,0/40", "--spp", samples, "--threads", "1"} +
         (paths ? Words{"--integrator", "path"} : Words{"--mode", "ao"});
}

void check_whole(const CommandResult& result, const std::filesystem::path& found,
                 const std::filesystem::path& expected) {
  INFO(result.out << result.err);
  CHECK(result.status == 0);
  REQUIRE(std::filesystem::exists(found));
  CHECK(read_file(found) == read_file(expected));
}

}  // namespace

TEST_CASE("bvhrender under mpirun: 1, 2, 3 and 5 ranks write the bytes of one process") {
  if (skip_without(mpirun(), "bvhrender under mpirun")) return;
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  checks::Sample sample(3);
  for (const bool paths : {false, true})
    for (const std::string end : {".exr", ".png"}) {
      const Words words = picture(scene, paths);
      render_well(words + Words{"-o", folder / ("alone" + end)});
      for (const unsigned ranks : {1u, 2u, 3u, 5u}) {
        if (!sample.next()) continue;
        CAPTURE(paths, end, ranks);
        const std::string out = folder / ("ranks" + std::to_string(ranks) + end);
        const CommandResult result = run_bounded(under_mpirun(ranks, words + Words{"-o", out, "--json"}));
        check_whole(result, out, folder / ("alone" + end));
        // Quiet in a pipe: no progress, no warnings.
        CHECK(result.err.empty());
        const auto told = nlohmann::json::parse(result.out);
        CHECK(told.at("ranks") == ranks);
        CHECK(told.at("spp") == 5);
        if (paths || end == ".png") {
          CHECK(told.at("primary_rays") == 203 * 131 * 5);
        }
      }
    }
}

TEST_CASE("bvhrender under mpirun: the other modes") {
  if (skip_without(mpirun(), "the other modes under mpirun")) return;
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  for (const std::string mode : {"heatmap", "bvh", "normals", "primary"}) {
    CAPTURE(mode);
    const Words words{scene, "--size", "75x41", "--mode", mode, "--spp", "3"};
    render_well(words + Words{"-o", folder / "alone.exr"});
    check_whole(run_bounded(under_mpirun(2, words + Words{"-o", folder / "ranks.exr"})), folder / "ranks.exr",
                folder / "alone.exr");
  }
}

TEST_CASE("bvhrender under mpirun: a rank that is killed at a random moment") {
  if (skip_without(mpirun(), "killed ranks") || skip_kills("killed ranks")) return;
  const std::uint64_t seed = 20261127;
  CAPTURE(seed);
  oracle::Random random(seed);
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  for (const bool paths : {false, true})
    render_well(picture(scene, paths, 1) + Words{"-o", folder / (paths ? "path.exr" : "ao.exr")});
  unsigned survived = 0, ended = 0;
  // A rank that dies while the ranks meet holds the others up for a minute: only the full set tries that.
  const bool full = checks::kWorkDivisor == 1;
  const unsigned kills = full ? 100 : 4;
  for (unsigned i = 0; i < kills; ++i) {
    const bool paths = (i & 1u) != 0, lossy = (i & 2u) != 0;
    const unsigned victim = random.below(3), moment = full ? random.below(1500) : 500 + random.below(1000);
    CAPTURE(i, paths, lossy, victim, moment);
    const std::filesystem::path out = folder / "out.exr";
    std::filesystem::remove(out);
    Words words = picture(scene, paths, 1) + Words{"-o", out};
    if (lossy) words.push_back("--lossy-ranks");
    MpiRun run(under_mpirun(3, words, lossy ? with_recovery() : Words{}));
    const pid_t process = run.wait_for(static_cast<int>(victim));
    if (!run.mpirun().ends_within(milliseconds(moment)) && process > 0) kill(process, SIGKILL);
    const CommandResult result = run_bounded(run, seconds(90));
    INFO(result.out << result.err);
    // What is written is whole, whatever happened.
    if (std::filesystem::exists(out)) {
      CHECK(read_file(out) == read_file(folder / (paths ? "path.exr" : "ao.exr")));
    }
    if (std::filesystem::exists(out) && result.status == 0) {
      ++survived;
    } else {
      ++ended;
      CHECK_FALSE(result.err.empty());
      // Before the ranks have met no run can go on, and never without rank 0.
      if (lossy && victim != 0) {
        CHECK_THAT(result.err, Contains("MPI did not start"));
      }
    }
    CHECK(folder.names().size() <= 4);
  }
  std::printf("killed ranks: %u pictures whole, %u clear ends\n", survived, ended);
  // On a slow machine all of a few kills may come while the ranks meet.
  if (full) {
    CHECK(survived > 0);
    CHECK(ended > 0);
  }
}

TEST_CASE("bvhrender under mpirun: a lost rank ends the run with its name, and --lossy-ranks goes on") {
  if (skip_without(mpirun(), "lost ranks") || skip_kills("lost ranks")) return;
  const TempFolder folder;
  const std::string scene = write_squares(folder), kept = folder / "kept";
  const Words words =
      picture(scene, false, 5) + Words{"-o", folder / "out.exr", "--resume", kept, "--resume-every", "0"};
  const auto kill_one = [&](const Words& more) {
    std::error_code none;
    const auto old = std::filesystem::last_write_time(kept, none);
    MpiRun run(under_mpirun(3, words + more, with_recovery()));
    const pid_t process = run.wait_for(1);
    REQUIRE(process > 0);
    CHECK(run.writes(kept, none ? std::filesystem::file_time_type{} : old));
    kill(process, SIGKILL);
    CommandResult result = run_bounded(run);
    return std::pair(result, "rank 1 (process " + std::to_string(process));
  };
  const auto [ended, name] = kill_one({});
  // Newer ones make a status of their own.
  CHECK((ended.status == 1 || (has_new_mpirun() && ended.status != 0)));
  CHECK_THAT(ended.err, Contains("bvhrender: " + name) && Contains("was lost") && Contains("--lossy-ranks") &&
                            Contains("to go on from " + kept));
  CHECK(std::filesystem::exists(kept));
  CHECK_FALSE(std::filesystem::exists(folder / "out.exr"));
  // It goes on from what was kept, loses a rank again, and comes to its end.
  const auto [whole, second] = kill_one({"--lossy-ranks"});
  CHECK_THAT(whole.err, Contains("warning: " + second) && Contains("the run goes on without it"));
  render_well(picture(scene, false, 5) + Words{"-o", folder / "alone.exr"});
  check_whole(whole, folder / "out.exr", folder / "alone.exr");
  CHECK_FALSE(std::filesystem::exists(kept));
}

// A rank that has just died can be written to once more, which raises SIGPIPE.
TEST_CASE("bvhrender under mpirun: SIGPIPE ends no rank") {
  if (skip_without(mpirun(), "SIGPIPE") || skip_kills("SIGPIPE")) return;
  const TempFolder folder;
  const std::string scene = write_squares(folder), kept = folder / "kept";
  const Words words = picture(scene, true, 2);
  render_well(words + Words{"-o", folder / "alone.exr"});
  MpiRun run(under_mpirun(3, words + Words{"-o", folder / "out.exr", "--resume", kept, "--resume-every", "0"}));
  REQUIRE(run.wait_for(1) > 0);
  CHECK(run.writes(kept));
  for (const int rank : {0, 1})
    for (const pid_t process : run.processes(rank)) kill(process, SIGPIPE);
  check_whole(run_bounded(run), folder / "out.exr", folder / "alone.exr");
}

TEST_CASE("bvhrender under mpirun: a rank that stands still for a second") {
  if (skip_without(mpirun(), "delayed ranks") || skip_kills("delayed ranks")) return;
  const TempFolder folder;
  const std::string scene = write_squares(folder);
  const Words words = picture(scene, true, 4);
  render_well(words + Words{"-o", folder / "alone.exr"});
  for (const int rank : {0, 1}) {
    CAPTURE(rank);
    std::filesystem::remove(folder / "out.exr");
    MpiRun run(under_mpirun(3, words + Words{"-o", folder / "out.exr"}));
    const pid_t process = run.wait_for(rank);
    REQUIRE(process > 0);
    CHECK_FALSE(run.mpirun().ends_within(milliseconds(700)));
    kill(process, SIGSTOP);
    CHECK_FALSE(run.mpirun().ends_within(milliseconds(1000)));
    kill(process, SIGCONT);
    check_whole(run_bounded(run), folder / "out.exr", folder / "alone.exr");
  }
}

TEST_CASE("bvhrender under mpirun: everything killed, then resumed with other numbers of ranks") {
  if (skip_without(mpirun(), "resuming under mpirun") || skip_kills("resuming under mpirun")) return;
  for (const bool paths : {false, true}) {
    const TempFolder folder;
    const std::string scene = write_squares(folder), kept = folder / "kept", out = folder / "out.exr";
    const Words words = picture(scene, paths, 4);
    render_well(words + Words{"-o", folder / "alone.exr"});
    const Words resumed = words + Words{"-o", out, "--resume", kept, "--resume-every", "0.1"};
    std::string before;
    for (const unsigned ranks : {3u, 2u}) {
      std::error_code none;
      const auto old = std::filesystem::last_write_time(kept, none);
      MpiRun run(under_mpirun(ranks, resumed));
      REQUIRE(run.wait_for(1) > 0);
      CHECK(run.writes(kept, none ? std::filesystem::file_time_type{} : old));
      run.mpirun().signal(SIGKILL);
      run.kill_all();
      run_bounded(run);
      REQUIRE(std::filesystem::exists(kept));
      CHECK(read_file(kept) != before);
      before = read_file(kept);
    }
    const CommandResult other = run_bounded(under_mpirun(2, resumed + Words{"--seed", "1"}));
    CHECK(other.status == 1);
    CHECK_THAT(other.err, Contains("seed is 0 there and 1 here"));
    // The last part without mpirun.
    render_well(resumed);
    CHECK(read_file(out) == read_file(folder / "alone.exr"));
    CHECK_FALSE(std::filesystem::exists(kept));
  }
}

TEST_CASE("bvhrender under mpirun: Ctrl-C stops all ranks and keeps the checkpoint") {
  if (skip_without(mpirun(), "Ctrl-C under mpirun")) return;
  const TempFolder folder;
  const std::string scene = write_squares(folder), kept = folder / "kept";
  const Words words = {"-o", folder / "out.exr", "--resume", kept, "--resume-every", "0"};
  MpiRun run(under_mpirun(3, picture(scene, false, 100) + words));
  REQUIRE(run.wait_for(2) > 0);
  CHECK(run.writes(kept));
  run.mpirun().signal(SIGINT);
  const CommandResult result = run_bounded(run);
  CHECK(result.status != 0);
  // Open MPI 5 and newer drop what ranks print after Ctrl-C.
  if (!has_new_mpirun()) CHECK_THAT(result.err, Contains("bvhrender: cancelled: " + kept + " keeps what was computed"));
  CHECK(folder.names() == Words{"kept", "s.bvh"});
}

TEST_CASE("bvhrender under mpirun: ranks without the file, or with another one") {
  if (skip_without(mpirun(), "--broadcast")) return;
  const TempFolder folder;
  const std::string out = folder / "out.exr";
  write_squares(folder);
  for (const char* name : {"0", "1"}) std::filesystem::create_directory(folder / name);
  std::filesystem::rename(folder / "s.bvh", folder / "0/s.bvh");
  // Each rank has a separate folder.
  const auto ranks = [&](const Words& more) {
    std::string line = "cd '" + folder.path().string() + "'/$OMPI_COMM_WORLD_RANK && exec '" + kBvhRender + "' s.bvh";
    for (const std::string& word : Words{"-o", out, "--size", "75x41", "--spp", "3"} + more) line += " '" + word + "'";
    return run_bounded(Words{mpirun(), "--oversubscribe", "-n", "2", "/bin/bash", "-c", line});
  };
  const CommandResult without = ranks({});
  CHECK(without.status == 1);
  CHECK_THAT(without.err,
             Contains("bvhrender: rank 1 (process ") && Contains("cannot open 's.bvh'") && Contains("--broadcast"));
  CHECK_FALSE(std::filesystem::exists(out));
  render_well({folder / "0/s.bvh", "-o", folder / "alone.png", "--size", "75x41", "--spp", "3"});
  for (const Words& mode : {Words{}, Words{"--integrator", "path"}}) {
    const CommandResult with = ranks(mode + Words{"--broadcast", "-o", folder / "out.png"});
    INFO(with.err);
    CHECK(with.status == 0);
    if (mode.empty()) {
      CHECK(read_file(folder / "out.png") == read_file(folder / "alone.png"));
    }
  }
  std::string damaged = read_file(folder / "0/s.bvh");
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 1);
  folder.write("1/s.bvh", damaged);
  const CommandResult other = ranks({});
  CHECK(other.status == 1);
  CHECK_THAT(other.err, Contains("rank 1 (process ") && Contains("s.bvh: the checksum is "));
}

TEST_CASE("bvhrender under mpirun: errors are told once, and end all ranks") {
  if (skip_without(mpirun(), "errors under mpirun")) return;
  const TempFolder folder;
  const std::string scene = write_squares(folder), out = folder / "out.exr";
  const auto fails = [&](const Words& words, int status, const std::string& word) {
    const CommandResult result = run_bounded(words);
    INFO(result.err);
    CHECK(result.status == status);
    CHECK_THAT(result.err, Contains(word));
    const std::size_t first = result.err.find(word);
    CHECK(result.err.find(word, first + 1) == std::string::npos);
    CHECK_FALSE(std::filesystem::exists(out));
  };
  fails(under_mpirun(3, {folder / "none.bvh", "-o", out}), 1, "none.bvh");
  fails(under_mpirun(3, {scene, "-o", folder / "none/out.exr"}), 1, "there is no folder");
  fails(under_mpirun(2, {scene, "-o", out, "--integrator", "path", "--materials", folder / "none.glb"}), 1, "none.glb");
  // Two programs of one run that would not compute the same picture.
  fails(under_mpirun(1, {scene, "-o", out, "--spp", "2", ":", "-n", "1", kBvhRender, scene, "-o", out, "--spp", "3"}),
        1, "would compute another picture: spp is 3 there and 2 here");
}

TEST_CASE("bvhrender under mpirun: a full disk") {
  if (skip_without(mpirun(), "a full disk under mpirun")) return;
  const TempFolder folder;
  const std::string scene = write_squares(folder), disk = folder / "disk";
  std::filesystem::create_directory(disk);
  // A disk of 64 KiB in a space of mounts that ends with the shell.
  const std::string mount = "mount -t tmpfs -o size=64k tmpfs '" + disk + "'";
  if (run({"/usr/bin/unshare", "-m", "/bin/sh", "-c", mount}).status != 0) {
    std::puts("SKIPPED: a full disk under mpirun: tmpfs cannot be mounted here");
    return;
  }
  std::string line = mount + " &&";
  for (const std::string& word :
       under_mpirun(2, picture(scene, false, 1) +
                           Words{"-o", disk + "/out.exr", "--resume", disk + "/kept", "--resume-every", "0"}))
    line += " '" + word + "'";
  MpiRun run({"/usr/bin/unshare", "-m", "/bin/sh", "-c", line});
  const CommandResult result = run_bounded(run);
  INFO(result.err);
  CHECK(result.status != 0);
  CHECK_THAT(result.err, Contains("bvhrender: warning: the checkpoint is not kept: ") && Contains("No space left"));
  CHECK_THAT(result.err, Contains("bvhrender: cannot write '" + disk + "/out.exr'"));
}

TEST_CASE("bvhrender under mpirun: two network spaces joined by a virtual cable") {
  if (skip_without(mpirun(), "network spaces")) return;
  const TempFolder folder;
  const std::string scene = write_squares(folder), out = folder / "out.exr";
  const Words words = picture(scene, true, 2);
  render_well(words + Words{"-o", folder / "alone.exr"});
  const auto in_spaces = [&](const Words& options, const Words& more) {
    return Words{HIPRT_NETWORK_SPACES, mpirun()} + options + Words{kBvhRender} + words + Words{"-o", out} + more;
  };
  const CommandResult result = run_bounded(in_spaces({}, {"--broadcast"}));
  if (result.status == 77) {
    std::puts("SKIPPED: network spaces: this machine does not permit them");
    return;
  }
  check_whole(result, out, folder / "alone.exr");

  if (checks::kWorkDivisor != 1) return;
  // Another host's rank is taken for lost when it has given no sign of life for 30 seconds.
  std::filesystem::remove(out);
  const std::string kept = folder / "kept";
  MpiRun lossy(in_spaces(with_recovery(), {"--lossy-ranks", "--resume", kept, "--resume-every", "0"}));
  const pid_t process = lossy.wait_for(1);
  REQUIRE(process > 0);
  CHECK(lossy.writes(kept));
  kill(process, SIGKILL);
  const CommandResult rest = run_bounded(lossy, seconds(120));
  CHECK_THAT(rest.err, Contains("the run goes on without it"));
  check_whole(rest, out, folder / "alone.exr");
}
