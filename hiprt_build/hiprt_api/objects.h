#pragma once
/// The geometries and scenes of a context. Internal.
///
/// A handle is the address of an ObjectHeader. Objects that are created together are a pool: one allocation, headers
/// first. So a million small geometries are one entry of the table.

#include <hiprt_build/gpu/batch.h>
#include <hiprt_build/gpu/instances.h>
#include <hiprt_build/gpu/refit.h>
#include <hiprt_build/hiprt_api/memory.h>

#include <map>
#include <memory>
#include <mutex>
#include <vector>

namespace hiprt::api {

/// What a handle points to, on the device.
struct alignas(kAlignment) ObjectHeader {
  SceneView view{};  ///< What kernels read. It must come first.
};
static_assert(sizeof(ObjectHeader) == kAlignment);

/// What the host knows of an object.
struct Member {
  std::byte* storage = nullptr;                    ///< Of the build's output.
  std::uint64_t capacity = 0;                      ///< Bytes there. 0: of a batch, or not known yet.
  const gpu::BuildReport* report = nullptr;        ///< Of a geometry that was built alone.
  const gpu::InstanceReport* instances = nullptr;  ///< Of a scene.
  std::unique_ptr<gpu::SceneParts> parts;          ///< Of a geometry that was updated since its build.
  bool alive = true;
  bool built = false;  ///< Built by itself; Pool::is_built() knows of batches.
};

/// Objects of one allocation.
struct Pool {
  Allocation memory;
  std::vector<Member> members;
  std::size_t alive = 0;
  /// The first so many geometries are built together.
  std::uint32_t batched = 0;
  std::byte* batch_storage = nullptr;
  std::vector<std::uint32_t> batch_counts;  ///< Primitives of each when they were created.
  gpu::BuildSizes batch_sizes;              ///< For these numbers.
  gpu::BatchScenes batch{};                 ///< Of the last build.
  bool compact = false;                     ///< The memory has no gaps between the batch's scenes.
  /// Storage of members that did not fit in their own.
  std::mutex mutex;
  std::map<std::size_t, Allocation> late;

  ObjectHeader* header(std::size_t i) const { return reinterpret_cast<ObjectHeader*>(memory.data()) + i; }
  bool is_built(std::size_t i) const { return members[i].built || (i < batched && batch.views != nullptr); }
  /// Gives a member memory of so many bytes.
  Result<void> reserve(std::size_t i, std::uint64_t bytes);
};

/// Room in front of a file on the device, for pool_of_one(): a header, and the report for updates.
inline constexpr std::uint64_t kHeadroom = 2 * sizeof(ObjectHeader);

/// A pool of one built geometry or loaded scene.
/// @param allocator of headroom kHeadroom. @p file came from it; the memory moves to the pool.
/// @param report of that file.
/// @param stream is waited for.
Result<std::shared_ptr<Pool>> pool_of_one(HeadroomAllocator& allocator, const std::byte* file,
                                          const gpu::BuildReport& report, hipStream_t stream);

/// An object of a table.
struct Found {
  std::shared_ptr<Pool> pool;  ///< nullptr: the handle is of another context.
  std::size_t index = 0;

  explicit operator bool() const { return pool != nullptr; }
  Member& member() const { return pool->members[index]; }
  bool is_built() const { return pool->is_built(index); }
  ObjectHeader* header() const { return pool->header(index); }
};

class ObjectTable {
 public:
  void add(std::shared_ptr<Pool> pool);
  Found find(const void* handle) const;
  /// @return false: the handle is of another context.
  bool remove(const void* handle);
  /// Forgets all objects. Their memory stays: kernels may still use the handles.
  void abandon();

 private:
  mutable std::mutex mutex_;
  std::map<std::uintptr_t, std::shared_ptr<Pool>> pools_;  ///< By the address of the first header.
};

}  // namespace hiprt::api
