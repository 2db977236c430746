#pragma once
/// Runs a program as a user does and keeps its output.

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

namespace hiprt::test {

struct CommandResult {
  int status = -1;  ///< Exit status; 128 + signal when a signal ended it.
  std::string out, err;
};

/// A started program whose stdout and stderr are pipes, and stdin is empty.
class Command {
 public:
  explicit Command(std::vector<std::string> arguments) {
    int out[2], err[2];
    if (pipe2(out, O_CLOEXEC) != 0 || pipe2(err, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    child_ = fork();
    if (child_ < 0) throw std::runtime_error("cannot fork");
    if (child_ == 0) {
      const int null = open("/dev/null", O_RDONLY);
      if (dup2(null, 0) >= 0 && dup2(out[1], 1) >= 0 && dup2(err[1], 2) >= 0) execv(argv[0], argv.data());
      _exit(127);
    }
    close(out[1]);
    close(err[1]);
    pipes_[0] = {out[0], POLLIN, 0};
    pipes_[1] = {err[0], POLLIN, 0};
  }
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  ~Command() {
    if (child_ > 0) {
      ::kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
    for (const pollfd& p : pipes_)
      if (p.fd >= 0) close(p.fd);
  }

  void signal(int number) { ::kill(child_, number); }

  /// Has the program ended within the time?
  bool ends_within(std::chrono::milliseconds time) {
    siginfo_t info{};
    const auto end = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < end) {
      info.si_pid = 0;
      if (waitid(P_PID, static_cast<id_t>(child_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid != 0)
        return true;
      usleep(1000);
    }
    return false;
  }

  /// Reads all output and waits for the end.
  CommandResult finish() {
    CommandResult result;
    while (pipes_[0].fd >= 0 || pipes_[1].fd >= 0) {
      if (poll(pipes_.data(), pipes_.size(), -1) < 0) throw std::runtime_error("cannot poll");
      drain(pipes_[0], result.out);
      drain(pipes_[1], result.err);
    }
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = -1;
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return result;
  }

 private:
  static void drain(pollfd& p, std::string& text) {
    if (p.fd < 0 || p.revents == 0) return;
    char buffer[4096];
    const ssize_t size = read(p.fd, buffer, sizeof(buffer));
    if (size > 0) {
      text.append(buffer, static_cast<std::size_t>(size));
      return;
    }
    close(p.fd);
    p.fd = -1;
  }

  pid_t child_ = -1;
  std::array<pollfd, 2> pipes_{{{-1, 0, 0}, {-1, 0, 0}}};
};

inline CommandResult run(std::vector<std::string> arguments) { return Command(std::move(arguments)).finish(); }

}  // namespace hiprt::test
