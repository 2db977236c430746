#include <hiprt_build/file.h>

#include <tests/catch.h>

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

using namespace hiprt::build;
namespace fs = std::filesystem;

namespace {

/// A temporary folder, removed after the test.
class Folder {
 public:
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "hiprt-test-XXXXXX").string();
    REQUIRE(::mkdtemp(pattern.data()) != nullptr);
    path_ = pattern;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }
  std::ptrdiff_t entries() const { return std::distance(fs::directory_iterator(path_), fs::directory_iterator()); }

 private:
  fs::path path_;
};

std::span<const std::byte> as_bytes(const std::string& text) { return std::as_bytes(std::span(text)); }

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <class T> void check_fails(const Result<T>& result, const fs::path& path, const std::string& reason) {
  REQUIRE_FALSE(result);
  CHECK(result.error().code == ErrorCode::kIo);
  INFO(result.error().message);
  CHECK(result.error().message.find("'" + path.string() + "'") != std::string::npos);
  CHECK(result.error().message.find(reason) != std::string::npos);
}

/// More than two parts of read_file(); no two aligned words of it are equal.
fs::path write_large_file(const Folder& folder, std::vector<std::uint32_t>& words) {
  words.resize((40u << 20) / sizeof(std::uint32_t) + 1);
  std::iota(words.begin(), words.end(), 0u);
  fs::path path = folder.path() / "large";
  REQUIRE(write_file(path, std::as_bytes(std::span(words))));
  fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::hours(1));
  return path;
}

}  // namespace

TEST_CASE("a written file can be mapped") {
  const Folder folder;
  const fs::path path = folder.path() / "a.bvh";
  const std::string text(100000, 'x');
  REQUIRE(write_file(path, as_bytes(text)));
  CHECK(folder.entries() == 1);
  auto mapped = map_file(path);
  REQUIRE(mapped);
  CHECK(mapped->size() == text.size());
  CHECK(std::equal(mapped->bytes().begin(), mapped->bytes().end(), as_bytes(text).begin()));
  // The mapping outlives the name.
  fs::remove(path);
  CHECK(mapped->bytes()[99999] == std::byte{'x'});
}

TEST_CASE("a file is replaced as a whole and keeps its permissions") {
  const Folder folder;
  const fs::path path = folder.path() / "a.bvh";
  REQUIRE(write_file(path, as_bytes("old content")));
  const auto old = map_file(path);
  REQUIRE(old);
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  REQUIRE(write_file(path, as_bytes("new")));
  CHECK(content(path) == "new");
  CHECK(old->bytes()[0] == std::byte{'o'});  // Who has the old file mapped keeps it.
  CHECK(fs::status(path).permissions() == (fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read));
  CHECK(folder.entries() == 1);
}

TEST_CASE("a new file has the permissions that the umask gives") {
  const Folder folder;
  const mode_t before = ::umask(027);
  const auto written = write_file(folder.path() / "a", as_bytes("x"));
  ::umask(before);
  REQUIRE(written);
  struct stat status {};
  REQUIRE(::stat((folder.path() / "a").c_str(), &status) == 0);
  CHECK((status.st_mode & 0777) == 0640);
}

TEST_CASE("writing through a symbolic link keeps the link") {
  const Folder folder;
  const fs::path target = folder.path() / "target", link = folder.path() / "link";
  REQUIRE(write_file(target, as_bytes("old")));
  fs::create_symlink("target", link);
  REQUIRE(write_file(link, as_bytes("new")));
  CHECK(fs::is_symlink(link));
  CHECK(content(target) == "new");
  fs::remove(target);
  check_fails(write_file(link, as_bytes("x")), link, "No such file or directory");
}

TEST_CASE("a file that cannot be mapped is refused with the reason") {
  const Folder folder;
  const fs::path missing = folder.path() / "missing", empty = folder.path() / "empty", fifo = folder.path() / "fifo";
  check_fails(map_file(missing), missing, "No such file or directory");
  check_fails(map_file(folder.path()), folder.path(), "directory");
  REQUIRE(write_file(empty, {}));
  check_fails(map_file(empty), empty, "empty");
  REQUIRE(::mkfifo(fifo.c_str(), 0600) == 0);
  check_fails(map_file(fifo), fifo, "not a regular file");
  check_fails(map_file("/dev/null"), "/dev/null", "not a regular file");
  check_fails(map_file(""), "", "No such file or directory");
}

TEST_CASE("a file that cannot be read is refused with the reason") {
  const Folder folder;
  const fs::path missing = folder.path() / "missing", empty = folder.path() / "empty", fifo = folder.path() / "fifo";
  check_fails(read_file(missing), missing, "No such file or directory");
  check_fails(read_file(folder.path()), folder.path(), "directory");
  REQUIRE(write_file(empty, {}));
  check_fails(read_file(empty), empty, "empty");
  REQUIRE(::mkfifo(fifo.c_str(), 0600) == 0);
  check_fails(read_file(fifo), fifo, "not a regular file");
}

TEST_CASE("the bytes that read_file() has read stay when the file is shortened or written to") {
  const Folder folder;
  const fs::path path = folder.path() / "a";
  const std::string text(1 << 20, 'o');
  REQUIRE(write_file(path, as_bytes(text)));
  const auto file = read_file(path);
  REQUIRE(file);
  std::ofstream(path, std::ios::binary | std::ios::in) << "new";
  fs::resize_file(path, 10);
  CHECK(std::equal(file->bytes().begin(), file->bytes().end(), as_bytes(text).begin(), as_bytes(text).end()));
}

TEST_CASE("read_file() refuses a file that ends before its size") {
  // Files of sysfs say that they have a page and have less.
  const fs::path path = "/sys/kernel/mm/transparent_hugepage/enabled";
  std::error_code ignored;
  if (!fs::exists(path, ignored) || fs::file_size(path, ignored) < 100) {
    WARN("not run: there is no " << path);
    return;
  }
  check_fails(read_file(path), path, "another program shortened it");
}

TEST_CASE("read_file() reads each part of a large file once, on the threads of its loop") {
  const Folder folder;
  std::vector<std::uint32_t> words;
  const fs::path path = write_large_file(folder, words);
  std::size_t parts = 0;
  const auto on_threads = [&](std::size_t count, const std::function<void(std::size_t)>& body) {
    parts = count;
    std::vector<std::thread> threads;
    for (std::size_t i = count; i-- > 0;) threads.emplace_back(body, i);
    for (std::thread& thread : threads) thread.join();
  };
  const auto file = read_file(path, on_threads), alone = read_file(path);
  REQUIRE(file);
  REQUIRE(alone);
  CHECK(parts == 3);
  for (const Buffer* buffer : {&*file, &*alone}) {
    const auto bytes = buffer->bytes();
    CHECK(std::equal(bytes.begin(), bytes.end(), std::as_bytes(std::span(words)).begin(),
                     std::as_bytes(std::span(words)).end()));
  }
}

TEST_CASE("read_file() names the first missing byte of a file that is shortened between two parts") {
  const Folder folder;
  std::vector<std::uint32_t> words;
  const fs::path path = write_large_file(folder, words);
  const auto shorten = [&](std::size_t count, const std::function<void(std::size_t)>& body) {
    body(0);
    fs::resize_file(path, (20u << 20) + 1);
    for (std::size_t i = count; i-- > 1;) body(i);
  };
  check_fails(read_file(path, shorten), path, "ended at byte 20971521: another program shortened it");
}

TEST_CASE("read_file() refuses a file that is written to between two parts") {
  const Folder folder;
  std::vector<std::uint32_t> words;
  const fs::path path = write_large_file(folder, words);
  const auto write = [&](std::size_t count, const std::function<void(std::size_t)>& body) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    std::ofstream(path, std::ios::binary | std::ios::in) << "new";
  };
  check_fails(read_file(path, write), path, "another program changed it");
}

TEST_CASE("a file that cannot be written is refused with the reason and leaves no file") {
  const Folder folder;
  const fs::path nowhere = folder.path() / "no" / "where", fifo = folder.path() / "fifo";
  check_fails(write_file(nowhere, as_bytes("x")), nowhere, "No such file or directory");
  check_fails(write_file(folder.path(), as_bytes("x")), folder.path(), "directory");
  REQUIRE(::mkfifo(fifo.c_str(), 0600) == 0);
  check_fails(write_file(fifo, as_bytes("x")), fifo, "not a regular file");
  check_fails(write_file("/dev/null", as_bytes("x")), "/dev/null", "not a regular file");
  CHECK(fs::is_character_file("/dev/null"));
  check_fails(write_file("", as_bytes("x")), "", "no file");
  CHECK(folder.entries() == 1);
}

TEST_CASE("check_writable() tells before the write whether a file can be written") {
  const Folder folder;
  const fs::path path = folder.path() / "a", nowhere = folder.path() / "no" / "where";
  CHECK(check_writable(path));
  CHECK(folder.entries() == 0);
  REQUIRE(write_file(path, as_bytes("old")));
  CHECK(check_writable(path));
  check_fails(check_writable(nowhere), nowhere, "there is no folder");
  check_fails(check_writable(folder.path()), folder.path(), "directory");
  check_fails(check_writable("/dev/null"), "/dev/null", "not a regular file");
  check_fails(check_writable(""), "", "no file");
}

TEST_CASE("a file without write permission is not replaced, nor one made in a folder without it") {
  const Folder folder;
  const fs::path open = folder.path() / "open", closed = folder.path() / "closed", path = open / "a";
  REQUIRE((fs::create_directory(open) && fs::create_directory(closed)));
  REQUIRE(write_file(path, as_bytes("old")));
  REQUIRE(::chmod(folder.path().c_str(), 0755) == 0);
  REQUIRE(::chmod(open.c_str(), 0777) == 0);
  REQUIRE(::chmod(closed.c_str(), 0555) == 0);
  REQUIRE(::chmod(path.c_str(), 0444) == 0);
  // Root may write everywhere, so it becomes nobody for a while.
  constexpr uid_t kNobody = 65534;
  const bool root = ::geteuid() == 0;
  if (root) REQUIRE(::seteuid(kNobody) == 0);
  const auto early = check_writable(path), written = write_file(path, as_bytes("new")),
             inside = check_writable(closed / "a");
  if (root) REQUIRE(::seteuid(0) == 0);
  check_fails(early, path, "Permission denied");
  check_fails(written, path, "Permission denied");
  check_fails(inside, closed / "a", "Permission denied");
  CHECK(content(path) == "old");
}

TEST_CASE("a full disk keeps the old file and leaves no temporary file") {
  const Folder folder;
  const fs::path path = folder.path() / "a";
  REQUIRE(write_file(path, as_bytes("old")));
  // A limit on file sizes makes write() fail like a full disk, for root too.
  struct rlimit before {};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  struct rlimit limit = before;
  limit.rlim_cur = 4096;
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
  const auto written = write_file(path, as_bytes(std::string(100000, 'y')));
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &before) == 0);
  std::signal(SIGXFSZ, old_handler);
  check_fails(written, path, "File too large");
  CHECK(content(path) == "old");
  CHECK(folder.entries() == 1);
}

TEST_CASE("simultaneous writers of one file leave the content of one of them") {
  const Folder folder;
  const fs::path path = folder.path() / "a";
  std::vector<std::thread> writers;
  std::array<bool, 4> good{};
  for (std::size_t i = 0; i < good.size(); ++i)
    writers.emplace_back([&, i] {
      good[i] = true;
      for (int repeat = 0; repeat < 5; ++repeat)
        good[i] = write_file(path, as_bytes(std::string(50000, static_cast<char>('a' + i)))).has_value() && good[i];
    });
  for (auto& writer : writers) writer.join();
  for (const bool each : good) CHECK(each);
  const std::string last = content(path);
  CHECK(last == std::string(50000, last.at(0)));
  CHECK(folder.entries() == 1);
}
