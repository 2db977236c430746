#pragma once
/// Launches kernels. Sizes are checked before the launch, and errors are returned as values.

#include <hiprt_build/gpu/error.h>
#include <hiprt_device/scene_view.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace hiprt::gpu {

/// Number of blocks of a launch, along each axis.
struct Grid {
  unsigned x = 1, y = 1, z = 1;
};

struct LaunchOptions {
  unsigned block = 0;  ///< Threads of a block, along x; 0: the number with the highest occupancy.
  std::size_t dynamic_shared_bytes = 0;
  const char* name = "kernel";  ///< For messages.
};

namespace launch_detail {

/// The requested launch, and the kernel's limits on the current device.
struct Plan {
  const void* kernel;
  Grid grid;
  unsigned block;
  std::size_t dynamic_shared_bytes;
  const char* name;
  hipFuncAttributes attributes;
};

inline std::string describe(const Plan& plan) {
  const auto text = [](std::uint64_t number) { return std::to_string(number); };
  return std::string("launch of ") + plan.name + ": grid " + text(plan.grid.x) + " x " + text(plan.grid.y) + " x " +
         text(plan.grid.z) + ", block " + text(plan.block) + ", shared memory " +
         text(plan.attributes.sharedSizeBytes) + " + " + text(plan.dynamic_shared_bytes) + " bytes";
}

/// @return kInvalidInput for a number over its limit.
inline Result<void> within(const Plan& plan, const char* what, std::uint64_t number, std::uint64_t limit,
                           const char* limit_name) {
  if (number <= limit) return {};
  return fail(ErrorCode::kInvalidInput, describe(plan), ": ", what, " ", number, " is over ", limit_name, ", ", limit);
}

/// Checks one axis of the grid. AMD's runtime and most kernels count the threads along an axis in 32 bits.
inline Result<void> check_axis(const Plan& plan, std::uint64_t blocks, std::uint64_t block, hipDeviceAttribute_t limit,
                               const char* limit_name) {
  if (blocks == 0) return fail(ErrorCode::kInvalidInput, describe(plan), ": the grid is empty");
  int device = 0, most = 0;
  if (auto got = check(hipGetDevice(&device), "hipGetDevice"); !got) return got;
  if (auto got = check(hipDeviceGetAttribute(&most, limit, device), "hipDeviceGetAttribute", limit_name); !got)
    return got;
  if (auto fits = within(plan, "grid", blocks, static_cast<std::uint64_t>(most), limit_name); !fits) return fits;
  return within(plan, "threads along an axis", blocks * block, std::numeric_limits<std::uint32_t>::max(), "32 bits");
}

inline Result<void> check_grid_limits(const Plan& plan) {
  const Grid& grid = plan.grid;
  if (auto x = check_axis(plan, grid.x, plan.block, hipDeviceAttributeMaxGridDimX, "the device's MaxGridDimX"); !x)
    return x;
  if (auto y = check_axis(plan, grid.y, 1, hipDeviceAttributeMaxGridDimY, "the device's MaxGridDimY"); !y) return y;
  return check_axis(plan, grid.z, 1, hipDeviceAttributeMaxGridDimZ, "the device's MaxGridDimZ");
}

/// @return the number of threads of a block that gives the highest occupancy.
inline Result<unsigned> choose_block(const Plan& plan) {
  int grid = 0, block = 0;
  if (auto chosen = check(hipOccupancyMaxPotentialBlockSize(&grid, &block, plan.kernel, plan.dynamic_shared_bytes, 0),
                          "hipOccupancyMaxPotentialBlockSize", describe(plan));
      !chosen)
    return tl::unexpected(std::move(chosen.error()));
  if (block < 1) return fail(ErrorCode::kInvalidInput, describe(plan), ": no block fits on a compute unit");
  return static_cast<unsigned>(block);
}

/// Makes a plan without its grid: chooses the size of the block if it is 0, and checks the block.
inline Result<Plan> make_plan(const void* kernel, const LaunchOptions& options) {
  Plan plan{kernel, {}, options.block, options.dynamic_shared_bytes, options.name, {}};
  if (auto got = check(hipFuncGetAttributes(&plan.attributes, kernel), "hipFuncGetAttributes", plan.name); !got)
    return tl::unexpected(std::move(got.error()));
  const auto shared = static_cast<std::uint64_t>(plan.attributes.maxDynamicSharedSizeBytes);
  if (auto fits = within(plan, "dynamic shared memory", plan.dynamic_shared_bytes, shared,
                         "the kernel's maxDynamicSharedSizeBytes");
      !fits)
    return tl::unexpected(std::move(fits.error()));
  if (plan.block == 0) {
    auto block = choose_block(plan);
    if (!block) return tl::unexpected(std::move(block.error()));
    plan.block = *block;
  }
  const auto threads = static_cast<std::uint64_t>(plan.attributes.maxThreadsPerBlock);
  if (auto fits = within(plan, "block", plan.block, threads, "the kernel's maxThreadsPerBlock"); !fits)
    return tl::unexpected(std::move(fits.error()));
  return plan;
}

/// Debug builds check where the memory of a scene is. A kernel that gets a view of host memory would fault, or return
/// hits of unrelated device memory.
template <class Argument> Result<void> check_argument(const Plan&, const Argument&) { return {}; }
#if !defined(NDEBUG)
inline Result<void> check_argument(const Plan& plan, const SceneView& scene) {
  hipPointerAttribute_t attributes{};
  if (scene.base == nullptr || hipPointerGetAttributes(&attributes, scene.base) == hipSuccess) return {};
  static_cast<void>(hipGetLastError());  // hipPointerGetAttributes() has set it.
  return fail(
      ErrorCode::kInvalidInput, describe(plan),
      ": the SceneView is of host memory, which the device cannot read; take the view of upload_scene(), or pass "
      "the address of the device's copy to make_scene_view()");
}
#endif

template <class... Arguments> Result<void> check_arguments(const Plan& plan, const Arguments&... arguments) {
  Result<void> result;
  static_cast<void>(((result = check_argument(plan, arguments)).has_value() && ...));
  return result;
}

/// @param arguments the addresses of the kernel's arguments.
inline Result<void> start(const Plan& plan, hipStream_t stream, void** arguments) {
  if (auto fits = check_grid_limits(plan); !fits) return fits;
  return check(hipLaunchKernel(plan.kernel, dim3(plan.grid.x, plan.grid.y, plan.grid.z), dim3(plan.block), arguments,
                               plan.dynamic_shared_bytes, stream),
               "hipLaunchKernel", describe(plan));
}

}  // namespace launch_detail

/// Starts @p kernel on @p stream, which must belong to the current device. Returns before the kernel is done. The call
/// that waits for the stream reports errors of the kernel itself (a bad address).
/// @param arguments convert to the kernel's parameters.
/// @return kInvalidInput with the launch's sizes and the limit that it exceeds, or the runtime's error. In debug builds
/// (without NDEBUG) also kInvalidInput for a SceneView of memory that the device cannot read.
template <class... Parameters>
Result<void> launch(void (*kernel)(Parameters...), Grid grid, hipStream_t stream, const LaunchOptions& options,
                    std::type_identity_t<Parameters>... arguments) {
  auto plan = launch_detail::make_plan(reinterpret_cast<const void*>(kernel), options);
  if (!plan) return tl::unexpected(std::move(plan.error()));
  plan->grid = grid;
  if (auto good = launch_detail::check_arguments(*plan, arguments...); !good) return good;
  std::array<void*, sizeof...(Parameters) + 1> addresses{&arguments...};
  return launch_detail::start(*plan, stream, addresses.data());
}

/// The same with as many blocks along x as @p count threads need: thread i works on item i if i < @p count. If @p count
/// is 0, nothing is started.
template <class... Parameters>
Result<void> launch(void (*kernel)(Parameters...), std::uint64_t count, hipStream_t stream,
                    const LaunchOptions& options, std::type_identity_t<Parameters>... arguments) {
  if (count == 0) return {};
  auto plan = launch_detail::make_plan(reinterpret_cast<const void*>(kernel), options);
  if (!plan) return tl::unexpected(std::move(plan.error()));
  const std::uint64_t blocks = (count - 1) / plan->block + 1;
  if (auto fits = launch_detail::within(*plan, "items", count, std::numeric_limits<std::uint32_t>::max(), "32 bits");
      !fits)
    return fits;
  plan->grid.x = static_cast<unsigned>(blocks);
  if (auto good = launch_detail::check_arguments(*plan, arguments...); !good) return good;
  std::array<void*, sizeof...(Parameters) + 1> addresses{&arguments...};
  return launch_detail::start(*plan, stream, addresses.data());
}

namespace launch_detail {

/// On an NVIDIA multiprocessor, L1 and shared memory are parts of one memory. Sets the percentage that becomes shared
/// memory; -1: the driver decides. Does nothing on AMD, where they are separate.
inline Result<void> prefer_shared_memory([[maybe_unused]] const void* kernel, [[maybe_unused]] int percent) {
#if defined(__HIP_PLATFORM_NVIDIA__)
  return check(hipFuncSetAttribute(kernel, hipFuncAttributePreferredSharedMemoryCarveout, percent),
               "hipFuncSetAttribute", "PreferredSharedMemoryCarveout");
#else
  return {};
#endif
}

/// @return the least percentage that @p resident blocks need. The driver rounds it up to the next division that the
/// device has. @param bytes of shared memory per block.
inline Result<int> percent_needed([[maybe_unused]] unsigned resident, [[maybe_unused]] std::size_t bytes) {
#if defined(__HIP_PLATFORM_NVIDIA__)
  int device = 0, most = 0, reserved = 0;
  auto done = check(hipGetDevice(&device), "hipGetDevice");
  if (done)
    done = check(hipDeviceGetAttribute(&most, hipDeviceAttributeMaxSharedMemoryPerMultiprocessor, device),
                 "hipDeviceGetAttribute", "MaxSharedMemoryPerMultiprocessor");
  if (done)
    done = check(hipDeviceGetAttribute(&reserved, hipDeviceAttributeReservedSharedMemPerBlock, device),
                 "hipDeviceGetAttribute", "ReservedSharedMemPerBlock");
  if (!done) return tl::unexpected(std::move(done.error()));
  if (most < 1) return 100;
  const std::uint64_t needed = std::uint64_t{resident} * (bytes + static_cast<std::uint64_t>(reserved));
  const auto all = static_cast<std::uint64_t>(most);
  return static_cast<int>(std::min<std::uint64_t>((100 * needed + all - 1) / all, 100));
#else
  return 100;
#endif
}

}  // namespace launch_detail

/// @return how many blocks of @p block threads a compute unit holds at once; 0 if not one fits.
inline Result<unsigned> resident_blocks(const void* kernel, unsigned block, std::size_t dynamic_shared_bytes) {
  int resident = 0;
  const auto done = check(
      hipOccupancyMaxActiveBlocksPerMultiprocessor(&resident, kernel, static_cast<int>(block), dynamic_shared_bytes),
      "hipOccupancyMaxActiveBlocksPerMultiprocessor");
  if (!done) return tl::unexpected(done.error());
  return resident < 1 ? 0u : static_cast<unsigned>(resident);
}

/// For kernels that read much through L1 and use shared memory. On NVIDIA both are parts of one memory, and the driver
/// gives shared memory more than the resident blocks need. This function sets what they need. The setting holds until
/// the next call for the same kernel. Does nothing on AMD.
/// @param block, dynamic_shared_bytes those of the later launches.
inline Result<void> divide_l1(const void* kernel, unsigned block, std::size_t dynamic_shared_bytes = 0) {
  const auto plan = launch_detail::make_plan(kernel, {.block = block, .dynamic_shared_bytes = dynamic_shared_bytes});
  if (!plan) return tl::unexpected(plan.error());
  const std::size_t bytes = plan->attributes.sharedSizeBytes + dynamic_shared_bytes;
  // An earlier division would limit the number of resident blocks.
  auto done = launch_detail::prefer_shared_memory(kernel, bytes == 0 ? -1 : 100);
  if (!done || bytes == 0) return done;
  const auto resident = resident_blocks(kernel, block, dynamic_shared_bytes);
  if (!resident) return tl::unexpected(resident.error());
  const auto percent = launch_detail::percent_needed(*resident, bytes);
  if (!percent) return tl::unexpected(percent.error());
  return launch_detail::prefer_shared_memory(kernel, *percent);
}

/// The grid of a persistent kernel, whose blocks fetch work until none is left: the number of blocks that the whole
/// device holds at once.
/// @param block threads of a block, more than 0.
/// @param dynamic_shared_bytes of a block.
/// @return at least 1, or kInvalidInput with the limit if not even one block fits.
template <class... Parameters>
Result<unsigned> persistent_grid(void (*kernel)(Parameters...), unsigned block, std::size_t dynamic_shared_bytes = 0) {
  if (block == 0) return fail(ErrorCode::kInvalidInput, "persistent_grid: blocks of 0 threads");
  const auto plan = launch_detail::make_plan(reinterpret_cast<const void*>(kernel),
                                             {.block = block, .dynamic_shared_bytes = dynamic_shared_bytes});
  if (!plan) return tl::unexpected(plan.error());
  int device = 0, units = 0;
  auto done = check(hipGetDevice(&device), "hipGetDevice");
  if (done)
    done = check(hipDeviceGetAttribute(&units, hipDeviceAttributeMultiprocessorCount, device), "hipDeviceGetAttribute",
                 "MultiprocessorCount");
  if (!done) return tl::unexpected(std::move(done.error()));
  const auto resident = resident_blocks(plan->kernel, block, dynamic_shared_bytes);
  if (!resident) return fail(resident.error().code, resident.error().message, "; ", launch_detail::describe(*plan));
  if (*resident < 1 || units < 1)
    return fail(ErrorCode::kInvalidInput, launch_detail::describe(*plan), ": not one block fits on a compute unit");
  return *resident * static_cast<unsigned>(units);
}

}  // namespace hiprt::gpu
