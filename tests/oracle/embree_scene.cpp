#include <tests/oracle/embree_scene.h>

#include <cstring>
#include <limits>
#include <stdexcept>

namespace hiprt::checks {
namespace {

/// One for all scenes: an instance and its object have to share it.
std::shared_ptr<RTCDeviceTy> shared_device() {
  static std::weak_ptr<RTCDeviceTy> known;
  std::shared_ptr<RTCDeviceTy> device = known.lock();
  if (!device) {
    device.reset(rtcNewDevice("threads=2"), rtcReleaseDevice);
    known = device;
  }
  return device;
}

RTCRay embree_ray(const Ray& ray) {
  RTCRay r{};
  r.org_x = ray.origin.x, r.org_y = ray.origin.y, r.org_z = ray.origin.z, r.tnear = ray.tmin;
  r.dir_x = ray.direction.x, r.dir_y = ray.direction.y, r.dir_z = ray.direction.z, r.tfar = ray.tmax;
  r.time = ray.time;
  r.mask = ray.mask;
  return r;
}

RTCQuaternionDecomposition embree_key(const build::MotionKey& key) {
  RTCQuaternionDecomposition parts{};
  parts.scale_x = key.scale[0], parts.scale_y = key.scale[1], parts.scale_z = key.scale[2];
  parts.skew_xy = key.shear[0], parts.skew_xz = key.shear[1], parts.skew_yz = key.shear[2];
  parts.quaternion_i = key.rotation[0], parts.quaternion_j = key.rotation[1], parts.quaternion_k = key.rotation[2];
  parts.quaternion_r = key.rotation[3];
  parts.translation_x = key.translation[0], parts.translation_y = key.translation[1];
  parts.translation_z = key.translation[2];
  return parts;
}

RTCGeometry new_instance(RTCDevice device, RTCScene object, std::size_t keys, const KeyRange& range) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, object);
  rtcSetGeometryTimeStepCount(geometry, static_cast<unsigned>(keys));
  if (keys > 1) rtcSetGeometryTimeRange(geometry, range.begin, range.end);
  return geometry;
}

}  // namespace

EmbreeScene::EmbreeScene(RTCSceneFlags flags) : device_(shared_device()) {
  if (!device_) throw std::runtime_error("Embree makes no device");
  scene_.reset(rtcNewScene(device_.get()));
  rtcSetSceneFlags(scene_.get(), flags);
}

unsigned EmbreeScene::add(std::span<const oracle::Mesh> keys, const KeyRange& range) {
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetGeometryTimeStepCount(geometry, static_cast<unsigned>(keys.size()));
  if (keys.size() > 1) rtcSetGeometryTimeRange(geometry, range.begin, range.end);
  const auto fill = [&](RTCBufferType type, unsigned slot, RTCFormat format, const auto& elements) {
    const std::size_t stride = sizeof(elements[0]);
    void* to = rtcSetNewGeometryBuffer(geometry, type, slot, format, stride, elements.size());
    std::memcpy(to, elements.data(), elements.size() * stride);
  };
  for (unsigned k = 0; k < keys.size(); ++k) fill(RTC_BUFFER_TYPE_VERTEX, k, RTC_FORMAT_FLOAT3, keys[k].positions);
  fill(RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, keys[0].triangles);
  return attach(geometry);
}

unsigned EmbreeScene::add(const EmbreeScene& object, std::span<const build::Affine> keys, const KeyRange& range) {
  RTCGeometry geometry = new_instance(device_.get(), object.scene_.get(), keys.size(), range);
  for (unsigned k = 0; k < keys.size(); ++k) {
    float columns[4][3];
    for (unsigned c = 0; c < 4; ++c)
      for (unsigned r = 0; r < 3; ++r) columns[c][r] = keys[k].row[r][c];
    rtcSetGeometryTransform(geometry, k, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
  }
  return attach(geometry);
}

unsigned EmbreeScene::add(const EmbreeScene& object, std::span<const build::MotionKey> keys, const KeyRange& range) {
  RTCGeometry geometry = new_instance(device_.get(), object.scene_.get(), keys.size(), range);
  for (unsigned k = 0; k < keys.size(); ++k) {
    const RTCQuaternionDecomposition parts = embree_key(keys[k]);
    rtcSetGeometryTransformQuaternion(geometry, k, &parts);
  }
  return attach(geometry);
}

unsigned EmbreeScene::attach(RTCGeometry geometry) {
  rtcSetGeometryMask(geometry, 0xffffffffu);
  rtcCommitGeometry(geometry);
  const unsigned number = rtcAttachGeometry(scene_.get(), geometry);
  rtcReleaseGeometry(geometry);
  return number;
}

void EmbreeScene::commit() {
  rtcCommitScene(scene_.get());
  if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE) throw std::runtime_error("Embree refuses a scene");
}

EmbreeHit EmbreeScene::closest(const Ray& ray) const {
  RTCRayHit both{embree_ray(ray), {}};
  both.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  both.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  embree::intersect1(scene_.get(), both);
  EmbreeHit hit;
  if (both.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  hit.t = both.ray.tfar;
  hit.u = both.hit.u;
  hit.v = both.hit.v;
  hit.geometry = both.hit.geomID;
  hit.primitive = both.hit.primID;
  hit.instance = both.hit.instID[0];
  return hit;
}

bool EmbreeScene::any(const Ray& ray) const {
  RTCRay r = embree_ray(ray);
  embree::occluded1(scene_.get(), r);
  return r.tfar == -std::numeric_limits<float>::infinity();
}

build::Affine EmbreeScene::transform(unsigned instance, float time) const {
  float columns[4][3];
  rtcGetGeometryTransform(rtcGetGeometry(scene_.get(), instance), time, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
  build::Affine result;
  for (unsigned c = 0; c < 4; ++c)
    for (unsigned r = 0; r < 3; ++r) result.row[r][c] = columns[c][r];
  return result;
}

}  // namespace hiprt::checks
