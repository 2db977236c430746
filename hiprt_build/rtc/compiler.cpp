#include <hiprt_build/rtc/bitcode.h>
#include <hiprt_build/rtc/compiler.h>
#include <hiprt_build/rtc/embedded_headers.h>

#include <dlfcn.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <system_error>

namespace hiprt::gpu::rtc {

using build::Error;
using build::ErrorCode;
using build::Result;

namespace {

/// The newest first.
constexpr const char* kNvrtcNames[] = {"libnvrtc.so.13", "libnvrtc.so.12", "libnvrtc.so"};
/// Up to ROCm 5 the runtime has hipRTC too.
constexpr const char* kHiprtcNames[] = {"libhiprtc.so.7", "libhiprtc.so.6",   "libhiprtc.so.5",
                                        "libhiprtc.so",   "libamdhip64.so.5", "libamdhip64.so"};

const char* name_of(CompilerKind kind) { return kind == CompilerKind::kNvrtc ? "NVRTC" : "hipRTC"; }

tl::unexpected<Error> fail(ErrorCode code, std::string message) {
  return tl::unexpected(Error{code, std::move(message)});
}

}  // namespace

/// Destroys the program at the end.
class Compiler::OwnedProgram {
 public:
  explicit OwnedProgram(const Compiler& compiler) : compiler_(compiler) {}
  ~OwnedProgram() {
    if (program != nullptr) compiler_.destroy_(&program);
  }
  OwnedProgram(const OwnedProgram&) = delete;
  OwnedProgram& operator=(const OwnedProgram&) = delete;
  Program program = nullptr;

 private:
  const Compiler& compiler_;
};

void Compiler::find_functions(SharedLibrary& library) {
  const bool nvrtc = kind_ == CompilerKind::kNvrtc;
  const std::string prefix = nvrtc ? "nvrtc" : "hiprtc";
  library.find(prefix + "GetErrorString", error_string_);
  library.find(prefix + "Version", version_);
  library.find(prefix + "CreateProgram", create_);
  library.find(prefix + "DestroyProgram", destroy_);
  library.find(prefix + "AddNameExpression", add_name_);
  library.find(prefix + "CompileProgram", compile_);
  library.find(prefix + "GetProgramLogSize", log_size_);
  library.find(prefix + "GetProgramLog", log_);
  library.find(prefix + "GetLoweredName", lowered_name_);
  const std::string code = prefix + (nvrtc ? "GetCUBIN" : "GetCode");
  library.find(code + "Size", code_size_);
  library.find(code, code_);
  if (!nvrtc) return;
  library.find("nvrtcGetPTXSize", ptx_size_);
  library.find("nvrtcGetPTX", ptx_);
}

std::string Compiler::describe_library() const {
  int major = 0, minor = 0;
  version_(&major, &minor);
  std::string text = std::string(name_of(kind_)) + " " + std::to_string(major) + "." + std::to_string(minor);
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(version_), &info) == 0 || info.dli_fname == nullptr) return text;
  std::error_code error;
  const auto path = std::filesystem::canonical(info.dli_fname, error);
  if (error) return text + " " + info.dli_fname;
  text += " " + path.string() + " " + std::to_string(std::filesystem::file_size(path, error));
  return text + " " + std::to_string(std::filesystem::last_write_time(path, error).time_since_epoch().count());
}

Result<Compiler*> Compiler::load(CompilerKind kind, const std::string& library) {
  static std::mutex mutex;
  static std::map<std::pair<CompilerKind, std::string>, std::unique_ptr<Compiler>> loaded;
  const std::scoped_lock lock(mutex);
  std::unique_ptr<Compiler>& compiler = loaded[{kind, library}];
  if (compiler) return compiler.get();

  std::vector<const char*> candidates;
  if (!library.empty())
    candidates = {library.c_str()};
  else if (kind == CompilerKind::kNvrtc)
    candidates.assign(std::begin(kNvrtcNames), std::end(kNvrtcNames));
  else
    candidates.assign(std::begin(kHiprtcNames), std::end(kHiprtcNames));
  std::string reasons;
  for (const char* candidate : candidates) {
    SharedLibrary found({&candidate, 1});
    std::unique_ptr<Compiler> made(new Compiler(kind));
    made->find_functions(found);
    if (!found.missing().empty()) {
      reasons += "\n  " + found.missing();
      found.close();
      continue;
    }
    made->identity_ = made->describe_library();
    compiler = std::move(made);
    return compiler.get();
  }
  return fail(ErrorCode::kBackend, std::string("cannot load ") + name_of(kind) + ":" + reasons);
}

std::vector<std::string> Compiler::flags_of(const CompileOptions& options) const {
  const bool nvrtc = kind_ == CompilerKind::kNvrtc;
  std::vector<std::string> flags{(nvrtc ? "--gpu-architecture=" : "--offload-arch=") + options.architecture};
  const bool has_language = std::any_of(options.flags.begin(), options.flags.end(), [](const std::string& flag) {
    return flag.starts_with("-std=") || flag.starts_with("--std=");
  });
  if (!has_language) flags.push_back("-std=c++20");
  flags.insert(flags.end(), options.flags.begin(), options.flags.end());
  return flags;
}

tl::unexpected<Error> Compiler::failed(const char* what, int result) const {
  return fail(ErrorCode::kBackend, std::string(name_of(kind_)) + ": " + what + ": " + error_string_(result));
}

std::string Compiler::log_of(Program program) const {
  std::size_t size = 0;
  if (log_size_(program, &size) != 0 || size == 0) return {};
  std::string log(size, '\0');
  if (log_(program, log.data()) != 0) return {};
  while (!log.empty() && (log.back() == '\0' || log.back() == '\n')) log.pop_back();
  return log;
}

Result<CompiledKernels> Compiler::compile(const std::string& source, std::span<const std::string> names,
                                          const CompileOptions& options) {
  std::unique_lock lock(mutex_, std::defer_lock);
  if (kind_ == CompilerKind::kHiprtc) lock.lock();

  std::vector<const char*> texts{"#pragma once\n"}, header_names{"hip/hip_runtime.h"};
  for (const EmbeddedHeader& header : embedded_headers()) {
    texts.push_back(header.text);
    header_names.push_back(header.name);
  }
  for (const SourceHeader& header : options.headers) {
    texts.push_back(header.text.empty() ? "\n" : header.text.c_str());  // hipRTC takes no empty header.
    header_names.push_back(header.name.c_str());
  }
  OwnedProgram owned(*this);
  if (const int result = create_(&owned.program, source.c_str(), options.file.c_str(), static_cast<int>(texts.size()),
                                 texts.data(), header_names.data()))
    return failed("create program", result);
  for (const std::string& name : names)
    if (const int result = add_name_(owned.program, name.c_str())) return failed(name.c_str(), result);

  std::vector<std::string> flags = flags_of(options);
  std::optional<MemoryFile> linked;
  if (!options.bitcode.empty()) {
    const auto bitcode = find_bitcode(options.bitcode, options.architecture);
    if (!bitcode) return tl::unexpected(bitcode.error());
    auto file = MemoryFile::make(*bitcode);
    if (!file) return tl::unexpected(std::move(file.error()));
    linked.emplace(std::move(*file));
    flags.insert(flags.end(), {"-Xclang", "-mlink-bitcode-file", "-Xclang", linked->path()});
  }
  std::vector<const char*> pointers;
  pointers.reserve(flags.size());
  for (const std::string& flag : flags) pointers.push_back(flag.c_str());
  if (const int result = compile_(owned.program, static_cast<int>(pointers.size()), pointers.data()))
    return fail(ErrorCode::kInvalidInput, std::string(name_of(kind_)) + " cannot compile '" + options.file + "' for " +
                                              options.architecture + ": " + error_string_(result) + "\n" +
                                              log_of(owned.program));
  return result_of(owned.program, names, options);
}

Result<CompiledKernels> Compiler::result_of(Program program, std::span<const std::string> names,
                                            const CompileOptions& options) const {
  CompiledKernels kernels;
  kernels.log = log_of(program);
  for (const std::string& name : names) {
    const char* lowered = nullptr;
    if (const int result = lowered_name_(program, name.c_str(), &lowered); result != 0 || lowered == nullptr)
      return fail(ErrorCode::kInvalidInput, "'" + options.file + "' has no kernel '" + name + "'");
    kernels.names.emplace_back(lowered);
  }
  const bool ptx = options.architecture.starts_with("compute_");
  std::size_t size = 0;
  if (const int result = (ptx ? ptx_size_ : code_size_)(program, &size)) return failed("size of the code", result);
  if (size == 0) return fail(ErrorCode::kInvalidInput, "no code for architecture " + options.architecture);
  kernels.code.resize(size);
  if (const int result = (ptx ? ptx_ : code_)(program, reinterpret_cast<char*>(kernels.code.data())))
    return failed("code", result);
  return kernels;
}

}  // namespace hiprt::gpu::rtc
