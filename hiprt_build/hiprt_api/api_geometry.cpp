// The functions for geometries.

#include <hiprt_build/hiprt_api/geometry.h>

#include <algorithm>

using namespace hiprt;
using api::Result;

namespace {

bool all_counted(const hiprtGeometryBuildInput* inputs, std::uint32_t count) {
  return inputs != nullptr && count != 0 && std::all_of(inputs, inputs + count, api::has_counts);
}
template <class Pointer> bool all_there(Pointer* pointers, std::uint32_t count) {
  return pointers != nullptr && std::none_of(pointers, pointers + count, [](auto p) { return p == nullptr; });
}

}  // namespace

hiprtError hiprtCreateGeometry(hiprtContext context, const hiprtGeometryBuildInput& input, hiprtBuildOptions options,
                               hiprtGeometry& out) {
  hiprtGeometry* address = &out;
  return hiprtCreateGeometries(context, 1, &input, options, &address);
}

hiprtError hiprtCreateGeometries(hiprtContext context, uint32_t count, const hiprtGeometryBuildInput* inputs,
                                 hiprtBuildOptions options, hiprtGeometry** outs) {
  if (context == nullptr || !all_counted(inputs, count) || !all_there(outs, count)) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtCreateGeometries", [&] {
    return api::create_geometries(context, {inputs, count}, options, outs);
  });
}

hiprtError hiprtDestroyGeometry(hiprtContext context, hiprtGeometry geometry) {
  return hiprtDestroyGeometries(context, 1, &geometry);
}

hiprtError hiprtDestroyGeometries(hiprtContext context, uint32_t count, hiprtGeometry* geometries) {
  if (context == nullptr || count == 0 || !all_there(geometries, count)) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtDestroyGeometries", [&]() -> Result<void> {
    for (uint32_t i = 0; i < count; ++i)
      if (!context->geometries.remove(geometries[i]))
        api::log(*context, hiprtLogLevelWarn, "hiprtDestroyGeometry: the geometry is none of this context");
    return {};
  });
}

hiprtError hiprtGetGeometryBuildTemporaryBufferSize(hiprtContext context, const hiprtGeometryBuildInput& input,
                                                    hiprtBuildOptions options, size_t& out) {
  return hiprtGetGeometriesBuildTemporaryBufferSize(context, 1, &input, options, out);
}

hiprtError hiprtGetGeometriesBuildTemporaryBufferSize(hiprtContext context, uint32_t count,
                                                      const hiprtGeometryBuildInput* inputs, hiprtBuildOptions options,
                                                      size_t& out) {
  if (context == nullptr || !all_counted(inputs, count)) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtGetGeometriesBuildTemporaryBufferSize", [&]() -> Result<void> {
    const auto size = api::temporary_size(api::GeometryInputs(inputs, count), options);
    if (!size) return tl::unexpected(size.error());
    out = static_cast<size_t>(*size);
    return {};
  });
}

hiprtError hiprtBuildGeometry(hiprtContext context, hiprtBuildOperation operation, const hiprtGeometryBuildInput& input,
                              hiprtBuildOptions options, hiprtDevicePtr temporary, hiprtApiStream stream,
                              hiprtGeometry geometry) {
  return hiprtBuildGeometries(context, operation, 1, &input, options, temporary, stream, &geometry);
}

hiprtError hiprtBuildGeometries(hiprtContext context, hiprtBuildOperation operation, uint32_t count,
                                const hiprtGeometryBuildInput* inputs, hiprtBuildOptions options,
                                hiprtDevicePtr temporary, hiprtApiStream stream, hiprtGeometry* geometries) {
  if (context == nullptr || inputs == nullptr || count == 0 || !all_there(geometries, count))
    return hiprtErrorInvalidParameter;
  bool valid = true;
  const hiprtError done = api::run(context, "hiprtBuildGeometries", [&]() -> Result<void> {
    const auto built = api::build_geometries(context, operation, {inputs, count}, options, temporary,
                                             static_cast<hipStream_t>(stream), geometries);
    if (!built) return tl::unexpected(built.error());
    valid = *built;
    return {};
  });
  return valid ? done : hiprtErrorInvalidParameter;
}
