#pragma once
/// A folder of built BVH files, named by cache_key(): FOLDER/ab/abcdef....bvh.
///
/// An entry is written to a temporary file, flushed and renamed, so it is whole or not there. Readers check all of it:
/// a damaged entry counts as missing and is replaced. Any number of processes may use one folder.

#include <tools/build/build_meshes.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

namespace hiprt::tools {

enum class CacheUse {
  kHit,      ///< The entry was there.
  kMiss,     ///< It was built.
  kDamaged,  ///< It was there and damaged, and was built again.
};

/// What a build through a cache returns.
struct CachedBuild {
  Built built;
  CacheUse use = CacheUse::kMiss;
  std::string key{};
  std::filesystem::path file{};  ///< The entry.
  std::string damage{};          ///< With kDamaged: what is wrong with the old entry.
  std::string not_stored{};      ///< Why the entry was not written. Empty: it was, or it was there.
};

class BvhCache {
 public:
  /// Makes the folder if it is missing. A folder that cannot be written can be read.
  /// @return kIo with the folder and the reason.
  static build::Result<BvhCache> open(const std::filesystem::path& folder);
  BvhCache(BvhCache&&) noexcept;
  BvhCache& operator=(BvhCache&&) noexcept;
  ~BvhCache();

  /// Takes the BVH from the cache, or builds and stores it. May be called by several threads.
  /// @return the errors of build_meshes(). An entry that cannot be written is no error: see CachedBuild::not_stored.
  build::Result<CachedBuild> build(const build::SceneInput& scene, const BuildRequest& request) const;

  std::filesystem::path file_of(const std::string& key) const;
  /// Removes what killed processes have left: temporary files and files of use.
  void clean() const;

 private:
  class Session;
  explicit BvhCache(std::filesystem::path folder);

  std::filesystem::path folder_;
  std::unique_ptr<Session> session_;  ///< While it lives, prune_cache() spares what this process uses.
};

/// Which entries prune_cache() removes.
struct PruneLimit {
  std::uint64_t bytes = UINT64_MAX;                        ///< The entries that were used last stay, up to this sum.
  std::chrono::seconds age = std::chrono::seconds::max();  ///< Entries that were not used for so long go.
};

struct PruneReport {
  std::uint64_t files = 0, bytes = 0;            ///< Removed.
  std::uint64_t kept_files = 0, kept_bytes = 0;  ///< Still there.
  std::uint64_t in_use = 0;                      ///< Entries of the limit that stayed because a process uses them.
};

/// Removes entries, those first that were not used for the longest time, and temporary files of dead processes. Entries
/// that a living process has used since it opened the cache stay.
/// @return kIo with the path and the reason.
build::Result<PruneReport> prune_cache(const std::filesystem::path& folder, const PruneLimit& limit);

/// "20G" or "500M" (bytes, of 1024), "30d" or "12h" (time). @return nothing for other texts.
std::optional<PruneLimit> parse_prune_limit(const std::string& text);

}  // namespace hiprt::tools
