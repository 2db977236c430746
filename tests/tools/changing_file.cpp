/// A library for LD_PRELOAD: changes a file when the program reads or maps it for the first time, before it gets a
/// byte. HIPRT_TEST_FILE is the file. HIPRT_TEST_CHANGE says what happens: "shorten" cuts it in half, "overwrite"
/// replaces its last byte.

#include <cstdlib>
#include <string_view>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace {

bool is_test_file(int descriptor, const char* name) {
  struct stat a {
  }, b{};
  return fstat(descriptor, &a) == 0 && stat(name, &b) == 0 && a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

void change(int descriptor) {
  static bool done = false;
  const char *name = std::getenv("HIPRT_TEST_FILE"), *kind = std::getenv("HIPRT_TEST_CHANGE");
  if (done || name == nullptr || kind == nullptr || !is_test_file(descriptor, name)) return;
  done = true;
  const int file = open(name, O_WRONLY | O_CLOEXEC);
  struct stat status {};
  if (file < 0 || fstat(file, &status) != 0) std::abort();
  const bool good = std::string_view(kind) == "shorten" ? ftruncate(file, status.st_size / 2) == 0
                                                        : pwrite(file, "x", 1, status.st_size - 1) == 1;
  close(file);
  if (!good) std::abort();
}

}  // namespace

extern "C" ssize_t read(int descriptor, void* to, size_t size) {
  static const auto real = reinterpret_cast<ssize_t (*)(int, void*, size_t)>(dlsym(RTLD_NEXT, "read"));
  change(descriptor);
  return real(descriptor, to, size);
}

/// What pread() is called depends on _FILE_OFFSET_BITS.
extern "C" ssize_t pread64(int descriptor, void* to, size_t size, off64_t from) {
  static const auto real = reinterpret_cast<ssize_t (*)(int, void*, size_t, off64_t)>(dlsym(RTLD_NEXT, "pread64"));
  change(descriptor);
  return real(descriptor, to, size, from);
}

extern "C" ssize_t pread(int descriptor, void* to, size_t size, off_t from) {
  return pread64(descriptor, to, size, from);
}

extern "C" void* mmap(void* at, size_t size, int protection, int flags, int descriptor, off_t offset) noexcept {
  static const auto real = reinterpret_cast<void* (*)(void*, size_t, int, int, int, off_t)>(dlsym(RTLD_NEXT, "mmap"));
  void* const result = real(at, size, protection, flags, descriptor, offset);
  if (descriptor >= 0) change(descriptor);
  return result;
}
