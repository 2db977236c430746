#include <tools/build/build_meshes.h>

#include <tools/base/interrupt.h>
#include <tools/build/gpu_builder.h>

#include <utility>

namespace hiprt::tools {
namespace {

/// Whether a GPU cannot do it.
bool needs_cpu(const build::BuildOptions& wanted, bool imported) {
  return imported || wanted.builder > build::Builder::kHq;
}

/// @return the GPU's BVH, or nothing if the CPU is to build.
build::Result<std::optional<build::Bvh>> try_gpu(const build::SceneInput& scene, const BuildRequest& request,
                                                 bool imported) {
  const bool cpu_only = needs_cpu(request.options, imported) || !scene.customs.empty();
  const bool optional = request.device == DeviceChoice::kAuto;
  if (request.device == DeviceChoice::kCpu || (optional && cpu_only)) return std::nullopt;
  if (cpu_only)
    return invalid_input(scene.customs.empty() ? "a GPU builds neither Embree's trees nor imported ones"
                                               : "spheres and curves are built on the CPU: use --device auto or cpu");
  auto bvh = build_on_gpu(scene.meshes, request.options);
  if (bvh) return std::optional<build::Bvh>(std::move(*bvh));
  if (optional && bvh.error().code == build::ErrorCode::kNoDevice) return std::nullopt;
  return fail(bvh.error().code, "GPU: " + bvh.error().message);
}

}  // namespace

build::Result<Built> build_meshes(const build::SceneInput& scene, const BuildRequest& request,
                                  const std::optional<build::ExchangeBvh>& tree) {
  const build::BuildOptions& options = request.options;
  auto gpu = try_gpu(scene, request, tree.has_value());
  if (!gpu) return tl::unexpected(std::move(gpu.error()));
  if (*gpu) return Built{std::move(**gpu), options.builder, true};
  auto bvh = tree ? build::import_tree(scene, *tree, options) : build::build(scene, options);
  if (interrupted()) return cancelled();
  if (!bvh && tree) bvh.error().message.insert(0, request.tree_path + ": ");
  if (!bvh) return tl::unexpected(std::move(bvh.error()));
  return Built{std::move(*bvh), tree ? build::Builder::kImported : options.builder, false};
}

build::TriangleMesh view_of(const Mesh& mesh) {
  // Files may hold points that no triangle uses, and nothing else.
  if (mesh.triangles.empty()) return {.name = mesh.name};
  return {mesh.positions, mesh.triangles, 0xffffffffu, mesh.name};
}

std::vector<build::TriangleMesh> views(std::span<const Mesh> meshes) {
  std::vector<build::TriangleMesh> result;
  result.reserve(meshes.size());
  for (const Mesh& mesh : meshes) result.push_back(view_of(mesh));
  return result;
}

}  // namespace hiprt::tools
