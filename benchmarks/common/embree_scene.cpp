#include "embree_scene.h"

#include <cstring>
#include <string>
#include <utility>

namespace hiprt::bench {

build::Result<EmbreeScene> EmbreeScene::make(const tools::Mesh& mesh, const EmbreeOptions& options) {
  EmbreeScene made;
  made.memory_ = std::make_unique<Memory>();
  made.device_.reset(rtcNewDevice(("threads=" + std::to_string(options.threads)).c_str()));
  if (made.device_ == nullptr)
    return tl::unexpected(build::Error{build::ErrorCode::kBackend,
                                       "Embree: rtcNewDevice error " + std::to_string(rtcGetDeviceError(nullptr))});
  rtcSetDeviceMemoryMonitorFunction(made.device_.get(), &on_memory, made.memory_.get());
  made.scene_.reset(rtcNewScene(made.device_.get()));
  rtcSetSceneFlags(made.scene_.get(), options.flags);
  rtcSetSceneBuildQuality(made.scene_.get(), options.quality);
  if (auto added = made.add(mesh, options.quality); !added) return tl::unexpected(added.error());
  return made;
}

build::Result<void> EmbreeScene::commit() {
  rtcCommitScene(scene_.get());
  return check("rtcCommitScene");
}

bool EmbreeScene::on_memory(void* user, ssize_t bytes, bool) {
  auto& memory = *static_cast<Memory*>(user);
  const std::int64_t now = memory.now.fetch_add(bytes) + bytes;
  std::int64_t peak = memory.peak;
  while (now > peak && !memory.peak.compare_exchange_weak(peak, now)) {
  }
  return true;
}

build::Result<void> EmbreeScene::check(const char* what) const {
  const RTCError error = rtcGetDeviceError(device_.get());
  if (error == RTC_ERROR_NONE) return {};
  return tl::unexpected(build::Error{build::ErrorCode::kBackend, std::string("Embree: ") + what + " error " +
                                                                     std::to_string(static_cast<int>(error))});
}

build::Result<void> EmbreeScene::add(const tools::Mesh& mesh, RTCBuildQuality quality) {
  const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  void* positions = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                            sizeof(build::Position), mesh.positions.size());
  void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            sizeof(build::Triangle), mesh.triangles.size());
  if (positions != nullptr && triangles != nullptr) {
    std::memcpy(positions, mesh.positions.data(), mesh.positions.size() * sizeof(build::Position));
    std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(build::Triangle));
    rtcSetGeometryBuildQuality(geometry, quality);  // Scenes of low quality have a tree per geometry.
    rtcSetGeometryMask(geometry, 0xffffffffu);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
  }
  rtcReleaseGeometry(geometry);
  return check("geometry");
}

}  // namespace hiprt::bench
