#include <tools/build/bvh_cache.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/base/names.h>
#include <tools/build/cache_key.h>
#include <tools/build/cache_lock.h>

#include <hiprt_build/file.h>
#include <hiprt_build/format/validate.h>

#include <fcntl.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include <utility>

namespace hiprt::tools {
namespace {

/// The statistics that a file's provenance block has. Times and memory stay 0: nothing was built.
build::BuildStatistics statistics_of(std::string_view provenance, build::Builder builder) {
  build::BuildStatistics result;
  result.builder = builder;
  const auto document = nlohmann::json::parse(provenance, nullptr, /*allow_exceptions=*/false);
  if (!document.is_object()) return result;
  const auto found = document.find("statistics");
  if (found == document.end() || !found->is_object()) return result;
  const auto read = [&](const char* key, std::uint64_t& number) {
    const auto value = found->find(key);
    if (value != found->end() && value->is_number_unsigned()) number = value->get<std::uint64_t>();
  };
  read("triangles", result.triangles);
  read("customs", result.customs);
  read("dropped_not_finite", result.dropped_not_finite);
  read("dropped_degenerate", result.dropped_degenerate);
  read("pairs", result.pairs);
  read("custom_pairs", result.custom_pairs);
  read("nodes", result.nodes);
  read("leaves", result.leaves);
  const auto used = found->find("builder");
  for (unsigned i = 0;
       used != found->end() && used->is_string() && i <= static_cast<unsigned>(build::Builder::kImported); ++i)
    if (used->get_ref<const std::string&>() == build::name(static_cast<build::Builder>(i)))
      result.builder = static_cast<build::Builder>(i);
  return result;
}

/// An entry that was found.
struct Entry {
  std::optional<build::Buffer> file{};
  std::string damage{};  ///< Why there is no file although the entry exists.
};

Entry read_entry(const std::filesystem::path& path) {
  auto file = build::read_file(path);
  if (!file) return {{}, file.error().message};
  if (const auto valid = validate(file->bytes()); !valid) return {{}, path.string() + ": " + to_string(valid.error())};
  return {std::move(*file), {}};
}

/// Marks an entry as used now: the time of writing is the time of the last use. Where that cannot be written, nothing
/// can be pruned.
/// @return whether there is an entry.
build::Result<bool> use_entry(const std::filesystem::path& folder, const std::filesystem::path& path) {
  const auto lock = LockedFile::of_folder(folder, /*exclusive=*/false);
  if (!lock) return tl::unexpected(lock.error());
  static_cast<void>(::utimensat(AT_FDCWD, path.c_str(), nullptr, 0));
  std::error_code error;
  return std::filesystem::exists(path, error);
}

/// @return what went wrong; empty: the file is there.
std::string store(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::error_code error;
  std::filesystem::create_directory(path.parent_path(), error);
  if (error) return path.parent_path().string() + ": cannot make the folder: " + error.message();
  const auto written = build::write_file(path, bytes);
  return written ? std::string() : written.error().message;
}

}  // namespace

class BvhCache::Session {
 public:
  explicit Session(const std::filesystem::path& folder) : use_(LockedFile::of_use(folder)) {}

 private:
  LockedFile use_;
};

BvhCache::BvhCache(std::filesystem::path folder) : folder_(std::move(folder)) {}
BvhCache::BvhCache(BvhCache&&) noexcept = default;
BvhCache& BvhCache::operator=(BvhCache&&) noexcept = default;
BvhCache::~BvhCache() = default;

build::Result<BvhCache> BvhCache::open(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!std::filesystem::is_directory(folder))
    return fail(build::ErrorCode::kIo, folder.string() + ": cannot make the folder of the cache: " +
                                           (error ? error.message() : "there is something else of this name"));
  BvhCache cache(folder);
  const auto lock = LockedFile::of_folder(folder, /*exclusive=*/false);
  if (!lock) return tl::unexpected(lock.error());
  cache.session_ = std::make_unique<Session>(folder);
  return cache;
}

void BvhCache::clean() const {
  static_cast<void>(oldest_use(folder_));
  std::error_code error;
  for (std::filesystem::directory_iterator group(folder_, error), end; !error && group != end; group.increment(error))
    remove_dead_temporaries(group->path());
}

std::filesystem::path BvhCache::file_of(const std::string& key) const {
  return folder_ / key.substr(0, 2) / (key + ".bvh");
}

build::Result<CachedBuild> BvhCache::build(const build::SceneInput& scene, const BuildRequest& request) const {
  CachedBuild result;
  result.key = cache_key(scene, request);
  result.file = file_of(result.key);
  const auto there = use_entry(folder_, result.file);
  if (!there) return tl::unexpected(there.error());
  Entry entry = *there ? read_entry(result.file) : Entry{};
  if (entry.file) {
    const auto view = open_buffer(entry.file->bytes());
    result.use = CacheUse::kHit;
    result.built = {{}, request.options.builder, request.device == DeviceChoice::kGpu};
    result.built.bvh.statistics = statistics_of(view->provenance, request.options.builder);
    result.built.bvh.buffer = std::move(*entry.file);
    return result;
  }
  result.damage = std::move(entry.damage);
  result.use = result.damage.empty() ? CacheUse::kMiss : CacheUse::kDamaged;
  auto built = build_meshes(scene, request);
  if (!built) return tl::unexpected(built.error());
  result.built = std::move(*built);
  result.not_stored = store(result.file, result.built.bvh.buffer.bytes());
  return result;
}

}  // namespace hiprt::tools
