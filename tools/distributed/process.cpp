#include <tools/distributed/process.h>

#include <tools/base/text.h>

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string_view>
#include <system_error>

namespace hiprt::tools {
namespace {

std::string content_of(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The words of /proc/PID/stat after the name, which may hold blanks: the first is the state.
struct ProcessState {
  char state = 0;  ///< 0: unknown.
  std::uint64_t start = 0;
};

ProcessState state_of(std::int64_t pid) {
  const std::string text = content_of("/proc/" + std::to_string(pid) + "/stat");
  const std::size_t name_end = text.rfind(')');
  if (name_end == std::string::npos) return {};
  std::string_view rest = std::string_view(text).substr(name_end + 1);
  ProcessState result;
  // proc(5): field 3 is the state, field 22 the start time.
  for (int field = 3; field <= 22; ++field) {
    const std::string_view word = next_word(rest);
    if (field == 3 && !word.empty()) result.state = word[0];
    if (field == 22) result.start = static_cast<std::uint64_t>(parse_integer(word).value_or(0));
  }
  return result;
}

}  // namespace

std::string host_name() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return "unknown";
  return name.data();
}

ProcessId ProcessId::own() {
  ProcessId result{.pid = ::getpid(), .start = state_of(::getpid()).start};
  struct stat space {};
  if (::stat("/proc/self/ns/pid", &space) == 0) result.pid_space = space.st_ino;
  std::string boot = content_of("/proc/sys/kernel/random/boot_id");
  result.host = host_name() + " " + boot.substr(0, boot.find('\n'));
  return result;
}

bool ProcessId::is_visible_to(const ProcessId& observer) const {
  return host == observer.host && pid_space == observer.pid_space && pid > 0;
}

bool ProcessId::is_dead() const {
  if (::kill(static_cast<pid_t>(pid), 0) != 0 && errno == ESRCH) return true;
  const ProcessState now = state_of(pid);
  if (now.state == 0) return false;
  // A zombie has ended, and waits for its parent to notice.
  return now.state == 'Z' || now.state == 'X' || (start != 0 && now.start != start);
}

std::string parent_name() {
  const std::string text = content_of("/proc/" + std::to_string(::getppid()) + "/comm");
  return text.substr(0, text.find('\n'));
}

bool sibling_is_missing() {
  const char* text = std::getenv("OMPI_COMM_WORLD_LOCAL_SIZE");
  const auto size = text == nullptr ? std::nullopt : parse_integer(text);
  const std::string parent = std::to_string(::getppid());
  const std::string children = content_of("/proc/" + parent + "/task/" + parent + "/children");
  if (!size || children.empty()) return false;
  const std::string own = content_of("/proc/self/comm");
  std::int64_t count = 0;
  std::string_view rest = children;
  for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
    const std::int64_t pid = parse_integer(word).value_or(0);
    if (content_of("/proc/" + std::to_string(pid) + "/comm") == own && state_of(pid).state != 'Z') ++count;
  }
  return count < *size;
}

bool parent_shows_terminal() {
  std::error_code error;
  const std::string target =
      std::filesystem::read_symlink("/proc/" + std::to_string(::getppid()) + "/fd/2", error).string();
  return !error && (target.starts_with("/dev/pts/") || target.starts_with("/dev/tty"));
}

}  // namespace hiprt::tools
