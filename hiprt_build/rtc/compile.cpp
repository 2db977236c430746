#include <hiprt_build/rtc/compiler.h>
#include <hiprt_build/rtc/embedded_headers.h>
#include <hiprt_build/rtc/kernel_cache.h>

#include <new>

namespace hiprt::gpu {

namespace {

using build::Error;
using build::ErrorCode;
using build::Result;

tl::unexpected<Error> invalid(std::string message) {
  return tl::unexpected(Error{ErrorCode::kInvalidInput, std::move(message)});
}

/// @return the error, or nothing.
Result<void> check(std::string_view source, std::span<const std::string> names, const CompileOptions& options) {
  const auto ends_early = [](std::string_view text) { return text.find('\0') != std::string_view::npos; };
  if (source.empty()) return invalid("the source '" + options.file + "' is empty");
  if (ends_early(source)) return invalid("the source '" + options.file + "' has a byte 0");
  for (const std::string& name : names)
    if (name.empty() || ends_early(name)) return invalid("the name of a kernel is empty or has a byte 0");
  for (const std::string& flag : options.flags)
    if (ends_early(flag)) return invalid("an option of the compiler has a byte 0");
  for (const SourceHeader& header : options.headers)
    if (header.name.empty() || ends_early(header.name) || ends_early(header.text))
      return invalid("header '" + header.name + "': its name is empty, or it has a byte 0");
  return {};
}

std::string key_of(const rtc::Compiler& compiler, std::string_view source, std::span<const std::string> names,
                   const CompileOptions& options) {
  rtc::KernelKey key;
  key.add(compiler.identity());
  key.add(options.architecture);
  key.add(options.file);
  key.add(source);
  key.add(names.size());
  for (const std::string& name : names) key.add(name);
  key.add(options.flags.size());
  for (const std::string& flag : options.flags) key.add(flag);
  key.add({reinterpret_cast<const char*>(options.bitcode.data()), options.bitcode.size()});
  key.add(options.headers.size());
  for (const SourceHeader& header : options.headers) {
    key.add(header.name);
    key.add(header.text);
  }
  for (const rtc::EmbeddedHeader& header : rtc::embedded_headers()) {
    key.add(std::string_view(header.name));
    key.add(std::string_view(header.text));
  }
  return key.text();
}

/// As compile_kernels(); may throw std::bad_alloc.
Result<CompiledKernels> compile_or_find(std::string_view source, std::span<const std::string> names,
                                        const CompileOptions& options) {
  const std::string& architecture = options.architecture;
  const bool amd = architecture.starts_with("gfx");
  if (!amd && !architecture.starts_with("sm_") && !architecture.starts_with("compute_"))
    return invalid("architecture '" + architecture + "': must begin with gfx, sm_ or compute_");
  if (!amd && !options.bitcode.empty()) return invalid("bitcode is for AMD, and not for " + architecture);
  if (auto checked = check(source, names, options); !checked) return tl::unexpected(std::move(checked.error()));
  const auto compiler =
      rtc::Compiler::load(amd ? rtc::CompilerKind::kHiprtc : rtc::CompilerKind::kNvrtc, options.library);
  if (!compiler) return tl::unexpected(compiler.error());

  const std::filesystem::path folder = options.cached ? rtc::cache_folder(options) : std::filesystem::path();
  std::string key;
  if (!folder.empty()) {
    key = key_of(**compiler, source, names, options);
    if (auto cached = rtc::read_cached(folder, key)) return std::move(*cached);
  }
  auto kernels = (*compiler)->compile(std::string(source), names, options);
  if (kernels && !folder.empty()) rtc::write_cached(folder, key, *kernels);
  return kernels;
}

}  // namespace

Result<CompiledKernels> compile_kernels(std::string_view source, std::span<const std::string> names,
                                        const CompileOptions& options) {
  try {
    return compile_or_find(source, names, options);
  } catch (const std::bad_alloc&) {
    return tl::unexpected(Error{ErrorCode::kOutOfMemory, "no memory to compile kernels"});
  }
}

}  // namespace hiprt::gpu
