// The functions for scenes.

#include <hiprt_build/hiprt_api/scene.h>

#include <algorithm>

using namespace hiprt;
using api::Result;

namespace {

bool all_valid(const hiprtSceneBuildInput* inputs, std::uint32_t count, bool builds = false) {
  return inputs != nullptr && count != 0 &&
         std::all_of(inputs, inputs + count, [&](const auto& input) { return api::is_valid(input, builds); });
}

template <class Pointer> bool all_there(Pointer* pointers, std::uint32_t count) {
  return pointers != nullptr && std::none_of(pointers, pointers + count, [](auto p) { return p == nullptr; });
}

}  // namespace

hiprtError hiprtCreateScene(hiprtContext context, const hiprtSceneBuildInput& input, hiprtBuildOptions options,
                            hiprtScene& out) {
  hiprtScene* address = &out;
  return hiprtCreateScenes(context, 1, &input, options, &address);
}

hiprtError hiprtCreateScenes(hiprtContext context, uint32_t count, const hiprtSceneBuildInput* inputs,
                             hiprtBuildOptions options, hiprtScene** outs) {
  if (context == nullptr || !all_valid(inputs, count) || !all_there(outs, count)) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtCreateScenes", [&] {
    return api::create_scenes(context, {inputs, count}, options, outs);
  });
}

hiprtError hiprtDestroyScene(hiprtContext context, hiprtScene scene) { return hiprtDestroyScenes(context, 1, &scene); }

hiprtError hiprtDestroyScenes(hiprtContext context, uint32_t count, hiprtScene* scenes) {
  if (context == nullptr || count == 0 || !all_there(scenes, count)) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtDestroyScenes", [&]() -> Result<void> {
    for (uint32_t i = 0; i < count; ++i) {
      if (context->scenes.find(scenes[i])) api::SceneRegistry::instance().remove(scenes[i]);
      if (!context->scenes.remove(scenes[i]))
        api::log(*context, hiprtLogLevelWarn, "hiprtDestroyScene: the scene is none of this context");
    }
    return {};
  });
}

hiprtError hiprtGetSceneBuildTemporaryBufferSize(hiprtContext context, const hiprtSceneBuildInput& input,
                                                 hiprtBuildOptions options, size_t& out) {
  return hiprtGetScenesBuildTemporaryBufferSize(context, 1, &input, options, out);
}

hiprtError hiprtGetScenesBuildTemporaryBufferSize(hiprtContext context, uint32_t count,
                                                  const hiprtSceneBuildInput* inputs, hiprtBuildOptions options,
                                                  size_t& out) {
  if (context == nullptr || !all_valid(inputs, count)) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtGetScenesBuildTemporaryBufferSize", [&]() -> Result<void> {
    const auto size = api::temporary_size(api::SceneInputs(inputs, count), options);
    if (!size) return tl::unexpected(size.error());
    out = static_cast<size_t>(*size);
    return {};
  });
}

hiprtError hiprtBuildScene(hiprtContext context, hiprtBuildOperation operation, const hiprtSceneBuildInput& input,
                           hiprtBuildOptions options, hiprtDevicePtr temporary, hiprtApiStream stream,
                           hiprtScene scene) {
  return hiprtBuildScenes(context, operation, 1, &input, options, temporary, stream, &scene);
}

hiprtError hiprtBuildScenes(hiprtContext context, hiprtBuildOperation operation, uint32_t count,
                            const hiprtSceneBuildInput* inputs, hiprtBuildOptions options, hiprtDevicePtr temporary,
                            hiprtApiStream stream, hiprtScene* scenes) {
  if (context == nullptr || !all_valid(inputs, count, true) || !all_there(scenes, count))
    return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtBuildScenes", [&] {
    return api::build_scenes(context, operation, {inputs, count}, options, temporary, static_cast<hipStream_t>(stream),
                             scenes);
  });
}

hiprtError hiprtCompactScene(hiprtContext context, hiprtApiStream stream, hiprtScene in, hiprtScene& out) {
  hiprtScene* address = &out;
  return hiprtCompactScenes(context, 1, stream, &in, &address);
}

hiprtError hiprtCompactScenes(hiprtContext context, uint32_t count, hiprtApiStream, hiprtScene* ins,
                              hiprtScene** outs) {
  if (context == nullptr || count == 0 || !all_there(ins, count) || !all_there(outs, count))
    return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtCompactScenes", [&]() -> Result<void> {
    for (uint32_t i = 0; i < count; ++i)
      if (!context->scenes.find(ins[i]))
        return gpu::fail(build::ErrorCode::kInvalidInput, "scene ", i, " is none of this context");
    // A scene's tables have their exact sizes already: it stays where it is, under its old handle.
    for (uint32_t i = 0; i < count; ++i) *outs[i] = ins[i];
    return {};
  });
}
