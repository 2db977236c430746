#include <tools/build/bvh_cache.h>

#include <tools/base/errors.h>
#include <tools/build/cache_lock.h>

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <system_error>
#include <utility>
#include <vector>

namespace hiprt::tools {
namespace {

struct PrunableEntry {
  std::filesystem::path path;
  std::uint64_t bytes = 0;
  std::int64_t used = 0;  ///< Nanoseconds, write_time().
};

/// Whether a name is of an entry: 32 hexadecimal digits and ".bvh".
bool is_entry(const std::string& name) {
  return name.size() == 36 && name.ends_with(".bvh") && name.find_first_not_of("0123456789abcdef") == name.size() - 4;
}

build::Result<std::vector<PrunableEntry>> entries_of(const std::filesystem::path& folder) {
  std::vector<PrunableEntry> result;
  std::error_code error;
  for (std::filesystem::directory_iterator group(folder, error), end; !error && group != end; group.increment(error)) {
    if (!group->is_directory() || group->path().filename().string().size() != 2) continue;
    remove_dead_temporaries(group->path());
    std::error_code inner;
    for (std::filesystem::directory_iterator entry(group->path(), inner); !inner && entry != end;
         entry.increment(inner)) {
      struct stat status {};
      if (!is_entry(entry->path().filename().string()) || ::stat(entry->path().c_str(), &status) != 0) continue;
      result.push_back({entry->path(), static_cast<std::uint64_t>(status.st_size), write_time(status)});
    }
  }
  if (error) return fail(build::ErrorCode::kIo, folder.string() + ": cannot list the folder: " + error.message());
  return result;
}

std::int64_t now_nanoseconds() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

build::Result<PruneReport> prune_cache(const std::filesystem::path& folder, const PruneLimit& limit) {
  const auto lock = LockedFile::of_folder(folder, /*exclusive=*/true);
  if (!lock) return tl::unexpected(lock.error());
  auto entries = entries_of(folder);
  if (!entries) return tl::unexpected(entries.error());
  const auto oldest = oldest_use(folder);
  // The last used first; equal times by name, so that the result is the same everywhere.
  std::sort(entries->begin(), entries->end(), [](const PrunableEntry& a, const PrunableEntry& b) {
    return a.used != b.used ? a.used > b.used : a.path < b.path;
  });
  PruneReport report;
  const std::int64_t now = now_nanoseconds();
  std::uint64_t sum = 0;
  for (const PrunableEntry& entry : *entries) {
    sum += entry.bytes;
    const bool too_old = (now - entry.used) / 1'000'000'000 >= limit.age.count();
    const bool unwanted = sum > limit.bytes || too_old;
    const bool in_use = oldest && entry.used >= *oldest;
    report.in_use += unwanted && in_use ? 1 : 0;
    if (!unwanted || in_use) {
      ++report.kept_files;
      report.kept_bytes += entry.bytes;
      continue;
    }
    std::error_code error;
    if (std::filesystem::remove(entry.path, error); error)
      return fail(build::ErrorCode::kIo, entry.path.string() + ": cannot remove it: " + error.message());
    ++report.files;
    report.bytes += entry.bytes;
  }
  return report;
}

std::optional<PruneLimit> parse_prune_limit(const std::string& text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string unit(end, text.data() + text.size());
  if (error != std::errc{} || unit.size() > 1 || number > (std::uint64_t{1} << 22)) return std::nullopt;
  PruneLimit limit;
  const std::string units = "KMGT";
  if (unit == "d" || unit == "h")
    limit.age = std::chrono::hours(static_cast<std::int64_t>(number) * (unit == "d" ? 24 : 1));
  else if (const std::size_t power = units.find(unit); !unit.empty() && power != std::string::npos)
    limit.bytes = number << (10 * (power + 1));
  else
    return std::nullopt;
  return limit;
}

}  // namespace hiprt::tools
