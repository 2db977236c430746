#include <hiprt_build/hiprt_api/scene.h>

namespace hiprt::api {

SceneRegistry& SceneRegistry::instance() {
  static SceneRegistry registry;
  return registry;
}

void SceneRegistry::set(const void* handle, const BuiltSceneParts& parts) {
  const std::scoped_lock lock(mutex_);
  scenes_[handle] = parts;
}

void SceneRegistry::remove(const void* handle) {
  const std::scoped_lock lock(mutex_);
  scenes_.erase(handle);
}

std::optional<BuiltSceneParts> SceneRegistry::find(const void* handle) const {
  const std::scoped_lock lock(mutex_);
  const auto at = scenes_.find(handle);
  return at == scenes_.end() ? std::nullopt : std::optional(at->second);
}

bool SceneRegistry::has_other(const void* handle) const {
  const std::scoped_lock lock(mutex_);
  return scenes_.size() > scenes_.count(handle);
}

}  // namespace hiprt::api
