#include "device.h"

#include <benchmarks/common/machine.h>
#include <tools/base/parallel.h>

#include <nlohmann/json.hpp>

#include <chrono>
#include <cstring>
#include <new>

namespace hiprt::bench {
namespace {

/// Items that a thread takes at a time.
constexpr std::size_t kBatch = 4096;
constexpr std::align_val_t kAlignment{256};

class CpuDevice final : public Device {
 public:
  explicit CpuDevice(unsigned threads) : limit_(threads) {}

  nlohmann::json describe() const override {
    return {{"kind", "cpu"}, {"name", cpu_name()}, {"threads", limit_.threads()}};
  }

  build::Result<Memory> allocate(std::size_t bytes) override {
    void* data = ::operator new(bytes, kAlignment);
    return Memory({data, [](void* owned) { ::operator delete(owned, kAlignment); }}, static_cast<std::byte*>(data),
                  bytes);
  }
  build::Result<void> write(const Memory& to, std::span<const std::byte> from) override {
    if (!from.empty()) std::memcpy(to.data(), from.data(), from.size());
    return {};
  }
  build::Result<void> read(const Memory& from, std::span<std::byte> to) const override {
    if (!to.empty()) std::memcpy(to.data(), from.data(), to.size());
    return {};
  }
  build::Result<void> fill(const Memory& memory, std::byte value) override {
    std::memset(memory.data(), std::to_integer<int>(value), memory.size());
    return {};
  }
  build::Result<LoadedScene> load(const BufferView& view) override { return LoadedScene{{}, make_scene_view(view)}; }

  build::Result<Resources> resources(const Kernel&) const override { return Resources{}; }

  build::Result<std::vector<double>> run(const Launch& launch, const Repetitions& repetitions) override {
    std::vector<double> milliseconds;
    for (unsigned i = 0; i < repetitions.warm_up + repetitions.timed; ++i) {
      const auto start = std::chrono::steady_clock::now();
      if (!run_once(launch))
        return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "the measurement was interrupted"});
      const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
      if (i >= repetitions.warm_up) milliseconds.push_back(time.count());
    }
    return milliseconds;
  }

 private:
  /// @return false after an interruption.
  bool run_once(const Launch& launch) const {
    if (launch.counter != nullptr) *launch.counter = 0;
    // One thread works without the batches: nothing but the kernel is timed.
    if (limit_.threads() == 1) {
      launch.kernel.cpu(launch.job, 0, launch.count);
      return true;
    }
    return tools::parallel_batches(launch.count, kBatch, limit_, [&](std::size_t begin, std::size_t end) {
      launch.kernel.cpu(launch.job, begin, end);
    });
  }

  tools::ThreadLimit limit_;
};

}  // namespace

std::unique_ptr<Device> make_cpu_device(unsigned threads) { return std::make_unique<CpuDevice>(threads); }

}  // namespace hiprt::bench
