// On a machine without a GPU every function reports that (run_gpu_test.sh none).

#include <hiprt_build/gpu/gpu.h>
#include <tests/gpu/kernels.h>
#include <tests/gpu/results.h>

using namespace hiprt;
using namespace hiprt::checks;
using Catch::Matchers::Contains;

TEST_CASE("without a GPU every function returns an error that says so", "[.no_device]") {
  gpu::DeviceAllocator plain;
  gpu::StreamAllocator ordered;
  std::vector<gpu::Error> errors{error_of(gpu::devices()),
                                 error_of(gpu::device(0)),
                                 error_of(gpu::current_device()),
                                 error_of(plain.allocate(64, 64, nullptr)),
                                 error_of(ordered.allocate(64, 64, nullptr)),
                                 error_of(gpu::launch(nothing, 1, nullptr, {})),
                                 error_of(gpu::persistent_grid(nothing, 64)),
                                 error_of(gpu::divide_l1(reinterpret_cast<const void*>(nothing), 64)),
                                 error_of(gpu::Event::make())};
  for (const gpu::Error& error : errors) {
    CHECK(error.code == gpu::ErrorCode::kNoDevice);
    CHECK_THAT(error.message, Contains("no GPU can be used here"));
  }
}
