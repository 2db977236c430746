// Kernels that the program has compiled before: they are linked to generated dispatchers.

#include <hiprt_build/gpu/compile.h>
#include <hiprt_build/hiprt_api/context.h>
#include <hiprt_build/hiprt_api/trace_source.h>

#include <algorithm>

using namespace hiprt;
using api::Result;

namespace {

Result<void*> link_module(hiprtContextObject& context, const api::FunctionNames& names, const char* code,
                          std::size_t size, bool cache) {
  const std::string key = "bitcode:" + api::dispatcher_of(names) + std::string(code, size);
  {
    const std::scoped_lock lock(context.modules_mutex);
    if (const auto known = context.modules.find(key); known != context.modules.end()) return known->second;
  }
  gpu::CompileOptions options;
  options.architecture = context.architecture;
  options.file = "dispatchers";
  options.cached = cache;
  {
    const std::scoped_lock lock(context.modules_mutex);
    options.cache = context.cache_folder;
  }
  const std::span<const std::byte> program = std::as_bytes(std::span(code, size));
  const auto linked = api::compile_and_link(api::program_of(names, "", "dispatchers"), std::move(options), program);
  if (!linked) return tl::unexpected(linked.error());
  const auto module = api::load_module(*linked);
  if (!module) return tl::unexpected(module.error());
  const std::scoped_lock lock(context.modules_mutex);
  const auto [at, is_new] = context.modules.emplace(key, *module);
  if (!is_new) api::unload_module(*module);
  return at->second;
}

}  // namespace

hiprtError hiprtBuildTraceKernelsFromBitcode(hiprtContext context, uint32_t function_count, const char** function_names,
                                             const char* module_name, const char* bitcode, size_t bitcode_size,
                                             uint32_t geometry_types, uint32_t ray_types, hiprtFuncNameSet* name_sets,
                                             hiprtApiFunction* functions_out, bool cache) {
  if (context == nullptr || module_name == nullptr || bitcode == nullptr || bitcode_size == 0 ||
      functions_out == nullptr || function_count == 0 || function_names == nullptr ||
      std::any_of(function_names, function_names + function_count, [](const char* name) { return name == nullptr; }))
    return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtBuildTraceKernelsFromBitcode", [&]() -> Result<void> {
    const auto module = link_module(*context, {geometry_types, ray_types, name_sets}, bitcode, bitcode_size, cache);
    if (!module) return tl::unexpected(module.error());
    for (uint32_t i = 0; i < function_count; ++i) {
      const auto function = api::find_function(*module, function_names[i]);
      if (!function) return tl::unexpected(function.error());
      functions_out[i] = *function;
    }
    return {};
  });
}
