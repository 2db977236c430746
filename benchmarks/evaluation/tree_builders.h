#pragma once
/// Builds our BVHs over the meshes of a hierarchy, on the CPU or a GPU.

#include "competitor.h"

#include <memory>
#include <vector>

namespace hiprt::bench {

class TreeBuilder {
 public:
  TreeBuilder(const TreeBuilder&) = delete;
  TreeBuilder& operator=(const TreeBuilder&) = delete;
  virtual ~TreeBuilder() = default;

  virtual bool on_cpu() const = 0;
  /// Builds one BVH over all meshes of a flat hierarchy.
  /// @param seconds CPU: from the meshes to the file. GPU: its own time, from meshes to a BVH in its memory.
  virtual build::Result<build::Bvh> build_flat(const Hierarchy& hierarchy, double& seconds) const = 0;
  /// Builds the BVHs of all objects. @param files one per object, in host memory. @param seconds their total time.
  virtual build::Result<void> build_objects(const Hierarchy& hierarchy, std::vector<build::Buffer>& files,
                                            double& seconds) const = 0;

 protected:
  explicit TreeBuilder(build::Builder kind) : kind_(kind) {}
  build::Builder kind() const { return kind_; }

 private:
  build::Builder kind_;
};

/// A builder of the machine's device. Embree's builders run on the CPU, for a GPU too.
std::unique_ptr<TreeBuilder> make_tree_builder(build::Builder kind, const Machine& machine);

}  // namespace hiprt::bench
