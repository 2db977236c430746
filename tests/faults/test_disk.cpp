// Faults of the disk while a file is written, and the end of the writer. The linker puts the functions below before the
// system's (--wrap, see CMakeLists.txt).

#include <hiprt_build/file.h>
#include <tests/amount.h>
#include <tests/faults/failing_call.h>
#include <tests/oracle/random.h>
#include <tests/tools/temp_folder.h>

#include <tests/catch.h>

#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

using namespace hiprt;
namespace fs = std::filesystem;

using checks::fault;

// NOLINTBEGIN(clang-diagnostic-reserved-identifier)
extern "C" {
int __real_open(const char* path, int flags, ...);
int __wrap_open(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const unsigned mode = (flags & O_CREAT) != 0 ? va_arg(list, unsigned) : 0;
  va_end(list);
  return fault.next("open") ? -1 : __real_open(path, flags, mode);
}
ssize_t __real_write(int file, const void* data, size_t bytes);
ssize_t __wrap_write(int file, const void* data, size_t bytes) {
  if (fault.next("write")) return -1;
  return __real_write(file, data, std::min(bytes, fault.most));
}
int __real_fsync(int file);
int __wrap_fsync(int file) { return fault.next("fsync") ? -1 : __real_fsync(file); }
int __real_fchmod(int file, mode_t mode);
int __wrap_fchmod(int file, mode_t mode) { return fault.next("fchmod") ? -1 : __real_fchmod(file, mode); }
int __real_flock(int file, int operation);
int __wrap_flock(int file, int operation) { return fault.next("flock") ? -1 : __real_flock(file, operation); }
int __real_rename(const char* from, const char* to);
int __wrap_rename(const char* from, const char* to) { return fault.next("rename") ? -1 : __real_rename(from, to); }
}
// NOLINTEND(clang-diagnostic-reserved-identifier)

namespace {

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

build::Result<void> write(const fs::path& path, const std::string& text) {
  return build::write_file(path, std::as_bytes(std::span(text)));
}

/// A temporary file as a killed writer leaves it.
void leave_temporary(const fs::path& folder) { std::ofstream(folder / ".hiprt-1-0.tmp") << "half"; }

const std::vector<std::string> kOnlyA{"a"};
/// Bytes that a call writes at most, fewer than a file has.
constexpr std::size_t kShortWrite = 1000;

}  // namespace

TEST_CASE("each call of the system that fails while a file is written leaves the old file or the new one") {
  const std::string old_text(5000, 'o'), new_text(7000, 'n');
  unsigned faults = 0, errors = 0;
  for (const int error : {EIO, ENOSPC, EROFS, EDQUOT, ENOLCK})
    for (const bool replaced : {false, true})
      for (unsigned at = 1;; ++at) {
        const test::TempFolder folder;
        const fs::path path = fs::path(folder.path()) / "a";
        if (replaced) REQUIRE(write(path, old_text).has_value());
        fault.start(at, error, kShortWrite);
        const auto result = write(path, new_text);
        const std::string name = fault.name.load();
        if (fault.stop() < at) break;
        CAPTURE(error, replaced, at, name);
        ++faults;
        errors += result ? 0 : 1;
        if (!result) {
          CHECK(result.error().code == build::ErrorCode::kIo);
          CHECK_THAT(result.error().message, Catch::Contains(std::generic_category().message(error)));
          CHECK_THAT(result.error().message, Catch::Contains("'" + path.string() + "'"));
        }
        const bool whole_new = content(path) == new_text;
        CHECK(whole_new == result.has_value());
        if (!result && replaced) CHECK(content(path) == old_text);
        CHECK(folder.names() == (result || replaced ? kOnlyA : std::vector<std::string>{}));
        CHECK(write(path, new_text).has_value());
      }
  std::printf("files: %u faults, %u errors, the others were survived\n", faults, errors);
  CHECK(errors > 0);
}

TEST_CASE("a signal that interrupts a call of the system changes nothing") {
  const std::string text(7000, 'n');
  unsigned faults = 0;
  for (unsigned at = 1;; ++at) {
    const test::TempFolder folder;
    const fs::path path = fs::path(folder.path()) / "a";
    REQUIRE(write(path, "old").has_value());
    leave_temporary(folder.path());
    fault.start(at, EINTR, kShortWrite);
    const auto result = write(path, text);
    const std::string name = fault.name.load();
    if (fault.stop() < at) break;
    if (name == "rename") continue;  // The system never interrupts it.
    CAPTURE(at, name);
    ++faults;
    CHECK(result.has_value());
    CHECK(content(path) == text);
  }
  CHECK(faults > 8);
}

TEST_CASE("temporary files of the dead are removed, those of living writers and other files are not") {
  const test::TempFolder folder;
  const fs::path& path = folder.path();
  leave_temporary(path);
  std::ofstream(path / ".hiprt-2-0.tmp") << "in work";
  std::ofstream(path / ".hiprt-notes") << "mine";
  std::ofstream(path / "x.tmp") << "mine";
  fs::create_symlink("x.tmp", path / ".hiprt-3-0.tmp");
  const int living = ::open((path / ".hiprt-2-0.tmp").c_str(), O_WRONLY | O_CLOEXEC);
  REQUIRE(::flock(living, LOCK_EX) == 0);
  SECTION("by a write") { REQUIRE(write(path / "a", "text").has_value()); }
  SECTION("by the check before it") {
    REQUIRE(build::check_writable(path / "a").has_value());
    std::ofstream(path / "a") << "text";
  }
  ::close(living);
  const std::vector<std::string> names = folder.names();
  CHECK(names == std::vector<std::string>{".hiprt-2-0.tmp", ".hiprt-3-0.tmp", ".hiprt-notes", "a", "x.tmp"});
  CHECK(content(path / "x.tmp") == "mine");
}

TEST_CASE("a writer that is killed at a random moment leaves the old file or the new one, whole") {
  oracle::Random random(34);
  const std::string texts[2] = {std::string(300000, 'a'), std::string(200000, 'b')};
  unsigned temporaries = 0;
  const unsigned kills = checks::trials(200);
  for (unsigned i = 0; i < kills; ++i) {
    const test::TempFolder folder;
    const fs::path path = fs::path(folder.path()) / "a";
    REQUIRE(write(path, texts[0]).has_value());
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0)
      for (unsigned k = 1;; ++k) static_cast<void>(write(path, texts[k % 2]));
    ::usleep(random.below(4000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const std::string found = content(path);
    CHECK((found == texts[0] || found == texts[1]));
    temporaries += folder.names() == kOnlyA ? 0 : 1;
    // This process has looked at the folder already: under another name it is a new one.
    fs::path renamed = folder.path();
    renamed += "-next";
    fs::rename(folder.path(), renamed);
    REQUIRE(build::check_writable(renamed / "a").has_value());
    fs::rename(renamed, folder.path());
    CHECK(folder.names() == kOnlyA);
  }
  std::printf("writers: %u killed, %u left a temporary file, which the next run removed\n", kills, temporaries);
}
