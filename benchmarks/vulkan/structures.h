#pragma once
/// Acceleration structures that are built together: of all objects of a scene, or the one over its instances.

#include "buffer.h"

#include <vector>

namespace hiprt::bench::vulkan {

enum class Preference { kFastBuild, kFastTrace };

struct BuildFlags {
  Preference preference = Preference::kFastTrace;
  bool compactable = true;  ///< Whether compact() will be called.
};

/// Acceleration structures that share a buffer.
class StructureSet {
 public:
  StructureSet() = default;
  /// @param sizes in bytes, of each.
  static build::Result<StructureSet> make(Device& device, VkAccelerationStructureTypeKHR type,
                                          std::span<const std::uint64_t> sizes);
  StructureSet(StructureSet&& other) noexcept { swap(other); }
  StructureSet& operator=(StructureSet&& other) noexcept {
    StructureSet(std::move(other)).swap(*this);
    return *this;
  }
  ~StructureSet();

  const std::vector<VkAccelerationStructureKHR>& handles() const { return handles_; }
  std::uint64_t bytes() const { return bytes_; }

 private:
  void swap(StructureSet& other) noexcept;

  Device* device_ = nullptr;
  Buffer buffer_;
  std::vector<VkAccelerationStructureKHR> handles_;
  std::uint64_t bytes_ = 0;  ///< Without the gaps that alignment leaves.
};

class Structures {
 public:
  /// Of one acceleration structure.
  struct Input {
    std::vector<VkAccelerationStructureGeometryKHR> geometries;
    std::vector<std::uint32_t> counts;  ///< Triangles of each geometry, or instances.
  };

  Structures() = default;
  /// Allocates all memory. The device and the memory of the inputs must outlive the structures.
  static build::Result<Structures> make(Device& device, VkAccelerationStructureTypeKHR type, BuildFlags flags,
                                        std::vector<Input> inputs);

  /// Builds, and replaces what the last call built. @pre compact() has not been called. @return seconds.
  build::Result<double> build();
  /// Copies the structures into less memory and frees the larger ones. @pre they are compactable. @return seconds of
  /// the copies.
  build::Result<double> compact();
  /// Frees the memory that only build() needs.
  void free_scratch() { scratch_ = {}; }

  std::size_t size() const { return inputs_.size(); }
  VkAccelerationStructureKHR handle(std::size_t i) const { return set_.handles()[i]; }
  VkDeviceAddress address(std::size_t i) const;
  std::uint64_t bytes() const { return set_.bytes(); }  ///< Now: less after compact().
  std::uint64_t scratch_bytes() const { return scratch_.size(); }

 private:
  struct Batch {
    std::size_t begin, end;  ///< Structures that are built at the same time.
  };
  build::Result<void> measure(std::vector<std::uint64_t>& sizes);
  build::Result<void> plan();
  VkAccelerationStructureBuildGeometryInfoKHR info(std::size_t i) const;
  void record(VkCommandBuffer commands, const Batch& batch) const;
  build::Result<std::vector<std::uint64_t>> compact_sizes();

  Device* device_ = nullptr;
  VkAccelerationStructureTypeKHR type_{};
  BuildFlags flags_{};
  std::vector<Input> inputs_;
  std::vector<std::uint64_t> scratch_sizes_, scratch_begins_;  ///< Of each structure, in its batch.
  std::vector<Batch> batches_;
  Buffer scratch_;
  std::uint64_t scratch_address_ = 0;  ///< Aligned.
  StructureSet set_;
};

}  // namespace hiprt::bench::vulkan
