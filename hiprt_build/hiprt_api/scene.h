#pragma once
/// Creation and builds of scenes. Internal.

#include <hiprt_build/hiprt_api/context.h>
#include <hiprt_build/hiprt_api/kernels.h>

#include <optional>
#include <span>

namespace hiprt::api {

using SceneInputs = std::span<const hiprtSceneBuildInput>;

/// What an outer scene needs to know of an inner one.
struct BuiltSceneParts {
  std::uint32_t instances = 0;
  std::uint32_t objects = 0;             ///< Size of its object table.
  const InstanceRecord* more = nullptr;  ///< Copies of the records of the scenes inside of it.
  std::uint32_t more_count = 0;
};

/// The built scenes of all contexts: a scene may hold scenes of another context on the same device.
class SceneRegistry {
 public:
  static SceneRegistry& instance();
  void set(const void* handle, const BuiltSceneParts& parts);
  void remove(const void* handle);
  std::optional<BuiltSceneParts> find(const void* handle) const;
  /// Whether there is a scene besides @p handle.
  bool has_other(const void* handle) const;

 private:
  mutable std::mutex mutex_;
  std::map<const void*, BuiltSceneParts> scenes_;
};

/// Whether counts are there, and the pointer that a build reads.
inline bool is_valid(const hiprtSceneBuildInput& input, bool builds) {
  return input.instanceCount != 0 && (!builds || input.instances != nullptr);
}

/// The largest of all scenes: they are built one after the other.
Result<std::uint64_t> temporary_size(SceneInputs inputs, const hiprtBuildOptions& options);
Result<void> create_scenes(hiprtContext context, SceneInputs inputs, const hiprtBuildOptions& options,
                           hiprtScene* const* outs);
Result<void> build_scenes(hiprtContext context, hiprtBuildOperation operation, SceneInputs inputs,
                          const hiprtBuildOptions& options, void* temporary, hipStream_t stream,
                          const hiprtScene* scenes);

}  // namespace hiprt::api
