#pragma once
/// A mesh in Embree.

#include <hiprt_build/embree/rtcore.h>
#include <hiprt_build/error.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <atomic>
#include <cstdint>
#include <memory>

namespace hiprt::bench {

struct EmbreeOptions {
  RTCSceneFlags flags = RTC_SCENE_FLAG_ROBUST;
  RTCBuildQuality quality = RTC_BUILD_QUALITY_MEDIUM;
  unsigned threads = 0;  ///< Of the build; 0: as many as the machine has.
};

/// A mesh as an Embree scene with its own device. While a device with a number of threads lives, Embree limits the
/// threads of the whole process.
class EmbreeScene {
 public:
  EmbreeScene(EmbreeScene&&) noexcept = default;
  EmbreeScene& operator=(EmbreeScene&&) = delete;
  ~EmbreeScene() = default;

  /// Copies the mesh into Embree's buffers. commit() builds the BVH.
  /// @return kBackend with Embree's error.
  static build::Result<EmbreeScene> make(const tools::Mesh& mesh, const EmbreeOptions& options);

  /// @return kBackend with Embree's error.
  build::Result<void> commit();

  RTCScene get() const { return scene_.get(); }
  /// What the device holds now and held at most, in bytes: mesh and tree.
  std::int64_t bytes() const { return memory_->now; }
  std::int64_t peak_bytes() const { return memory_->peak; }

 private:
  EmbreeScene() = default;

  struct Memory {
    std::atomic<std::int64_t> now{0}, peak{0};
  };
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };

  static bool on_memory(void* user, ssize_t bytes, bool after);
  build::Result<void> check(const char* what) const;
  build::Result<void> add(const tools::Mesh& mesh, RTCBuildQuality quality);

  std::unique_ptr<Memory> memory_;  ///< Outlives the device, which reports to it.
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::unique_ptr<RTCSceneTy, Release> scene_;
};

}  // namespace hiprt::bench
