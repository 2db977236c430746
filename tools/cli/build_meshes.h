#pragma once
/// BVHs of meshes and shapes as bvhbuild's command line asks for them, on the CPU or the GPU.

#include <tools/cli/build_command.h>

#include <hiprt_build/build.h>
#include <hiprt_build/exchange.h>

#include <optional>
#include <span>

namespace hiprt::tools {

struct Built {
  build::Bvh bvh;
  build::Builder builder;  ///< That was asked for.
  bool on_gpu;
};

/// May a GPU be asked to build?
bool may_use_gpu(const BuildCommand& command);

/// @param options of build_options(). @param tree to take in place of a builder's.
build::Result<Built> build_meshes(const build::SceneInput& scene, const BuildCommand& command,
                                  build::BuildOptions options, const std::optional<build::ExchangeBvh>& tree = {});

}  // namespace hiprt::tools
