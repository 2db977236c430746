// CUDA's driver, loaded when it is first needed.

#include <hiprt_build/hiprt_api/driver.h>
#include <hiprt_build/rtc/shared_library.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace hiprt::api {
namespace {

/// A CUresult: 0 is success.
using Status = int;
constexpr const char* kNames[] = {"libcuda.so.1"};
/// Kinds of code, CUjitInputType.
constexpr int kInputCubin = 0, kInputPtx = 1, kInputFatbin = 2;

struct Functions {
  Status (*initialize)(unsigned) = nullptr;
  Status (*push)(void*) = nullptr;
  Status (*pop)(void**) = nullptr;
  Status (*load)(void**, const void*) = nullptr;
  Status (*find)(void**, void*, const char*) = nullptr;
  Status (*unload)(void*) = nullptr;
  Status (*name)(Status, const char**) = nullptr;
  Status (*link_create)(unsigned, int*, void**, void**) = nullptr;
  Status (*link_add)(void*, int, void*, std::size_t, const char*, unsigned, int*, void**) = nullptr;
  Status (*link_complete)(void*, void**, std::size_t*) = nullptr;
  Status (*link_destroy)(void*) = nullptr;
  gpu::rtc::SharedLibrary library;

  Functions() : library(kNames) {
    library.find("cuInit", initialize);
    library.find("cuCtxPushCurrent_v2", push);
    library.find("cuCtxPopCurrent_v2", pop);
    library.find("cuModuleLoadData", load);
    library.find("cuModuleGetFunction", find);
    library.find("cuModuleUnload", unload);
    library.find("cuGetErrorName", name);
    library.find("cuLinkCreate_v2", link_create);
    library.find("cuLinkAddData_v2", link_add);
    library.find("cuLinkComplete", link_complete);
    library.find("cuLinkDestroy", link_destroy);
  }

  Result<void> check(Status status, const char* call) const {
    if (status == 0) return {};
    const char* text = nullptr;
    if (name(status, &text) != 0 || text == nullptr) text = "unknown error";
    constexpr Status kOutOfMemory = 2;
    return gpu::fail(status == kOutOfMemory ? ErrorCode::kOutOfMemory : ErrorCode::kGpu, call, ": ", text);
  }
};

const Functions& driver() {
  static const Functions functions;
  return functions;
}

int kind_of(std::span<const std::byte> code) {
  const auto begins_with = [&](std::string_view magic) {
    return code.size() > magic.size() && std::memcmp(code.data(), magic.data(), magic.size()) == 0;
  };
  return begins_with("\x7f\x45LF") ? kInputCubin : begins_with("\x50\xed\x55\xba") ? kInputFatbin : kInputPtx;
}

template <class Number> std::uint64_t number_at(std::span<const std::byte> code, std::size_t offset) {
  Number number{};
  if (offset <= code.size() && code.size() - offset >= sizeof(number))
    std::memcpy(&number, code.data() + offset, sizeof(number));
  return number;
}

/// Whether code ends before its header says. The driver would read on, and end the program.
bool is_cut_off(std::span<const std::byte> code) {
  constexpr std::size_t kElfHeader = 64, kFatbinHeader = 16;
  std::uint64_t end = 0;
  switch (kind_of(code)) {
    case kInputCubin: {  // ELF of 64 bits: the table of sections, number and size of its entries.
      const std::uint64_t table = number_at<std::uint64_t>(code, 40);
      end =
          std::max<std::uint64_t>(kElfHeader, number_at<std::uint16_t>(code, 58) * number_at<std::uint16_t>(code, 60));
      if (table > code.size()) return true;
      end += table;
      break;
    }
    case kInputFatbin:
      end = number_at<std::uint64_t>(code, 8);
      if (end > code.size()) return true;
      end += kFatbinHeader;
      break;
    default:
      return false;
  }
  return end > code.size();
}

/// cuLink...: destroyed at the end.
class Linker {
 public:
  ~Linker() {
    if (state_ != nullptr) static_cast<void>(driver().link_destroy(state_));
  }
  Result<std::vector<std::byte>> link(std::span<const std::span<const std::byte>> parts) {
    char log[4096] = {};
    constexpr int kErrorLog = 5, kErrorLogBytes = 6;
    int options[] = {kErrorLog, kErrorLogBytes};
    void* values[] = {log, reinterpret_cast<void*>(sizeof(log))};
    const Functions& cuda = driver();
    auto done = cuda.check(cuda.link_create(2, options, values, &state_), "cuLinkCreate");
    for (const auto& part : parts) {
      if (done)
        done = cuda.check(cuda.link_add(state_, kind_of(part), const_cast<std::byte*>(part.data()), part.size(), "part",
                                        0, nullptr, nullptr),
                          "cuLinkAddData");
    }
    void* code = nullptr;
    std::size_t size = 0;
    if (done) done = cuda.check(cuda.link_complete(state_, &code, &size), "cuLinkComplete");
    if (!done) return gpu::fail(done.error().code, done.error().message, "\n", static_cast<const char*>(log));
    const auto* bytes = static_cast<const std::byte*>(code);
    return std::vector<std::byte>(bytes, bytes + size);
  }

 private:
  void* state_ = nullptr;
};

}  // namespace

Result<void> check_driver() {
  const Functions& cuda = driver();
  if (!cuda.library.missing().empty())
    return gpu::fail(ErrorCode::kNoDevice, "no CUDA driver: ", cuda.library.missing());
  if (auto done = cuda.check(cuda.initialize(0), "cuInit"); !done)
    return gpu::fail(ErrorCode::kNoDevice, done.error().message);
  return {};
}

CurrentContext::CurrentContext(void* context, int device) {
  if (!driver().library.missing().empty()) {
    result_ = check_driver();
  } else if (context != nullptr) {
    result_ = driver().check(driver().push(context), "cuCtxPushCurrent");
    pushed_ = result_.has_value();
  } else {
    result_ = gpu::check(hipGetDevice(&previous_), "cudaGetDevice");
    if (result_) result_ = gpu::check(hipSetDevice(device), "cudaSetDevice", "device ", device);
  }
}

CurrentContext::~CurrentContext() {
  void* popped = nullptr;
  if (pushed_) static_cast<void>(driver().pop(&popped));
  if (previous_ >= 0) static_cast<void>(hipSetDevice(previous_));
}

Result<void*> load_module(std::span<const std::byte> code) {
  void* module = nullptr;
  if (auto done = driver().check(driver().load(&module, code.data()), "cuModuleLoadData"); !done)
    return tl::unexpected(std::move(done.error()));
  return module;
}

Result<void*> find_function(void* module, const char* name) {
  void* function = nullptr;
  if (auto done = driver().check(driver().find(&function, module, name), "cuModuleGetFunction"); !done)
    return gpu::fail(ErrorCode::kGpu, done.error().message, ", function ", name);
  return function;
}

void unload_module(void* module) noexcept { static_cast<void>(driver().unload(module)); }

Result<std::vector<std::byte>> compile_and_link(const std::string& source, gpu::CompileOptions options,
                                                std::span<const std::byte> program) {
  if (is_cut_off(program)) return gpu::fail(ErrorCode::kInvalidInput, "the code is cut off");
  options.flags.emplace_back("--relocatable-device-code=true");
  const auto compiled = gpu::compile_kernels(source, {}, options);
  if (!compiled) return tl::unexpected(compiled.error());
  // PTX is text that ends with a zero.
  std::vector<std::byte> copy(program.begin(), program.end());
  copy.push_back({});
  const std::span<const std::byte> parts[] = {copy, compiled->code};
  return Linker().link(parts);
}

}  // namespace hiprt::api
