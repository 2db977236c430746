// Kernels that are compiled at run time.

#include <hiprt_build/gpu/compile.h>
#include <hiprt_build/hiprt_api/context.h>
#include <hiprt_build/hiprt_api/trace_source.h>
#include <hiprt_build/rtc/embedded_headers.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

using namespace hiprt;
using api::Result;

namespace {

/// What one call compiles.
struct Program {
  std::string text;
  gpu::CompileOptions options;

  /// Equal programs have equal keys.
  std::string key() const {
    std::string key = text;
    const auto add = [&key](const std::string& part) { key += std::to_string(part.size()) + ':' + part; };
    add(options.architecture);
    for (const std::string& flag : options.flags) add(flag);
    for (const gpu::SourceHeader& header : options.headers) {
      add(header.name);
      add(header.text);
    }
    return key;
  }
};

bool begins_with(std::string_view text, std::string_view beginning) {
  return text.substr(0, beginning.size()) == beginning;
}

/// Options that are left out: the headers of this library need C++20, and the architecture is the device's.
bool is_replaced(std::string_view option) {
  for (const std::string_view older : {"c++03", "c++11", "c++14", "c++17", "gnu++11", "gnu++14", "gnu++17"})
    for (const char* prefix : {"-std=", "--std="})
      if (option == prefix + std::string(older)) return true;
  for (const std::string_view architecture : {"-arch=", "--gpu-architecture=", "--offload-arch="})
    if (begins_with(option, architecture)) return true;
  return false;
}

gpu::CompileOptions options_of(const hiprtContextObject& context, const char* name, std::uint32_t count,
                               const char** options, bool cache) {
  gpu::CompileOptions result;
  result.architecture = context.architecture;
  result.file = name;
  result.cached = cache;
  result.cache = context.cache_folder;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (options[i] != nullptr && !is_replaced(options[i])) result.flags.emplace_back(options[i]);
  }
  const char* const root = std::getenv("HIPRT_PATH");
  result.flags.push_back(std::string("-I") + (root != nullptr && *root != '\0' ? root : ".."));
  result.flags.emplace_back("-D__USE_HIP__");
  return result;
}

/// Programs may bring AMD's headers, which have the names of ours.
bool is_ours(std::string_view name) {
  const auto ours = gpu::rtc::embedded_headers();
  return std::any_of(ours.begin(), ours.end(), [&](const auto& header) { return name == header.name; });
}

/// @return the module with the program, compiled now or before.
Result<void*> module_of(hiprtContextObject& context, const Program& program) {
  const std::string key = program.key();
  {
    const std::scoped_lock lock(context.modules_mutex);
    if (const auto known = context.modules.find(key); known != context.modules.end()) return known->second;
  }
  const auto compiled = gpu::compile_kernels(program.text, {}, program.options);
  if (!compiled) return tl::unexpected(compiled.error());
  if (!compiled->log.empty()) api::log(context, hiprtLogLevelInfo, compiled->log);
  const auto module = api::load_module(compiled->code);
  if (!module) return tl::unexpected(module.error());
  const std::scoped_lock lock(context.modules_mutex);
  const auto [at, is_new] = context.modules.emplace(key, *module);
  if (!is_new) api::unload_module(*module);
  return at->second;
}

Result<void> find_functions(void* module, std::uint32_t count, const char** names, hiprtApiFunction* out) {
  for (std::uint32_t i = 0; out != nullptr && i < count; ++i) {
    const auto function = api::find_function(module, names[i]);
    if (!function) return tl::unexpected(function.error());
    out[i] = *function;
  }
  return {};
}

bool all_there(const char** texts, std::uint32_t count) {
  if (count != 0 && texts == nullptr) return false;
  for (std::uint32_t i = 0; i < count; ++i)
    if (texts[i] == nullptr) return false;
  return true;
}

}  // namespace

hiprtError hiprtBuildTraceKernels(hiprtContext context, uint32_t function_count, const char** function_names,
                                  const char* source, const char* module_name, uint32_t header_count,
                                  const char** headers, const char** include_names, uint32_t option_count,
                                  const char** options, uint32_t geometry_types, uint32_t ray_types,
                                  hiprtFuncNameSet* name_sets, hiprtApiFunction* functions_out,
                                  hiprtApiModule* module_out, bool cache) {
  if (context == nullptr || source == nullptr || module_name == nullptr) return hiprtErrorInvalidParameter;
  const bool wants_functions = function_count != 0 && functions_out != nullptr;
  if (!wants_functions && module_out == nullptr) return hiprtErrorInvalidParameter;
  if ((wants_functions && !all_there(function_names, function_count)) || !all_there(headers, header_count) ||
      !all_there(include_names, header_count) || (option_count != 0 && options == nullptr))
    return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtBuildTraceKernels", [&]() -> Result<void> {
    Program program;
    program.text = api::program_of({geometry_types, ray_types, name_sets}, source, module_name);
    {
      const std::scoped_lock lock(context->modules_mutex);
      program.options = options_of(*context, module_name, option_count, options, cache);
    }
    for (uint32_t i = 0; i < header_count; ++i)
      if (!is_ours(include_names[i])) program.options.headers.push_back({include_names[i], headers[i]});
    const auto module = module_of(*context, program);
    if (!module) return tl::unexpected(module.error());
    if (module_out != nullptr) *module_out = *module;
    return wants_functions ? find_functions(*module, function_count, function_names, functions_out) : Result<void>();
  });
}
