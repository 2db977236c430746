/// bvhrender --resume as a user runs it: the picture of a run that was stopped is the one of a run that was not.

#include "renderer.h"

#include <tests/amount.h>
#include <tests/oracle/random.h>

#include <csignal>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

/// A picture that takes a machine about a second.
std::vector<std::string> long_picture(const std::string& scene, bool paths) {
  std::vector<std::string> words{scene, "--size", "203x131", "--camera", "0.3,0.4,3/0,0,0/0,1,0/40"};
  const std::vector<std::string> mode = paths ? std::vector<std::string>{"--integrator", "path", "--spp", "40"}
                                              : std::vector<std::string>{"--mode", "ao", "--spp", "64"};
  words.insert(words.end(), mode.begin(), mode.end());
  return words;
}

std::vector<std::string> with(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::vector<std::string> program(std::vector<std::string> words) {
  words.insert(words.begin(), kBvhRender);
  return words;
}

}  // namespace

TEST_CASE("bvhrender --resume: killed at random moments, then whole: the same bytes") {
  const std::uint64_t seed = 20261127;
  CAPTURE(seed);
  oracle::Random random(seed);
  for (const bool paths : {false, true}) {
    const TempFolder folder;
    const auto words = long_picture(write_squares(folder), paths);
    render_well(with(words, {"-o", folder / "whole.exr"}));
    const std::string kept = folder / "kept";
    const auto resumed = with(words, {"-o", folder / "parts.exr", "--resume", kept, "--resume-every", "0.05"});
    unsigned kills = 0;
    for (unsigned i = 0; i < 2 + checks::trials(50); ++i) {
      Command command(program(resumed));
      if (command.ends_within(std::chrono::milliseconds(50 + random.below(400)))) break;
      command.signal(SIGKILL);
      // It may have come to its end before the signal.
      const int status = command.finish().status;
      if (status == 0) break;
      CHECK(status == 128 + SIGKILL);
      ++kills;
    }
    CHECK(kills > 0);
    render_well(resumed);
    CHECK(read_file(folder / "parts.exr") == read_file(folder / "whole.exr"));
    CHECK_FALSE(std::filesystem::exists(kept));
  }
}

TEST_CASE("bvhrender --resume: Ctrl-C keeps what was computed, and another picture does not go on from it") {
  const TempFolder folder;
  const std::string scene = write_squares(folder), kept = folder / "kept", out = folder / "a.png";
  const auto words = [&](const std::string& spp) {
    return std::vector<std::string>{scene,  "-o",    out, "--size",   "640x480", "--camera",
                                    kFront, "--spp", spp, "--resume", kept};
  };
  bool stopped = false;
  for (const int delay : {700, 1500, 4000}) {
    Command command(program(words("65536")));
    REQUIRE_FALSE(command.ends_within(std::chrono::milliseconds(delay)));
    command.signal(SIGINT);
    const CommandResult result = command.finish();
    CHECK(result.status == 1);
    if (!std::filesystem::exists(kept)) continue;
    CHECK_THAT(result.err, Contains("bvhrender: cancelled: " + kept + " keeps what was computed"));
    stopped = true;
    break;
  }
  REQUIRE(stopped);
  CHECK_FALSE(std::filesystem::exists(out));
  const auto refuses = [&](const std::vector<std::string>& other, const std::string& word) {
    const CommandResult result = render(other);
    CHECK(result.status == 1);
    CHECK_THAT(result.err, Contains(kept + ": ") && Contains(word));
  };
  refuses(words("65535"), "spp is 65536 there and 65535 here");
  refuses(with(words("65536"), {"--seed", "7"}), "seed is 0 there and 7 here");
  const std::string bytes = read_file(kept);
  folder.write("kept", bytes.substr(0, bytes.size() / 2));
  refuses(words("65536"), "damaged");
  folder.write("kept", "a letter");
  refuses(words("65536"), "no checkpoint");
  CHECK(read_file(kept) == "a letter");
}

TEST_CASE("bvhrender --resume: files that cannot be the checkpoint, and a full disk") {
  const TempFolder folder;
  const std::string scene = write_squares(folder), out = folder / "a.exr";
  const auto refuses = [&](const std::string& kept, const std::string& word) {
    const CommandResult result = render({scene, "-o", out, "--resume", kept});
    CHECK(result.status == 1);
    CHECK_THAT(result.err, Contains(word));
  };
  refuses(scene, "s.bvh");
  refuses(folder / "none/kept", "none");
  CHECK(folder.names() == std::vector<std::string>{"s.bvh"});
  CHECK(render({scene, "-o", out, "--resume-every", "3"}).status == 2);
  // No file may become larger than 1 KiB: the checkpoint is lost with a warning, and so is the picture, with an error.
  const CommandResult full =
      run({"/bin/bash", "-c",
           "ulimit -f 1; exec '" + kBvhRender + "' '" + scene + "' -o '" + out.c_str() +
               "' --size 300x200 --spp 16 --resume '" + (folder / "kept").string() + "' --resume-every 0"});
  CHECK(full.status == 1);
  CHECK_THAT(full.err, Contains("warning: the checkpoint is not kept: cannot write '" + (folder / "kept").string()));
  CHECK_THAT(full.err, Contains("bvhrender: cannot write '" + out));
  CHECK(folder.names() == std::vector<std::string>{"s.bvh"});
}
