#pragma once
/// A scene with the BVHs of all tracers.

#include "variants.h"

#include <benchmarks/common/embree_scene.h>
#include <benchmarks/common/scenes.h>

#include <hiprt_build/build.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace hiprt::bench {

class TraceScene {
 public:
  /// Loads the scene and its rays and builds all BVHs.
  static build::Result<std::unique_ptr<TraceScene>> make(const SceneOptions& options, const std::string& name,
                                                         std::uint32_t wanted_rays);

  const std::string& name() const { return name_; }
  /// @return nullptr if the scene has no such rays.
  const RaySet* rays(const std::string& kind) const;
  const SceneView& view(const Variant& variant) const { return trees_.at({variant.layout, variant.builder}).view; }
  RTCScene embree_robust() const { return embree_[0].get(); }
  RTCScene embree_default() const { return embree_[1].get(); }
  /// Largest coordinate in magnitude: the unit of rounding errors.
  float reach() const;

 private:
  struct Tree {
    build::Bvh bvh;
    SceneView view;
  };

  build::Result<void> build_trees(const Scene& scene);
  build::Result<void> build_embree(const Scene& scene);

  std::string name_;
  std::vector<RaySet> rays_;
  std::map<std::pair<NodeLayout, build::Builder>, Tree> trees_;
  std::vector<EmbreeScene> embree_;
};

}  // namespace hiprt::bench
