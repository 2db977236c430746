#pragma once
/// Runs code in a child process whose address space is limited.

#include <cstddef>
#include <fstream>
#include <stdexcept>
#include <string>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace hiprt::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kCanLimitMemory = false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
inline constexpr bool kCanLimitMemory = false;
#else
inline constexpr bool kCanLimitMemory = true;
#endif
#else
inline constexpr bool kCanLimitMemory = true;
#endif

/// Address space of this process in bytes, shared libraries included (proc_pid_statm(5), field 1).
inline std::size_t used_address_space() {
  std::size_t pages = 0;
  if (!(std::ifstream("/proc/self/statm") >> pages)) throw std::runtime_error("no /proc/self/statm");
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

/// Calls @p work, which returns a text, in a child process that gets @p bytes of address space beyond what it has
/// (RLIMIT_AS). Libraries alone may take more than a fixed limit: with libamdhip64 of Debian 13 300 MB. Sanitizers
/// reserve more than any limit: under them there is none.
/// @return the text, or "ended by signal N".
template <class Work> std::string in_limited_child(std::size_t bytes, const Work& work) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  const std::size_t most = used_address_space() + bytes;
  const rlimit limit{most, most};
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("cannot fork");
  if (child == 0) {
    std::string text = kCanLimitMemory && setrlimit(RLIMIT_AS, &limit) != 0 ? "no limit was set" : work();
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t size = write(ends[1], text.data() + done, text.size() - done);
      if (size <= 0) break;
      done += static_cast<std::size_t>(size);
    }
    _exit(0);
  }
  close(ends[1]);
  std::string text;
  char buffer[4096];
  for (ssize_t size = 0; (size = read(ends[0], buffer, sizeof(buffer))) > 0;)
    text.append(buffer, static_cast<std::size_t>(size));
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFSIGNALED(status) ? "ended by signal " + std::to_string(WTERMSIG(status)) : text;
}

}  // namespace hiprt::test
