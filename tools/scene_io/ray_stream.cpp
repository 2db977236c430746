#include <tools/scene_io/ray_stream.h>

#include <tools/base/errors.h>
#include <tools/scene_io/rays_file.h>

#include <hiprt_build/format/temporary_file.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <system_error>
#include <utility>

namespace hiprt::tools {
namespace {

using build::file_detail::uninterrupted;

tl::unexpected<build::Error> system_fault(const char* what, const std::filesystem::path& path) {
  const std::string reason = std::generic_category().message(errno);
  return fail(build::ErrorCode::kIo, std::string("cannot ") + what + " '" + path.string() + "': " + reason);
}

/// Of read_at().
tl::unexpected<build::Error> read_fault(const std::filesystem::path& path) {
  if (errno != 0) return system_fault("read", path);
  return fail(build::ErrorCode::kIo, path.string() + ": another program shortened it");
}

/// Calls pread() or pwrite() until all bytes are done. @return whether they are; errno is 0 at the end of a file.
template <class Call> bool whole(std::size_t size, std::uint64_t offset, const Call& call) {
  for (std::size_t done = 0; done < size;) {
    const ssize_t count = call(done, size - done, static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) errno = 0;
    if (count <= 0) return false;
    done += static_cast<std::size_t>(count);
  }
  return true;
}

bool read_at(const Descriptor& file, std::span<std::byte> to, std::uint64_t offset) {
  return whole(to.size(), offset, [&](std::size_t done, std::size_t size, off_t at) {
    return ::pread(file.number(), to.data() + done, size, at);
  });
}

}  // namespace

Descriptor::Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}
Descriptor::~Descriptor() {
  if (number_ >= 0) ::close(number_);
}

build::Result<RayStream> RayStream::open(const std::filesystem::path& path) {
  RayStream stream;
  stream.path_ = path;
  // O_NONBLOCK: opening a FIFO must not wait for a writer.
  stream.file_ = Descriptor(uninterrupted([&] { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK); }));
  struct stat status {};
  if (stream.file_.number() < 0 || ::fstat(stream.file_.number(), &status) != 0) return system_fault("open", path);
  if (!S_ISREG(status.st_mode)) return fail(build::ErrorCode::kIo, path.string() + ": not a regular file");
  stream.size_ = static_cast<std::uint64_t>(status.st_size);
  stream.changed_ = status.st_mtim.tv_sec * std::int64_t{1'000'000'000} + status.st_mtim.tv_nsec;
  RaysHeader header{};
  if (stream.size_ >= sizeof(header) && !read_at(stream.file_, std::as_writable_bytes(std::span(&header, 1)), 0))
    return read_fault(path);
  const auto count = check_rays_header(path, header, stream.size_);
  if (!count) return tl::unexpected(count.error());
  stream.count_ = *count;
  stream.any_hit_ = header.any_hit == 1;
  return stream;
}

build::Result<std::vector<Ray>> RayStream::read(std::uint64_t first, std::size_t count) const {
  std::vector<std::byte> bytes(count * kRayBytes);
  if (!read_at(file_, bytes, sizeof(RaysHeader) + first * kRayBytes)) return read_fault(path_);
  std::vector<Ray> rays(count);
  decode_rays(bytes, rays);
  return rays;
}

build::Result<PartialOutput> PartialOutput::open(const std::filesystem::path& path, std::uint64_t size, bool goes_on) {
  PartialOutput file;
  // A link stays a link.
  std::error_code ignored;
  file.path_ = std::filesystem::weakly_canonical(path, ignored);
  file.part_ = file.path_;
  file.part_ += ".part";
  const int flags = O_RDWR | O_CLOEXEC | (goes_on ? 0 : O_CREAT | O_TRUNC);
  file.file_ = Descriptor(uninterrupted([&] { return ::open(file.part_.c_str(), flags, 0666); }));
  if (file.file_.number() < 0) return system_fault(goes_on ? "open" : "create", file.part_);
  struct stat status {};
  if (!goes_on && uninterrupted([&] { return ::ftruncate(file.file_.number(), static_cast<off_t>(size)); }) != 0) {
    auto fault = system_fault("enlarge", file.part_);
    file.remove();
    return fault;
  }
  if (::fstat(file.file_.number(), &status) != 0) return system_fault("examine", file.part_);
  if (static_cast<std::uint64_t>(status.st_size) != size)
    return invalid_input(file.part_.string() + ": has " + std::to_string(status.st_size) + " bytes, expected " +
                         std::to_string(size) + ": it is not the file of the run that is to go on");
  return file;
}

build::Result<void> PartialOutput::write(std::uint64_t offset, std::span<const std::byte> bytes) const {
  const bool written = whole(bytes.size(), offset, [&](std::size_t done, std::size_t size, off_t at) {
    return ::pwrite(file_.number(), bytes.data() + done, size, at);
  });
  if (written) return {};
  if (errno == 0) errno = ENOSPC;
  return system_fault("write", part_);
}

build::Result<void> PartialOutput::flush() const {
  if (uninterrupted([&] { return ::fsync(file_.number()); }) != 0) return system_fault("flush", part_);
  return {};
}

build::Result<void> PartialOutput::publish() const {
  if (::rename(part_.c_str(), path_.c_str()) != 0) return system_fault("rename", part_);
  return {};
}

void PartialOutput::remove() const { ::unlink(part_.c_str()); }

}  // namespace hiprt::tools
