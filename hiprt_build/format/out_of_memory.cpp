#include <hiprt_build/format/out_of_memory.h>

#include <exception>
#include <string>

#ifdef __linux__
#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#endif

namespace hiprt::build {

#ifdef __linux__
namespace {

/// The number behind @p key in a file of /proc. Allocates nothing: it is called when there is no memory.
std::optional<std::uint64_t> number_in(const char* path, std::string_view key) noexcept {
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  std::array<char, 2048> buffer;
  const ssize_t size = ::read(file, buffer.data(), buffer.size());
  ::close(file);
  if (size <= 0) return std::nullopt;
  std::string_view text(buffer.data(), static_cast<std::size_t>(size));
  const std::size_t found = text.find(key);
  if (found == std::string_view::npos) return std::nullopt;
  text.remove_prefix(found + key.size());
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  std::uint64_t number = 0;
  if (std::from_chars(text.data(), text.data() + text.size(), number).ec != std::errc{}) return std::nullopt;
  return number;
}

/// Bytes of a limit that are left. @param used in KiB, a line of /proc/self/status.
std::uint64_t left_of(int resource, std::string_view used) noexcept {
  rlimit limit{};
  if (::getrlimit(static_cast<decltype(RLIMIT_AS)>(resource), &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
    return ~std::uint64_t{0};
  const std::uint64_t bytes = number_in("/proc/self/status", used).value_or(0) * 1024;
  return limit.rlim_cur - std::min<std::uint64_t>(limit.rlim_cur, bytes);
}

}  // namespace

std::optional<std::uint64_t> free_memory() noexcept {
  const auto machine = number_in("/proc/meminfo", "MemAvailable:");
  const std::uint64_t limits = std::min(left_of(RLIMIT_AS, "VmSize:"), left_of(RLIMIT_DATA, "VmData:"));
  if (!machine) return limits == ~std::uint64_t{0} ? std::nullopt : std::optional(limits);
  return std::min(*machine * 1024, limits);
}
#else
std::optional<std::uint64_t> free_memory() noexcept { return std::nullopt; }
#endif

namespace {

/// Short enough for a std::string without an allocation.
Error shortest() noexcept { return {ErrorCode::kOutOfMemory, "out of memory"}; }

}  // namespace

Error error_or_out_of_memory(ErrorCode code, const char* message) noexcept try {
  return {code, message};
} catch (const std::exception&) {
  return shortest();
}

Error out_of_memory(std::initializer_list<std::string_view> action, const std::bad_alloc& failure) noexcept try {
  std::string message = "not enough memory ";
  for (const std::string_view words : action) message += words;
  const auto* sized = dynamic_cast<const AllocationFailed*>(&failure);
  const auto free = free_memory();
  if (sized != nullptr || free) message += ": ";
  if (sized != nullptr) message += std::to_string(sized->bytes()) + " bytes wanted";
  if (sized != nullptr && free) message += ", ";
  if (free) message += std::to_string(*free) + (sized != nullptr ? " free" : " bytes free");
  return {ErrorCode::kOutOfMemory, std::move(message)};
} catch (const std::exception&) {
  return shortest();
}

}  // namespace hiprt::build
