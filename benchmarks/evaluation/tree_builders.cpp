#include "tree_builders.h"

#include <benchmarks/common/rounds.h>

#include <tools/build/gpu_builder.h>

#include <optional>
#include <utility>

namespace hiprt::bench {
namespace {

class CpuTreeBuilder : public TreeBuilder {
 public:
  CpuTreeBuilder(build::Builder kind, const tools::ThreadLimit& limit) : TreeBuilder(kind), limit_(limit) {}

  bool on_cpu() const override { return true; }

  build::Result<build::Bvh> build_flat(const Hierarchy& hierarchy, double& seconds) const override {
    std::optional<build::Result<build::Bvh>> bvh;
    const auto meshes = tools::views(hierarchy.geometries);
    seconds = time_of([&] { bvh.emplace(build_meshes(meshes, limit_.threads())); });
    return std::move(*bvh);
  }

  build::Result<void> build_objects(const Hierarchy& hierarchy, std::vector<build::Buffer>& files,
                                    double& seconds) const override {
    build::Result<void> done;
    seconds = time_of([&] {
      done = for_each_object(hierarchy, limit_, [&](std::size_t i, unsigned threads) -> build::Result<void> {
        auto bvh = build_meshes(hierarchy.object(i), threads);
        if (!bvh) return tl::unexpected(std::move(bvh.error()));
        files[i] = std::move(bvh->buffer);
        return {};
      });
    });
    return done;
  }

 private:
  build::Result<build::Bvh> build_meshes(std::span<const build::TriangleMesh> meshes, unsigned threads) const {
    return build::build(meshes, {.builder = kind(), .threads = threads});
  }

  const tools::ThreadLimit& limit_;
};

class GpuTreeBuilder : public TreeBuilder {
 public:
  explicit GpuTreeBuilder(build::Builder kind) : TreeBuilder(kind) {}

  bool on_cpu() const override { return false; }

  build::Result<build::Bvh> build_flat(const Hierarchy& hierarchy, double& seconds) const override {
    return build_meshes(tools::views(hierarchy.geometries), seconds);
  }

  build::Result<void> build_objects(const Hierarchy& hierarchy, std::vector<build::Buffer>& files,
                                    double& seconds) const override {
    for (std::size_t i = 0; i < files.size(); ++i) {
      double one = 0;
      auto bvh = build_meshes(hierarchy.object(i), one);
      if (!bvh)
        return tl::unexpected(
            build::Error{bvh.error().code, hierarchy.source->objects[i].name + ": " + bvh.error().message});
      seconds += one;
      files[i] = std::move(bvh->buffer);
    }
    return {};
  }

 private:
  build::Result<build::Bvh> build_meshes(std::span<const build::TriangleMesh> meshes, double& seconds) const {
    auto bvh = tools::build_on_gpu(meshes, {.builder = kind()});
    if (bvh) seconds = bvh->statistics.tree_seconds;
    return bvh;
  }
};

bool is_embree(build::Builder kind) {
  return kind == build::Builder::kEmbreeLow || kind == build::Builder::kEmbreeMedium ||
         kind == build::Builder::kEmbreeHigh;
}

}  // namespace

std::unique_ptr<TreeBuilder> make_tree_builder(build::Builder kind, const Machine& machine) {
  if (machine.gpu && !is_embree(kind)) return std::make_unique<GpuTreeBuilder>(kind);
  return std::make_unique<CpuTreeBuilder>(kind, machine.limit);
}

}  // namespace hiprt::bench
