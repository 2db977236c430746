#pragma once
/// Programs under mpirun, and their ranks as processes.

#include <tests/tools/run_command.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

namespace hiprt::test {

inline const std::string kMpirun = HIPRT_MPIRUN;

/// Ends the test program as skipped without mpirun.
inline void require_mpirun() {
  // Open MPI keeps memory until its process ends, which LeakSanitizer would report.
  ::setenv("ASAN_OPTIONS", "detect_leaks=0", 0);
  if (!kMpirun.empty()) return;
  std::printf("SKIPPED: no mpirun (tools/install-packages mpi)\n");
  std::fflush(stdout);
  std::_Exit(77);
}

/// mpirun -n RANKS ARGUMENTS. More ranks than processors may run, also by root. The end of a rank ends the run unless
/// @p recovery.
inline std::vector<std::string> mpirun(int ranks, std::vector<std::string> arguments, bool recovery = false) {
  // Bounded: a test that hangs says so.
  std::vector<std::string> result{
      "/usr/bin/timeout",   "-k", "2", "100", kMpirun, "--allow-run-as-root", "--oversubscribe", "-n",
      std::to_string(ranks)};
  if (recovery) result.emplace_back("--enable-recovery");
  result.insert(result.end(), std::make_move_iterator(arguments.begin()), std::make_move_iterator(arguments.end()));
  return result;
}

/// While it lives, started programs carry a mark by which their ranks are found.
class Marked {
 public:
  Marked() {
    static int count = 0;
    value_ = std::to_string(::getpid()) + "-" + std::to_string(count++);
    ::setenv("HIPRT_TEST_MARK", value_.c_str(), 1);
  }
  Marked(const Marked&) = delete;
  Marked& operator=(const Marked&) = delete;
  ~Marked() { ::unsetenv("HIPRT_TEST_MARK"); }

  /// The living ranks and their process numbers.
  std::map<int, pid_t> ranks() const {
    std::map<int, pid_t> result;
    std::error_code error;
    for (std::filesystem::directory_iterator entry("/proc", error), end; !error && entry != end;
         entry.increment(error)) {
      const std::string name = entry->path().filename().string();
      if (name.find_first_not_of("0123456789") != std::string::npos) continue;
      std::ifstream file(entry->path() / "environ", std::ios::binary);
      const std::string text = '\0' + std::string{std::istreambuf_iterator<char>(file), {}};
      if (text.find(std::string(1, '\0') + "HIPRT_TEST_MARK=" + value_ + '\0') == std::string::npos) continue;
      constexpr std::string_view kRank = "OMPI_COMM_WORLD_RANK=";
      const std::size_t at = text.find('\0' + std::string(kRank));
      if (at == std::string::npos) continue;
      result[std::atoi(text.c_str() + at + 1 + kRank.size())] = static_cast<pid_t>(std::stol(name));
    }
    return result;
  }

 private:
  std::string value_;
};

}  // namespace hiprt::test
