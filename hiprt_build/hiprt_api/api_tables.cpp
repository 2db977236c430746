// Function tables, stack buffers and boxes.

#include <hiprt_build/hiprt_api/context.h>

#include <algorithm>

using namespace hiprt;
using api::Result;

namespace {

hiprtFuncDataSet* sets_of(hiprtFuncTable table) {
  return reinterpret_cast<hiprtFuncDataSet*>(static_cast<std::byte*>(table) + sizeof(hiprtFuncTableHeader));
}

/// Waits for the copy.
Result<void> copy(void* to, const void* from, std::size_t bytes, hipMemcpyKind kind) {
  return gpu::check(hipMemcpy(to, from, bytes, kind), "hipMemcpy", bytes, " bytes");
}

hiprtError export_box(hiprtContext context, const char* function, const void* handle, hiprtFloat3& low,
                      hiprtFloat3& high) {
  if (context == nullptr || handle == nullptr) return hiprtErrorInvalidParameter;
  return api::run(context, function, [&]() -> Result<void> {
    SceneView view;
    if (auto done = copy(&view, handle, sizeof(view), hipMemcpyDeviceToHost); !done) return done;
    low = {view.bounds.min[0], view.bounds.min[1], view.bounds.min[2]};
    high = {view.bounds.max[0], view.bounds.max[1], view.bounds.max[2]};
    return {};
  });
}

/// @return stacks of a dynamic buffer: threads that the device holds at once.
Result<std::uint32_t> resident_threads(int device) {
  int units = 0, threads = 0;
  if (auto done = gpu::check(hipDeviceGetAttribute(&units, hipDeviceAttributeMultiprocessorCount, device),
                             "hipDeviceGetAttribute");
      !done)
    return tl::unexpected(std::move(done.error()));
#if defined(__HIP_PLATFORM_NVIDIA__)
  const auto status = cudaDeviceGetAttribute(&threads, cudaDevAttrMaxThreadsPerMultiProcessor, device);
#else
  const auto status = hipDeviceGetAttribute(&threads, hipDeviceAttributeMaxThreadsPerMultiProcessor, device);
#endif
  if (status != hipSuccess || threads <= 0) threads = 2048;
  return static_cast<std::uint32_t>(units) * static_cast<std::uint32_t>(threads);
}

Result<void> create_stack(int device, const hiprtGlobalStackBufferInput& input, hiprtGlobalStackBuffer& out) {
  std::uint32_t count = input.threadCount;
  std::uint64_t locks = 0;
  if (input.type == hiprtStackTypeDynamic) {
    const auto threads = resident_threads(device);
    if (!threads) return tl::unexpected(threads.error());
    count = *threads;
    constexpr std::uint64_t kSmallestWave = 32;
    locks = count / kSmallestWave * sizeof(std::uint32_t);
  }
  const std::uint64_t entry =
      input.entryType == hiprtStackEntryTypeInstance ? sizeof(hiprtInstanceStackEntry) : sizeof(std::uint32_t);
  auto memory = api::Allocation::make(std::max<std::uint64_t>(1, locks + count * entry * input.stackSize));
  if (!memory) return tl::unexpected(std::move(memory.error()));
  if (locks != 0)
    if (auto done = gpu::check(hipMemset(memory->data(), 0, static_cast<std::size_t>(locks)), "hipMemset"); !done)
      return done;
  out = {input.stackSize, count, memory->data()};
  memory->abandon();
  return {};
}

}  // namespace

hiprtError hiprtCreateFuncTable(hiprtContext context, uint32_t geometry_types, uint32_t ray_types,
                                hiprtFuncTable& out) {
  if (context == nullptr || geometry_types == 0 || ray_types == 0) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtCreateFuncTable", [&]() -> Result<void> {
    const std::uint64_t sets = std::uint64_t{geometry_types} * ray_types * sizeof(hiprtFuncDataSet);
    auto memory = api::Allocation::make(sizeof(hiprtFuncTableHeader) + sets);
    if (!memory) return tl::unexpected(std::move(memory.error()));
    void* const table = memory->data();
    auto done = gpu::check(hipMemset(table, 0, static_cast<std::size_t>(memory->size())), "hipMemset");
    const hiprtFuncTableHeader header{geometry_types, ray_types, sets_of(table)};
    if (done) done = copy(table, &header, sizeof(header), hipMemcpyHostToDevice);
    if (!done) return done;
    {
      const std::scoped_lock lock(context->tables_mutex);
      context->tables[table] = {geometry_types, ray_types};
    }
    memory->abandon();
    out = table;
    return {};
  });
}

hiprtError hiprtSetFuncTable(hiprtContext context, hiprtFuncTable table, uint32_t geometry_type, uint32_t ray_type,
                             hiprtFuncDataSet set) {
  if (context == nullptr || table == nullptr) return hiprtErrorInvalidParameter;
  hiprtContextObject::TableSize size;
  {
    const std::scoped_lock lock(context->tables_mutex);
    const auto known = context->tables.find(table);
    if (known == context->tables.end()) return hiprtErrorInvalidParameter;
    size = known->second;
  }
  if (geometry_type >= size.geometry_types || ray_type >= size.ray_types) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtSetFuncTable", [&] {
    return copy(sets_of(table) + std::size_t{size.geometry_types} * ray_type + geometry_type, &set, sizeof(set),
                hipMemcpyHostToDevice);
  });
}

hiprtError hiprtDestroyFuncTable(hiprtContext context, hiprtFuncTable table) {
  if (context == nullptr || table == nullptr) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtDestroyFuncTable", [&]() -> Result<void> {
    {
      const std::scoped_lock lock(context->tables_mutex);
      if (context->tables.erase(table) == 0)
        return gpu::fail(build::ErrorCode::kInvalidInput, "the table is none of this context");
    }
    return gpu::check(hipFree(table), "hipFree");
  });
}

hiprtError hiprtCreateGlobalStackBuffer(hiprtContext context, const hiprtGlobalStackBufferInput& input,
                                        hiprtGlobalStackBuffer& out) {
  if (context == nullptr || input.stackSize == 0) return hiprtErrorInvalidParameter;
  if (input.type == hiprtStackTypeGlobal && input.threadCount == 0) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtCreateGlobalStackBuffer", [&] { return create_stack(context->device, input, out); });
}

hiprtError hiprtDestroyGlobalStackBuffer(hiprtContext context, hiprtGlobalStackBuffer buffer) {
  if (context == nullptr) return hiprtErrorInvalidParameter;
  // Programs destroy buffers that they never made.
  if (buffer.stackData == nullptr) return hiprtSuccess;
  return api::run(context, "hiprtDestroyGlobalStackBuffer",
                  [&] { return gpu::check(hipFree(buffer.stackData), "hipFree"); });
}

hiprtError hiprtExportGeometryAabb(hiprtContext context, hiprtGeometry geometry, hiprtFloat3& low, hiprtFloat3& high) {
  return export_box(context, "hiprtExportGeometryAabb", geometry, low, high);
}

hiprtError hiprtExportSceneAabb(hiprtContext context, hiprtScene scene, hiprtFloat3& low, hiprtFloat3& high) {
  return export_box(context, "hiprtExportSceneAabb", scene, low, high);
}
