#include "library.h"

#include <string>

namespace hiprt::bench {

using build::Result;

Result<void> check_hiprt(hiprtError code, const char* function) {
  if (code == hiprtSuccess) return {};
  return gpu::fail(build::ErrorCode::kBackend, function, " failed with code ", static_cast<int>(code));
}

Result<std::unique_ptr<Library>> Library::make() {
#if defined(__HIP_PLATFORM_NVIDIA__)
  constexpr hiprtDeviceType kType = hiprtDeviceNVIDIA;
#else
  constexpr hiprtDeviceType kType = hiprtDeviceAMD;
#endif
  std::unique_ptr<Library> library(new Library);
  // A null context is the device's primary one.
  const hiprtContextCreationInput input{nullptr, 0, kType};
  auto done = check_hiprt(hiprtCreateContext(HIPRT_API_VERSION, input, library->context_), "hiprtCreateContext");
  if (done)
    done = check_hiprt(hiprtSetLogLevel(library->context_, hiprtLogLevelError | hiprtLogLevelWarn), "hiprtSetLogLevel");
  if (!done) return tl::unexpected(done.error());
  return library;
}

Library::~Library() {
  for (const hiprtScene scene : scenes_) hiprtDestroyScene(context_, scene);
  for (const hiprtGeometry geometry : geometries_) hiprtDestroyGeometry(context_, geometry);
  if (context_ != nullptr) hiprtDestroyContext(context_);
}

Result<void> Library::reserve(const char* function, const std::function<hiprtError(std::size_t&)>& size_of) {
  std::size_t bytes = 0;
  if (auto got = check_hiprt(size_of(bytes), function); !got) return got;
  if (bytes <= temporary_.size()) return {};
  auto buffer = gpu::DeviceBuffer::make(bytes, nullptr, allocator_);
  if (!buffer) return tl::unexpected(buffer.error());
  temporary_ = std::move(*buffer);
  return {};
}

Result<hiprtGeometry> Library::build(const hiprtGeometryBuildInput& input, hiprtBuildOptions options,
                                     hipStream_t stream) {
  hiprtGeometry geometry = nullptr;
  auto done = check_hiprt(hiprtCreateGeometry(context_, input, options, geometry), "hiprtCreateGeometry");
  if (!done) return tl::unexpected(done.error());
  geometries_.push_back(geometry);
  done = reserve("hiprtGetGeometryBuildTemporaryBufferSize", [&](std::size_t& bytes) {
    return hiprtGetGeometryBuildTemporaryBufferSize(context_, input, options, bytes);
  });
  if (done) done = rebuild(hiprtBuildOperationBuild, input, options, stream, geometry);
  if (!done) return tl::unexpected(done.error());
  return geometry;
}

Result<hiprtScene> Library::build(const hiprtSceneBuildInput& input, hiprtBuildOptions options, hipStream_t stream) {
  hiprtScene scene = nullptr;
  auto done = check_hiprt(hiprtCreateScene(context_, input, options, scene), "hiprtCreateScene");
  if (!done) return tl::unexpected(done.error());
  scenes_.push_back(scene);
  done = reserve("hiprtGetSceneBuildTemporaryBufferSize", [&](std::size_t& bytes) {
    return hiprtGetSceneBuildTemporaryBufferSize(context_, input, options, bytes);
  });
  if (done) done = rebuild(input, options, stream, scene);
  if (!done) return tl::unexpected(done.error());
  return scene;
}

Result<std::vector<hiprtGeometry>> Library::build(const std::vector<hiprtGeometryBuildInput>& inputs,
                                                  hiprtBuildOptions options, hipStream_t stream) {
  std::vector<hiprtGeometry> geometries(inputs.size());
  std::vector<hiprtGeometry*> addresses;
  addresses.reserve(inputs.size());
  for (hiprtGeometry& geometry : geometries) addresses.push_back(&geometry);
  const auto count = static_cast<std::uint32_t>(inputs.size());
  auto done = check_hiprt(hiprtCreateGeometries(context_, count, inputs.data(), options, addresses.data()),
                          "hiprtCreateGeometries");
  if (!done) return tl::unexpected(done.error());
  geometries_.insert(geometries_.end(), geometries.begin(), geometries.end());
  done = reserve("hiprtGetGeometriesBuildTemporaryBufferSize", [&](std::size_t& bytes) {
    return hiprtGetGeometriesBuildTemporaryBufferSize(context_, count, inputs.data(), options, bytes);
  });
  if (done) done = rebuild(inputs, options, stream, geometries);
  if (!done) return tl::unexpected(done.error());
  return geometries;
}

Result<void> Library::rebuild(hiprtBuildOperation operation, const hiprtGeometryBuildInput& input,
                              hiprtBuildOptions options, hipStream_t stream, hiprtGeometry geometry) {
  return check_hiprt(hiprtBuildGeometry(context_, operation, input, options, temporary_.data(), stream, geometry),
                     "hiprtBuildGeometry");
}

Result<void> Library::rebuild(const hiprtSceneBuildInput& input, hiprtBuildOptions options, hipStream_t stream,
                              hiprtScene scene) {
  return check_hiprt(
      hiprtBuildScene(context_, hiprtBuildOperationBuild, input, options, temporary_.data(), stream, scene),
      "hiprtBuildScene");
}

Result<void> Library::rebuild(const std::vector<hiprtGeometryBuildInput>& inputs, hiprtBuildOptions options,
                              hipStream_t stream, std::vector<hiprtGeometry>& geometries) {
  const auto count = static_cast<std::uint32_t>(inputs.size());
  return check_hiprt(hiprtBuildGeometries(context_, hiprtBuildOperationBuild, count, inputs.data(), options,
                                          temporary_.data(), stream, geometries.data()),
                     "hiprtBuildGeometries");
}

Result<DeviceMesh> DeviceMesh::make(std::span<const build::Position> positions,
                                    std::span<const build::Triangle> triangles, gpu::Allocator& allocator) {
  auto device_positions = gpu::DeviceArray<build::Position>::from(positions, nullptr, allocator);
  if (!device_positions) return tl::unexpected(device_positions.error());
  auto device_triangles = gpu::DeviceArray<build::Triangle>::from(triangles, nullptr, allocator);
  if (!device_triangles) return tl::unexpected(device_triangles.error());
  if (auto done = gpu::check(hipDeviceSynchronize(), "hipDeviceSynchronize"); !done)
    return tl::unexpected(done.error());
  return DeviceMesh{std::move(*device_positions), std::move(*device_triangles)};
}

gpu::DeviceGeometry DeviceMesh::own() const {
  return {.positions = positions.data(),
          .triangles = triangles.data(),
          .position_count = static_cast<std::uint32_t>(positions.size()),
          .primitive_count = static_cast<std::uint32_t>(triangles.size())};
}

hiprtGeometryBuildInput DeviceMesh::named() {
  hiprtGeometryBuildInput input;
  input.type = hiprtPrimitiveTypeTriangleMesh;
  hiprtTriangleMeshPrimitive& mesh = input.primitive.triangleMesh;
  mesh.vertices = positions.data();
  mesh.vertexCount = static_cast<std::uint32_t>(positions.size());
  mesh.vertexStride = sizeof(build::Position);
  mesh.triangleIndices = triangles.data();
  mesh.triangleCount = static_cast<std::uint32_t>(triangles.size());
  mesh.triangleStride = sizeof(build::Triangle);
  return input;
}

}  // namespace hiprt::bench
