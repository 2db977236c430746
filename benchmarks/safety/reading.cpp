/// What it costs to read a file instead of mapping it. compare.py compiles and starts it.

#include <hiprt_build/file.h>

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

namespace {

using namespace hiprt;

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Of all threads, in the system and outside of it.
double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// One thread per processor.
void on_all_threads(std::size_t count, const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i; (i = next++) < count;) body(i);
  };
  std::vector<std::thread> threads(std::max(1u, std::thread::hardware_concurrency()));
  for (std::thread& thread : threads) thread = std::thread(work);
  for (std::thread& thread : threads) thread.join();
}

/// Prints the best of 3 rounds: opens the file and reads one byte of each page.
template <class Open> void measure(const char* name, unsigned pause, const Open& open) {
  double wall = 1e30, processor = 1e30;
  for (int round = 0; round < 3; ++round) {
    sleep(pause);
    const double wall_start = wall_seconds(), processor_start = processor_seconds();
    const build::Result<build::Buffer> file = open();
    if (!file) {
      std::fprintf(stderr, "%s\n", file.error().message.c_str());
      std::exit(1);
    }
    unsigned sum = 0;
    for (std::size_t at = 0; at < file->size(); at += 4096) sum += static_cast<unsigned>(file->bytes()[at]);
    wall = std::min(wall, wall_seconds() - wall_start);
    processor = std::min(processor, processor_seconds() - processor_start);
    static volatile unsigned sink;
    sink = sum;
  }
  std::printf("%-42s %8.2f %8.2f\n", name, processor, wall);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: reading FILE\nStarted by compare.py.\n");
    return 2;
  }
  const std::string path = argv[1];
  // A virtual machine's host takes back memory that is free for some seconds.
  constexpr unsigned kPause = 6;
  std::printf("%-42s %8s %8s\n", "seconds", "cpu", "wall");
  measure("map", 0, [&] { return build::map_file(path); });
  measure("read", 0, [&] { return build::read_file(path); });
  measure("read, all threads", 0, [&] { return build::read_file(path, on_all_threads); });
  measure("read after a pause", kPause, [&] { return build::read_file(path); });
  measure("read, all threads, after a pause", kPause, [&] { return build::read_file(path, on_all_threads); });
  return 0;
}
