#pragma once
/// What is to be built and where: the command line of bvhbuild in the library's terms.

#include <tools/base/device_choice.h>

#include <hiprt_build/build.h>
#include <hiprt_build/instances.h>

#include <string>

namespace hiprt::tools {

class BvhCache;

struct BuildRequest {
  build::BuildOptions options;         ///< Of every object of a scene. build_scene() replaces the progress callback.
  build::InstanceOptions instances{};  ///< build_scene() derives its `tree` from `options`.
  DeviceChoice device = DeviceChoice::kCpu;
  std::string tree_path{};          ///< File of the imported tree, for messages.
  const BvhCache* cache = nullptr;  ///< Of the files of objects and meshes; nullptr: all are built.
};

}  // namespace hiprt::tools
