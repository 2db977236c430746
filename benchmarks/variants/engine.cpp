#include "engine.h"

#include <hiprt_build/format/only_instance.h>

namespace hiprt::bench {

build::Result<void> Engine::set_tree(const Tree& tree) {
  scene_ = {};
  boxes_ = {};
  auto scene = device_->load(tree.view);
  if (!scene) return tl::unexpected(scene.error());
  scene_ = std::move(*scene);
  placed_ = only_instance(tree.view, scene_.view.base);
  auto boxes = Array<Box>::copy(*device_, tree.boxes);
  if (!boxes) return tl::unexpected(boxes.error());
  boxes_ = std::move(*boxes);
  return {};
}

#if !HIPRT_BENCH_GPU
build::Result<std::unique_ptr<Engine>> make_gpu_engine() { return tl::unexpected(make_gpu_device().error()); }
#endif

}  // namespace hiprt::bench
