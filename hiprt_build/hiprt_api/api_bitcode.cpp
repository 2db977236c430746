// Kernels that the program has compiled before: they are linked to generated dispatchers.

#include <hiprt_build/gpu/compile.h>
#include <hiprt_build/hiprt_api/context.h>
#include <hiprt_build/hiprt_api/trace_source.h>

#include <algorithm>

using namespace hiprt;
using api::Result;

namespace {

/// The dispatchers as relocatable code.
Result<std::vector<std::byte>> compile_dispatchers(hiprtContextObject& context, const api::FunctionNames& names,
                                                   bool cache) {
  gpu::CompileOptions options;
  options.architecture = context.architecture;
  options.flags = {"--relocatable-device-code=true"};
  options.file = "dispatchers";
  options.cached = cache;
  {
    const std::scoped_lock lock(context.modules_mutex);
    options.cache = context.cache_folder;
  }
  auto compiled = gpu::compile_kernels(api::program_of(names, "", "dispatchers"), {}, options);
  if (!compiled) return tl::unexpected(std::move(compiled.error()));
  return std::move(compiled->code);
}

Result<void*> link_module(hiprtContextObject& context, const api::FunctionNames& names, const char* code,
                          std::size_t size, bool cache) {
  const std::string key = "bitcode:" + api::dispatcher_of(names) + std::string(code, size);
  {
    const std::scoped_lock lock(context.modules_mutex);
    if (const auto known = context.modules.find(key); known != context.modules.end()) return known->second;
  }
  const auto dispatchers = compile_dispatchers(context, names, cache);
  if (!dispatchers) return tl::unexpected(dispatchers.error());
  // PTX is text that ends with a zero.
  std::vector<std::byte> program(size + 1);
  std::transform(code, code + size, program.begin(), [](char c) { return static_cast<std::byte>(c); });
  const std::span<const std::byte> parts[] = {program, *dispatchers};
  const auto linked = api::link_code(parts);
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
  if (!api::kServesNvidia) {
    api::log(*context, hiprtLogLevelError, "hiprtBuildTraceKernelsFromBitcode: not there for AMD");
    return hiprtErrorNotImplemented;
  }
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
