// Programs that are killed while they work: each file is the old one or the new one, whole, and the next run removes
// temporary files.

#include <tests/amount.h>
#include <tests/faults/program_lines.h>

#include <tests/catch.h>

#include <poll.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <random>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

/// Of each command line.
#if defined(HIPRT_CHECKS_SLOW)
constexpr unsigned kKills = 1;
#elif defined(HIPRT_QUICK_TESTS)
constexpr unsigned kKills = 4;
#else
constexpr unsigned kKills = 20;
#endif

/// Sees files that appear in a folder.
class FolderWatch {
 public:
  explicit FolderWatch(const std::filesystem::path& folder) : number_(::inotify_init1(IN_CLOEXEC)) {
    REQUIRE(::inotify_add_watch(number_, folder.c_str(), IN_CREATE) >= 0);
  }
  FolderWatch(const FolderWatch&) = delete;
  FolderWatch& operator=(const FolderWatch&) = delete;
  ~FolderWatch() { ::close(number_); }

  /// Waits for the next file. @return whether one came within 10 s.
  bool next() {
    // One call reads the events of all files that have appeared.
    if (seen_ == 0) read();
    if (seen_ == 0) return false;
    --seen_;
    return true;
  }

 private:
  void read() {
    alignas(inotify_event) char events[16 * (sizeof(inotify_event) + 256)];
    pollfd poll{number_, POLLIN, 0};
    if (::poll(&poll, 1, 10'000) != 1) return;
    const ssize_t size = ::read(number_, events, sizeof(events));
    for (ssize_t at = 0; at < size; ++seen_) {
      inotify_event event;
      std::memcpy(&event, events + at, sizeof(event));
      at += static_cast<ssize_t>(sizeof(event) + event.len);
    }
  }

  unsigned seen_ = 0;  ///< Files of events that were read.
  int number_;
};

bool is_temporary(const std::string& name) {
  return (name.starts_with(".hiprt-") && name.ends_with(".tmp")) || name.ends_with(".part");
}

/// What kills have left.
struct Left {
  unsigned kills = 0, old_files = 0, new_files = 0, temporaries = 0, mixed = 0;
};

/// @return the files without the temporary ones, which are counted.
Contents without_temporaries(Contents contents, Left& left) {
  left.temporaries +=
      static_cast<unsigned>(std::erase_if(contents, [](const auto& f) { return is_temporary(f.first); }));
  return contents;
}

/// The manifest of parts is written last: if it is new, all files are. An old one does not accept new files.
void check_parts(const Contents& found, const Contents& old_files, const Contents& new_files, const std::string& out,
                 Left& left) {
  if (!found.contains("p.json") || found == old_files || found == new_files) return;
  CHECK(found.at("p.json") == old_files.at("p.json"));
  ++left.mixed;
  const test::TempFolder pictures;
  const test::CommandResult result =
      test::run({HIPRT_BVHRENDER, out + "p.json", "-o", pictures / "a.exr", "--integrator", "path", "--size", "8x8"});
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Catch::Contains("build the parts again"));
}

}  // namespace

TEST_CASE("programs that are killed at random moments leave each file whole, and the next run removes temporary ones") {
  const unsigned seed = std::random_device()();
  INFO("seed " << seed);
  oracle::Random random(seed);
  const ProgramInputs before(0), after(1);
  Left left;
  for (const ProgramLine& line : program_lines()) {
    const Contents old_files = outputs_of(line, before);
    const auto start = std::chrono::steady_clock::now();
    const Contents new_files = outputs_of(line, after);
    const auto time = std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start);
    for (unsigned i = 0; i < kKills; ++i) {
      const test::TempFolder folder;
      const std::string out = folder.path().string() + "/";
      for (const auto& [name, content] : old_files) folder.write(name, content);
      FolderWatch watch(folder.path());
      const std::vector<std::string> words = line.words(after.at(), out);
      CAPTURE(words[0], line.outputs[0], i);
      test::Command command(words);
      // Half of the kills come while the program writes, the others at any time.
      if (i % 2 == 0) {
        for (unsigned files = 1 + random.below(static_cast<unsigned>(line.outputs.size())); files > 0; --files)
          REQUIRE(watch.next());
        // Short times are likelier: then the file is filled. Later it is flushed.
        ::usleep(random.below(1 + random.below(600)));
      } else {
        ::usleep(random.below(static_cast<unsigned>(time.count())));
      }
      command.signal(SIGKILL);
      const int status = command.finish().status;
      CHECK((status == 128 + SIGKILL || status == 0));
      ++left.kills;
      const Contents found = without_temporaries(contents_of(folder), left);
      REQUIRE(found.size() == line.outputs.size());
      for (const auto& [name, content] : found) {
        CAPTURE(name);
        const bool is_new = content == new_files.at(name);
        CHECK((is_new || content == old_files.at(name)));
        ++(is_new ? left.new_files : left.old_files);
      }
      check_parts(found, old_files, new_files, out, left);
      CHECK(test::run(words).status == 0);
      CHECK(contents_of(folder) == new_files);
    }
  }
  std::printf("programs: seed %u, %u killed: %u old files, %u new ones, %u temporary ones, %u mixed parts\n", seed,
              left.kills, left.old_files, left.new_files, left.temporaries, left.mixed);
}
