#include <tools/scene_io/scene/scene_file.h>

#include <tools/base/memory_limit.h>
#include <tools/scene_io/scene/scene_binary.h>
#include <tools/scene_io/scene/scene_json.h>

#include <algorithm>
#include <cctype>
#include <string_view>

namespace hiprt::tools {
namespace {

/// In any case.
bool ends_with(std::string name, std::string_view ending) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name.ends_with(ending);
}

}  // namespace

bool is_scene_file(const std::string& path) { return ends_with(path, ".json") || ends_with(path, ".scene"); }

build::Result<SceneDescription> read_scene_file(const std::string& path) try {
  return ends_with(path, ".json") ? read_scene_json(path) : read_scene_binary(path);
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path, "to read it", failure));
}

}  // namespace hiprt::tools
