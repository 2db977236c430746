#pragma once
/// Scenes of Embree in the terms of this library: an independent reference.

#include <hiprt_build/instances.h>
#include <hiprt_device/ray.h>
#include <tests/oracle/mesh.h>

#include <hiprt_build/embree/rtcore.h>

#include <memory>
#include <span>

namespace hiprt::checks {

/// Which instance was hit too; kInvalidId: a triangle of the scene itself.
struct EmbreeHit : Hit {
  std::uint32_t instance = kInvalidId;
};

/// From when to when keys are, at equal distances; at least [0, 1], as outside Embree has no geometry.
struct KeyRange {
  float begin = 0.0f, end = 1.0f;
};

class EmbreeScene {
 public:
  explicit EmbreeScene(RTCSceneFlags flags = RTC_SCENE_FLAG_ROBUST);

  /// @return its number, which hits have; of instances too.
  unsigned add(const oracle::Mesh& mesh) { return add({&mesh, 1}, {}); }
  /// A mesh that deforms: the same triangles at every key.
  unsigned add(std::span<const oracle::Mesh> keys, const KeyRange& range);
  /// An instance of a committed scene that has none itself, between matrices; of one that stands still.
  unsigned add(const EmbreeScene& object, std::span<const build::Affine> keys, const KeyRange& range = {});
  /// Between parts. Rotations have length 1.
  unsigned add(const EmbreeScene& object, std::span<const build::MotionKey> keys, const KeyRange& range);
  /// Behind the last add(), before the first ray. @throw std::runtime_error if Embree has found a fault.
  void commit();

  RTCScene get() const { return scene_.get(); }
  /// At the ray's time, in [0, 1].
  EmbreeHit closest(const Ray& ray) const;
  bool any(const Ray& ray) const;
  /// Where Embree has an instance at a time.
  build::Affine transform(unsigned instance, float time) const;

 private:
  unsigned attach(RTCGeometry geometry);

  template <auto release> struct Release {
    template <class T> void operator()(T* object) const { release(object); }
  };
  std::shared_ptr<RTCDeviceTy> device_;
  std::unique_ptr<RTCSceneTy, Release<rtcReleaseScene>> scene_;
};

}  // namespace hiprt::checks
