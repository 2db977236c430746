#include "embree_scenes.h"

#include "check_range.h"
#include "instanced_spheres.h"

#include <benchmarks/trace/embree_trace.h>

#include <exception>

namespace hiprt::bench {
namespace {

constexpr std::array kFlags{RTC_SCENE_FLAG_NONE, RTC_SCENE_FLAG_ROBUST};

/// The tracer of check_range().
struct EmbreeTracer {
  RTCScene scene;

  Hit closest(const Ray& ray) const {
    Hit hit;
    embree_trace(scene, false, {&ray, 1}, {&hit, 1});
    return hit;
  }
};

void check_rays(const void* job, std::uint64_t begin, std::uint64_t end) {
  const Work& work = *static_cast<const Work*>(job);
  check_range(work, begin, end, EmbreeTracer{work.embree});
}

void trace_rays(const void* job, std::uint64_t begin, std::uint64_t end) {
  const Work& work = *static_cast<const Work*>(job);
  const Target& target = work.probe.target;
  embree_trace(work.embree, false, {target.rays + begin, end - begin}, {target.hits + begin, end - begin});
}

/// Debian's Embree has one level of instances, with slerp or matrices.
bool has_equivalent(const InstancedSphere& sphere) {
  const build::Motion* motion = sphere.chain[0].motion;
  return sphere.chain.size() == 1 && (motion == nullptr || motion->kind != MotionKind::kNlerp);
}

/// @throw std::runtime_error from Embree.
std::unique_ptr<checks::EmbreeScene> make_scene(const InstancedSphere& sphere, RTCSceneFlags flags) {
  checks::EmbreeScene object(flags);
  object.add(sphere.mesh);
  object.commit();
  auto scene = std::make_unique<checks::EmbreeScene>(flags);
  const build::Motion* motion = sphere.chain[0].motion;
  std::vector<build::Affine> matrices;
  if (motion == nullptr) matrices = {sphere.chain[0].to_scene};
  if (motion != nullptr && motion->kind == MotionKind::kMatrix)
    for (const build::MotionKey& key : motion->keys) matrices.push_back(build::compose(key).to_scene);
  if (matrices.empty())
    scene->add(object, motion->keys, {});
  else
    scene->add(object, matrices);
  scene->commit();
  return scene;
}

}  // namespace

build::Result<void> EmbreeScenes::set_model(const Model& model) {
  spheres_ = {};
  // Both devices end before a new one starts: Embree limits the threads of the whole process.
  for (auto& scene : models_) scene.reset();
  for (std::size_t i = 0; i < kFlags.size(); ++i) {
    auto scene = EmbreeScene::make(model.mesh, {.flags = kFlags[i]});
    if (!scene) return tl::unexpected(scene.error());
    if (auto done = scene->commit(); !done) return done;
    models_[i].emplace(std::move(*scene));
  }
  return {};
}

build::Result<void> EmbreeScenes::set_sphere(const InstancedSphere& sphere) {
  spheres_ = {};
  if (!has_equivalent(sphere)) return {};
  for (std::size_t i = 0; i < kFlags.size(); ++i) {
    try {
      spheres_[i] = make_scene(sphere, kFlags[i]);
    } catch (const std::exception& error) {
      return tl::unexpected(build::Error{build::ErrorCode::kBackend, error.what()});
    }
  }
  return {};
}

Kernels embree_kernels() { return {{.cpu = check_rays}, {.cpu = trace_rays}}; }

}  // namespace hiprt::bench
