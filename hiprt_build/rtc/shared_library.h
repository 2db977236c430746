#pragma once
/// A shared library that is loaded when it is first needed, and kept. Internal.

#include <dlfcn.h>

#include <span>
#include <string>

namespace hiprt::gpu::rtc {

/// Libraries of compilers and drivers, which a program does not link.
class SharedLibrary {
 public:
  SharedLibrary() = default;
  /// Loads the first of the names that is there. One that the program has loaded already comes before all others: it
  /// has the program's streams and memory.
  explicit SharedLibrary(std::span<const char* const> names) {
    for (const int mode : {RTLD_NOW | RTLD_LOCAL | RTLD_NOLOAD, RTLD_NOW | RTLD_LOCAL})
      for (const char* name : names) {
        if (handle_ != nullptr) return;
        handle_ = dlopen(name, mode);
        if (handle_ != nullptr)
          name_ = name;
        else if ((mode & RTLD_NOLOAD) == 0)
          missing_ += (missing_.empty() ? "" : "; ") + reason(name);
      }
    if (handle_ != nullptr) missing_.clear();
  }

  /// Stores the address of a function, or nullptr.
  template <class Function> void look_for(const std::string& name, Function& function) {
    function = handle_ == nullptr ? nullptr : reinterpret_cast<Function>(dlsym(handle_, name.c_str()));
  }
  /// The same, and notes a function that is missing.
  template <class Function> void find(const std::string& name, Function& function) {
    look_for(name, function);
    if (function == nullptr && missing_.empty()) missing_ = name_ + ": it lacks " + name;
  }

  /// What is missing, in words: the library, or a function. Empty: nothing.
  const std::string& missing() const { return missing_; }

  /// Closes it. Its functions must not be called again.
  void close() {
    if (handle_ != nullptr) dlclose(handle_);
    handle_ = nullptr;
  }

 private:
  static std::string reason(const char* name) {
    const char* const text = dlerror();
    return text != nullptr ? text : name;
  }

  void* handle_ = nullptr;
  std::string name_, missing_;
};

}  // namespace hiprt::gpu::rtc
