#pragma once
/// The models and instanced spheres as Embree scenes, each without and with Embree's robust flag.

#include "kernels.h"
#include "model.h"

#include <benchmarks/common/embree_scene.h>
#include <tests/oracle/embree_scene.h>

#include <array>
#include <memory>
#include <optional>

namespace hiprt::bench {

struct InstancedSphere;

class EmbreeScenes {
 public:
  /// @return kBackend with Embree's error.
  build::Result<void> set_model(const Model& model);
  /// @return kBackend with Embree's error.
  build::Result<void> set_sphere(const InstancedSphere& sphere);

  RTCScene model(bool robust) const { return models_[robust ? 1 : 0]->get(); }
  /// @return nullptr if Embree cannot represent the instances: Debian's Embree has one level, and no nlerp.
  RTCScene sphere(bool robust) const {
    const auto& scene = spheres_[robust ? 1 : 0];
    return scene == nullptr ? nullptr : scene->get();
  }

 private:
  std::array<std::optional<EmbreeScene>, 2> models_;
  std::array<std::unique_ptr<checks::EmbreeScene>, 2> spheres_;
};

/// Kernels that trace Work::embree.
Kernels embree_kernels();

}  // namespace hiprt::bench
