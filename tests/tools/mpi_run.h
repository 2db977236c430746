#pragma once
/// A tool under mpirun, and its ranks as processes that can be signalled.

#include "run_command.h"
#include "temp_folder.h"

#include <tests/amount.h>

#include <tests/catch.h>

#include <cctype>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace hiprt::test {

/// @return the path of mpirun; empty if it is not there, or the tool was compiled without MPI.
inline std::string find_mpirun(const std::string& tool) {
  // Test machines run as root, and have fewer cores than ranks.
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  // Open MPI keeps memory until its process ends, which LeakSanitizer would report.
  setenv("ASAN_OPTIONS", "detect_leaks=0", 0);
  const CommandResult found = run({"/bin/sh", "-c", "command -v mpirun"});
  if (found.status != 0) return {};
  const CommandResult version = run({tool, "--version"});
  if (version.out.find("MPI: Open MPI") == std::string::npos) return {};
  return found.out.substr(0, found.out.find('\n'));
}

using Words = std::vector<std::string>;

inline Words operator+(Words a, const Words& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// A command line. @param more options of mpirun.
inline Words under_mpirun(const std::string& mpirun, unsigned ranks, const Words& program, const Words& more = {}) {
  return Words{mpirun, "--oversubscribe"} + more + Words{"-n", std::to_string(ranks)} + program;
}

/// Whether mpirun is that of Open MPI 5 or newer.
inline bool has_new_mpirun() {
  static const bool is_new = run({"/bin/sh", "-c", "mpirun --version | grep -q 'Open MPI) [1-4][.]'"}).status != 0;
  return is_new;
}

/// Options of mpirun that make it go on after the end of a rank.
inline Words with_recovery() { return has_new_mpirun() ? Words{"--with-ft", "ulfm"} : Words{"--enable-recovery"}; }

/// What skips a case where there is no MPI.
inline bool skip_without(const std::string& mpirun, const char* name) {
  if (mpirun.empty()) std::printf("SKIPPED: %s: no mpirun, or a build without MPI\n", name);
  return mpirun.empty();
}

/// What skips a case whose ranks must work for seconds, so that one can be killed. In sanitized builds that is minutes:
/// in the quick set the optimised build runs them.
inline bool skip_kills(const char* name) {
#if defined(HIPRT_CHECKS_SLOW) && defined(HIPRT_QUICK_TESTS)
  std::printf("SKIPPED: %s: the optimised build runs it\n", name);
  return true;
#else
  return name == nullptr;
#endif
}

/// A program under mpirun. All its processes carry a mark in their environment.
class MpiRun {
 public:
  /// @param words of mpirun and of the program.
  explicit MpiRun(std::vector<std::string> words) : mark_(new_mark()), command_(marked(std::move(words))) {}
  MpiRun(const MpiRun&) = delete;
  MpiRun& operator=(const MpiRun&) = delete;
  ~MpiRun() { kill_all(); }

  Command& mpirun() { return command_; }

  /// @return the processes that live of this run. @param rank only those of this rank; -1: all but mpirun.
  std::vector<pid_t> processes(int rank = -1) const {
    std::vector<pid_t> found;
    const std::string variable = rank < 0 ? "OMPI_COMM_WORLD_RANK=" : "OMPI_COMM_WORLD_RANK=" + std::to_string(rank);
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
      const std::string name = entry.path().filename();
      if (std::isdigit(static_cast<unsigned char>(name[0])) == 0) continue;
      std::ifstream in(entry.path() / "environ", std::ios::binary);
      const std::string environment{std::istreambuf_iterator<char>(in), {}};
      if (environment.find(mark_) == std::string::npos) continue;
      const std::size_t at = environment.find(variable);
      if (at == std::string::npos || (rank >= 0 && environment[at + variable.size()] != '\0')) continue;
      found.push_back(std::stoi(name));
    }
    return found;
  }

  /// Waits for a rank to have a process. @return it, or -1: the run ended before.
  pid_t wait_for(int rank) {
    for (int i = 0; i < 10000 && !command_.ends_within(std::chrono::milliseconds(2)); ++i)
      if (const auto found = processes(rank); !found.empty()) return found.back();
    return -1;
  }

  /// Waits until the run has written a file again or for the first time. Then its ranks have met and work.
  /// @param old when it was written before the run began; the default: it was not there.
  bool writes(const std::filesystem::path& path, std::filesystem::file_time_type old = {}) {
    std::error_code error;
    for (int i = 0; i < 30000 && !command_.ends_within(std::chrono::milliseconds(2)); ++i)
      if (const auto time = std::filesystem::last_write_time(path, error); !error && time != old) return true;
    return false;
  }

  void kill_all() const {
    for (const pid_t process : processes()) ::kill(process, SIGKILL);
  }

  /// Whether no process of the run lives after at most this time.
  bool is_gone_within(std::chrono::seconds time) const {
    const auto end = std::chrono::steady_clock::now() + time;
    while (!processes().empty()) {
      if (std::chrono::steady_clock::now() > end) return false;
      usleep(10'000);
    }
    return true;
  }

 private:
  static std::string new_mark() {
    static int count = 0;
    return "HIPRT_TEST_RUN=" + std::to_string(getpid()) + "-" + std::to_string(++count) + ".";
  }
  std::vector<std::string> marked(std::vector<std::string> words) const {
    words.insert(words.begin(), {"/usr/bin/env", mark_});
    return words;
  }

  std::string mark_;
  Command command_;
};

/// Runs it to its end, which must come in time, with no process left.
inline CommandResult run_bounded(MpiRun& run, std::chrono::seconds time = std::chrono::seconds(60)) {
  const bool ended = run.mpirun().ends_within(time);
  CHECK(ended);
  if (!ended) {
    run.kill_all();
    run.mpirun().signal(SIGKILL);
  }
  CommandResult result = run.mpirun().finish();
  CHECK(run.is_gone_within(std::chrono::seconds(15)));
  return result;
}

inline CommandResult run_bounded(const Words& words) {
  MpiRun run(words);
  return run_bounded(run);
}

}  // namespace hiprt::test
