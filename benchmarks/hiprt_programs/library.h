#pragma once
/// libhiprt0300164.so: a context and what it owns.

#include <hiprt_build/gpu/build.h>
#include <hiprt_build/gpu/device_buffer.h>

#include <hiprt/hiprt.h>

#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace hiprt::bench {

/// @return kBackend with the function's name unless the code is hiprtSuccess.
build::Result<void> check_hiprt(hiprtError code, const char* function);

/// A context on the current device. Destroys geometries and scenes with itself.
class Library {
 public:
  static build::Result<std::unique_ptr<Library>> make();
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
  ~Library();

  hiprtContext context() const { return context_; }

  /// Creates and builds; the temporary buffer stays for later builds of the same input.
  build::Result<hiprtGeometry> build(const hiprtGeometryBuildInput& input, hiprtBuildOptions options,
                                     hipStream_t stream);
  build::Result<hiprtScene> build(const hiprtSceneBuildInput& input, hiprtBuildOptions options, hipStream_t stream);
  build::Result<std::vector<hiprtGeometry>> build(const std::vector<hiprtGeometryBuildInput>& inputs,
                                                  hiprtBuildOptions options, hipStream_t stream);

  /// The same again, into the same memory.
  build::Result<void> rebuild(hiprtBuildOperation operation, const hiprtGeometryBuildInput& input,
                              hiprtBuildOptions options, hipStream_t stream, hiprtGeometry geometry);
  build::Result<void> rebuild(const hiprtSceneBuildInput& input, hiprtBuildOptions options, hipStream_t stream,
                              hiprtScene scene);
  build::Result<void> rebuild(const std::vector<hiprtGeometryBuildInput>& inputs, hiprtBuildOptions options,
                              hipStream_t stream, std::vector<hiprtGeometry>& geometries);

 private:
  Library() = default;
  /// Makes the temporary buffer large enough.
  /// @param function name of the function that size_of() calls.
  build::Result<void> reserve(const char* function, const std::function<hiprtError(std::size_t&)>& size_of);

  hiprtContext context_ = nullptr;
  gpu::DeviceAllocator allocator_;
  gpu::DeviceBuffer temporary_;
  std::vector<hiprtGeometry> geometries_;
  std::vector<hiprtScene> scenes_;
};

/// A mesh on the device, for both interfaces.
struct DeviceMesh {
  gpu::DeviceArray<build::Position> positions;
  gpu::DeviceArray<build::Triangle> triangles;

  static build::Result<DeviceMesh> make(std::span<const build::Position> positions,
                                        std::span<const build::Triangle> triangles, gpu::Allocator& allocator);
  gpu::DeviceGeometry own() const;
  hiprtGeometryBuildInput named();
};

}  // namespace hiprt::bench
