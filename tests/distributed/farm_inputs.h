#pragma once
/// Assets for bvhbuild --manifest, and the cache that they make.

#include <tests/tools/json_result.h>
#include <tests/tools/programs.h>

#include <map>

namespace hiprt::test {

namespace fs = std::filesystem;

inline const std::vector<unsigned> kSizes{3, 40, 10, 70, 25, 5, 55, 2};

/// Writes meshes and a manifest of them. @return its path.
inline std::string write_assets(const TempFolder& folder) {
  nlohmann::json assets = nlohmann::json::array();
  for (const unsigned size : kSizes) {
    const std::string name = "grid" + std::to_string(size);
    folder.write(name + ".obj", grid_obj(size, static_cast<float>(size)));
    assets.push_back({{"name", name}, {"files", {name + ".obj"}}, {"quality", size % 2 == 0 ? "high" : "fast"}});
  }
  return folder
      .write("assets.json", nlohmann::json{{"format", "hiprt assets"}, {"version", 1}, {"assets", assets}}.dump(1))
      .string();
}

inline std::vector<std::string> farm(const std::string& manifest, const fs::path& cache,
                                     std::vector<std::string> more = {}) {
  std::vector<std::string> result{kBvhBuild, "--manifest", manifest, "--cache", cache.string(), "--threads", "1"};
  result.insert(result.end(), more.begin(), more.end());
  return result;
}

/// Relative path and content of every file of a cache, except locks.
inline std::map<std::string, std::string> content_of(const fs::path& cache) {
  std::map<std::string, std::string> result;
  for (const auto& entry : fs::recursive_directory_iterator(cache))
    if (entry.is_regular_file() && entry.path().filename() != ".lock")
      result[fs::relative(entry.path(), cache).string()] = read_file(entry.path());
  return result;
}

/// The cache that one process makes.
inline std::map<std::string, std::string> expected_content(const TempFolder& folder, const std::string& manifest) {
  check_quiet(run(farm(manifest, folder / "expected")));
  auto content = content_of(folder / "expected");
  REQUIRE(content.size() == kSizes.size());
  return content;
}

}  // namespace hiprt::test
