#pragma once
/// An allocator of the caller's that counts, and that fails or misbehaves on request.

#include <hiprt_build/gpu/allocator.h>

#include <algorithm>
#include <map>
#include <vector>

namespace hiprt::checks {

class CountingAllocator final : public gpu::Allocator {
 public:
  ~CountingAllocator() override {
    for (const auto& [pointer, bytes] : live) static_cast<void>(hipFree(static_cast<std::byte*>(pointer) - offset));
  }

  gpu::Result<void*> allocate(std::size_t bytes, std::size_t alignment, hipStream_t stream) override {
    ++calls;
    alignments.push_back(alignment);
    streams.push_back(stream);
    auto memory = inner_.allocate(bytes + offset, alignment, stream);
    if (!memory) return memory;
    void* pointer = static_cast<std::byte*>(*memory) + offset;
    live[pointer] = bytes;
    most = std::max(most, balance());
    return pointer;
  }

  void free(void* pointer, hipStream_t stream) noexcept override {
    if (pointer == nullptr) return;
    if (live.erase(pointer) != 1) ++bad_frees;
    freed_on.push_back(stream);
    inner_.free(static_cast<std::byte*>(pointer) - offset, stream);
  }

  /// Bytes that nobody gave back.
  std::size_t balance() const {
    std::size_t sum = 0;
    for (const auto& [pointer, bytes] : live) sum += bytes;
    return sum;
  }

  std::size_t offset = 0;  ///< Bytes that its addresses lie behind aligned ones.
  unsigned calls = 0, bad_frees = 0;
  std::size_t most = 0;  ///< Bytes at once.
  std::map<void*, std::size_t> live;
  std::vector<std::size_t> alignments;
  std::vector<hipStream_t> streams, freed_on;

 private:
  gpu::DeviceAllocator inner_;
};

}  // namespace hiprt::checks
