#include <hiprt_build/hiprt_api/objects.h>

namespace hiprt::api {
namespace {

constexpr std::uint64_t kReportAt = sizeof(ObjectHeader);
static_assert(kReportAt + sizeof(gpu::BuildReport) <= kHeadroom);

Result<void> upload(void* to, const void* from, std::size_t bytes, hipStream_t stream) {
  return gpu::check(hipMemcpyAsync(to, from, bytes, hipMemcpyHostToDevice, stream), "hipMemcpyAsync", bytes, " bytes");
}

}  // namespace

Result<void> Pool::reserve(std::size_t i, std::uint64_t bytes) {
  Member& member = members[i];
  if (bytes <= member.capacity) return {};
  auto more = Allocation::make(bytes);
  if (!more) return tl::unexpected(std::move(more.error()));
  member.storage = more->data();
  member.capacity = bytes;
  const std::scoped_lock lock(mutex);
  late[i] = std::move(*more);
  return {};
}

Result<std::shared_ptr<Pool>> pool_of_one(HeadroomAllocator& allocator, const std::byte* file,
                                          const gpu::BuildReport& report, hipStream_t stream) {
  auto pool = std::make_shared<Pool>();
  pool->memory = allocator.adopt(file);
  std::byte* const report_at = pool->memory.data() + kReportAt;
  Member member;
  member.storage = pool->memory.data() + kHeadroom;
  member.capacity = pool->memory.size() - kHeadroom;
  member.report = reinterpret_cast<const gpu::BuildReport*>(report_at);
  member.built = true;
  pool->members.push_back(std::move(member));
  auto done = upload(pool->header(0), &report.view, sizeof(report.view), stream);
  if (done) done = upload(report_at, &report, sizeof(report), stream);
  if (done) done = gpu::check(hipStreamSynchronize(stream), "hipStreamSynchronize");
  if (!done) return tl::unexpected(std::move(done.error()));
  return pool;
}

void ObjectTable::add(std::shared_ptr<Pool> pool) {
  pool->alive = pool->members.size();
  const auto address = reinterpret_cast<std::uintptr_t>(pool->memory.data());
  const std::scoped_lock lock(mutex_);
  pools_[address] = std::move(pool);
}

Found ObjectTable::find(const void* handle) const {
  const auto address = reinterpret_cast<std::uintptr_t>(handle);
  const std::scoped_lock lock(mutex_);
  auto at = pools_.upper_bound(address);
  if (at == pools_.begin()) return {};
  --at;
  const std::uintptr_t offset = address - at->first;
  const std::size_t index = offset / sizeof(ObjectHeader);
  const Pool& pool = *at->second;
  if (offset % sizeof(ObjectHeader) != 0 || index >= pool.members.size() || !pool.members[index].alive) return {};
  return {at->second, index};
}

bool ObjectTable::remove(const void* handle) {
  const Found found = find(handle);
  if (!found) return false;
  const std::scoped_lock lock(mutex_);
  if (!found.member().alive) return false;
  found.member().alive = false;
  {
    const std::scoped_lock late_lock(found.pool->mutex);
    found.pool->late.erase(found.index);
  }
  if (--found.pool->alive == 0) pools_.erase(reinterpret_cast<std::uintptr_t>(found.pool->memory.data()));
  return true;
}

void ObjectTable::abandon() {
  const std::scoped_lock lock(mutex_);
  for (auto& [address, pool] : pools_) {
    pool->memory.abandon();
    for (auto& [index, memory] : pool->late) memory.abandon();
  }
  pools_.clear();
}

}  // namespace hiprt::api
