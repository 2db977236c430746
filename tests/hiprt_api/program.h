#pragma once
/// A context of the library, and device memory, for the tests.

#include <tests/catch.h>
#include <tests/hiprt_api/trace.h>

#include <hiprt/hiprt.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

namespace hiprt_api_test {

#if defined(__HIP_PLATFORM_NVIDIA__)
inline constexpr hiprtDeviceType kDeviceType = hiprtDeviceNVIDIA, kOtherDeviceType = hiprtDeviceAMD;
#else
inline constexpr hiprtDeviceType kDeviceType = hiprtDeviceAMD, kOtherDeviceType = hiprtDeviceNVIDIA;
#endif

#define HIPRT_OK(call) REQUIRE((call) == hiprtSuccess)
#define HIP_OK(call) REQUIRE((call) == hipSuccess)

/// Owns what a test has on the device.
class Program {
 public:
  Program() {
    HIP_OK(hipSetDevice(0));
    HIP_OK(hipDeviceSynchronize());
    // The primary context of device 0.
    const hiprtContextCreationInput input{nullptr, 0, kDeviceType};
    HIPRT_OK(hiprtCreateContext(HIPRT_API_VERSION, input, context));
    HIPRT_OK(hiprtSetLogLevel(context, hiprtLogLevelError | hiprtLogLevelWarn));
  }
  ~Program() {
    for (void* pointer : memory_) static_cast<void>(hipFree(pointer));
    hiprtDestroyContext(context);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void* take(size_t bytes) {
    void* pointer = nullptr;
    HIP_OK(hipMalloc(&pointer, bytes == 0 ? 1 : bytes));
    memory_.push_back(pointer);
    return pointer;
  }
  template <class T> T* copy(const std::vector<T>& values) {
    void* const pointer = take(values.size() * sizeof(T));
    HIP_OK(hipMemcpy(pointer, values.data(), values.size() * sizeof(T), hipMemcpyHostToDevice));
    return static_cast<T*>(pointer);
  }
  template <class T> std::vector<T> read(const T* from, size_t count) {
    std::vector<T> values(count);
    HIP_OK(hipMemcpy(values.data(), from, count * sizeof(T), hipMemcpyDeviceToHost));
    return values;
  }

  hiprtGeometry build(const hiprtGeometryBuildInput& input, hiprtBuildFlags flags = 0) {
    const hiprtBuildOptions options{flags, 0};
    hiprtGeometry geometry = nullptr;
    HIPRT_OK(hiprtCreateGeometry(context, input, options, geometry));
    rebuild(input, flags, geometry, hiprtBuildOperationBuild);
    return geometry;
  }
  void rebuild(const hiprtGeometryBuildInput& input, hiprtBuildFlags flags, hiprtGeometry geometry,
               hiprtBuildOperation operation) {
    const hiprtBuildOptions options{flags, 0};
    size_t size = 0;
    HIPRT_OK(hiprtGetGeometryBuildTemporaryBufferSize(context, input, options, size));
    HIPRT_OK(hiprtBuildGeometry(context, operation, input, options, take(size), nullptr, geometry));
  }
  hiprtScene build(const hiprtSceneBuildInput& input, hiprtBuildFlags flags = 0) {
    const hiprtBuildOptions options{flags, 0};
    hiprtScene scene = nullptr;
    HIPRT_OK(hiprtCreateScene(context, input, options, scene));
    rebuild(input, flags, scene, hiprtBuildOperationBuild);
    return scene;
  }
  void rebuild(const hiprtSceneBuildInput& input, hiprtBuildFlags flags, hiprtScene scene,
               hiprtBuildOperation operation) {
    const hiprtBuildOptions options{flags, 0};
    size_t size = 0;
    HIPRT_OK(hiprtGetSceneBuildTemporaryBufferSize(context, input, options, size));
    HIPRT_OK(hiprtBuildScene(context, operation, input, options, take(size), nullptr, scene));
  }

  std::vector<hiprtHit> trace(hipError_t (*kernel)(const Trace&), const void* object, const std::vector<hiprtRay>& rays,
                              hiprtFuncTable table = nullptr, uint32_t mask = hiprtFullRayMask, float time = 0.0f) {
    auto* const hits = static_cast<hiprtHit*>(take(rays.size() * sizeof(hiprtHit)));
    last = {object, table, copy(rays), hits, static_cast<uint32_t>(rays.size()), mask, time};
    HIP_OK(kernel(last));
    return read(hits, rays.size());
  }

  hiprtContext context = nullptr;
  Trace last{};  ///< Of the last trace().

 private:
  std::vector<void*> memory_;
};

using Point = hiprtFloat3;

inline hiprtRay ray_at(float x, float y, float z = 10.0f) {
  hiprtRay ray;
  ray.origin = {x, y, z};
  ray.direction = {0, 0, -1};
  return ray;
}

/// Triangles without common corners, in the unit cube.
struct Mesh {
  std::vector<Point> points;
  std::vector<uint32_t> indices;

  static Mesh soup(uint32_t count, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> in(0.0f, 1.0f), near(-0.15f, 0.15f);
    Mesh mesh;
    for (uint32_t i = 0; i < count; ++i) {
      const Point center{in(random), in(random), in(random)};
      for (uint32_t k = 0; k < 3; ++k) {
        mesh.points.push_back({center.x + near(random), center.y + near(random), center.z + near(random)});
        mesh.indices.push_back(3 * i + k);
      }
    }
    return mesh;
  }
  /// One triangle in the plane z, which contains the points 0 <= x, y and x + y <= 1.
  static Mesh triangle(float z = 0.0f) { return {{{0, 0, z}, {1, 0, z}, {0, 1, z}}, {0, 1, 2}}; }

  hiprtGeometryBuildInput upload(Program& program, uint32_t stride = sizeof(Point)) const {
    std::vector<char> bytes(points.size() * stride);
    for (size_t i = 0; i < points.size(); ++i) std::memcpy(&bytes[i * stride], &points[i], sizeof(Point));
    hiprtGeometryBuildInput input;
    input.type = hiprtPrimitiveTypeTriangleMesh;
    hiprtTriangleMeshPrimitive& mesh = input.primitive.triangleMesh;
    mesh.vertices = program.copy(bytes);
    mesh.vertexCount = static_cast<uint32_t>(points.size());
    mesh.vertexStride = stride;
    mesh.triangleIndices = program.copy(indices);
    mesh.triangleCount = static_cast<uint32_t>(indices.size() / 3);
    mesh.triangleStride = 3 * sizeof(uint32_t);
    return input;
  }

  /// t of the closest hit of a ray along -z, or -1.
  float closest(const hiprtRay& ray) const {
    double best = -1.0;
    for (size_t i = 0; i < indices.size(); i += 3) {
      const Point &a = points[indices[i]], &b = points[indices[i + 1]], &c = points[indices[i + 2]];
      const auto side = [&](const Point& p, const Point& q) {
        return (static_cast<double>(q.x) - static_cast<double>(p.x)) *
                   (static_cast<double>(ray.origin.y) - static_cast<double>(p.y)) -
               (static_cast<double>(q.y) - static_cast<double>(p.y)) *
                   (static_cast<double>(ray.origin.x) - static_cast<double>(p.x));
      };
      const double u = side(b, c), v = side(c, a), w = side(a, b), area = u + v + w;
      if (!((u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0))) continue;
      const double z =
          (u * static_cast<double>(a.z) + v * static_cast<double>(b.z) + w * static_cast<double>(c.z)) / area;
      const double t = static_cast<double>(ray.origin.z) - z;
      if (best < 0 || t < best) best = t;
    }
    return static_cast<float>(best);
  }
};

inline std::vector<hiprtRay> rays_over_cube(uint32_t count, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> in(0.0f, 1.0f);
  std::vector<hiprtRay> rays;
  for (uint32_t i = 0; i < count; ++i) {
    const float x = in(random), y = in(random);
    rays.push_back(ray_at(x, y));
  }
  return rays;
}

/// Compares hits with a loop over all triangles.
inline void check_hits(const Mesh& mesh, const std::vector<hiprtRay>& rays, const std::vector<hiprtHit>& hits) {
  REQUIRE(rays.size() == hits.size());
  unsigned found = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    CAPTURE(i);
    const float expected = mesh.closest(rays[i]);
    found += expected >= 0.0f ? 1 : 0;
    CHECK(std::abs(hits[i].t - expected) < 1e-4f);
    CHECK(hits[i].hasHit() == (expected >= 0.0f));
  }
  CHECK(found > 0);
}

struct SceneArraysOnHost {
  std::vector<hiprtInstance> instances;
  std::vector<hiprtTransformHeader> headers;
  std::vector<hiprtFrameSRT> turns;
  std::vector<hiprtFrameMatrix> matrices;
  std::vector<uint32_t> masks;

  void add(hiprtGeometry geometry) {
    hiprtInstance instance;
    instance.type = hiprtInstanceTypeGeometry;
    instance.geometry = geometry;
    instances.push_back(instance);
  }
  void add_scene(hiprtScene scene) {
    hiprtInstance instance;
    instance.type = hiprtInstanceTypeScene;
    instance.scene = scene;
    instances.push_back(instance);
  }
  hiprtFrameSRT& move(Point translation, float time = 0.0f) {
    hiprtFrameSRT frame{};
    frame.rotation = {0, 0, 1, 0};
    frame.scale = {1, 1, 1};
    frame.translation = translation;
    frame.time = time;
    turns.push_back(frame);
    return turns.back();
  }
  hiprtSceneBuildInput upload(Program& program) const {
    hiprtSceneBuildInput input{};
    input.instances = program.copy(instances);
    input.instanceCount = static_cast<uint32_t>(instances.size());
    if (!headers.empty()) input.instanceTransformHeaders = program.copy(headers);
    if (!masks.empty()) input.instanceMasks = program.copy(masks);
    input.frameType = matrices.empty() ? hiprtFrameTypeSRT : hiprtFrameTypeMatrix;
    if (!matrices.empty())
      input.instanceFrames = program.copy(matrices);
    else if (!turns.empty())
      input.instanceFrames = program.copy(turns);
    input.frameCount = static_cast<uint32_t>(matrices.empty() ? turns.size() : matrices.size());
    return input;
  }
};

}  // namespace hiprt_api_test
