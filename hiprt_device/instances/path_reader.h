#pragma once
/// The instances that a traversal is in, for functors: custom primitives and filters.

#include <hiprt_device/instances/levels.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Reads the instances on the way from the scene to the object at hand. It costs nothing where nothing is read.
/// @tparam Levels of the traversal.
template <class Levels> class PathReader {
 public:
  /// Both must live as long as the reader.
  HIPRT_HD HIPRT_FORCE_INLINE PathReader(const SceneView& scene, const Levels& levels)
      : scene_(&scene), levels_(&levels) {}

  /// Number of instances: 0 in a scene without instances.
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t depth() const { return levels_->depth(); }
  /// The numbers of the instances, the outermost first.
  HIPRT_HD HIPRT_FORCE_INLINE auto path() const { return levels_->path(); }
  /// The program's own number of an instance (InstanceRecord::id).
  /// @param level less than depth(); 0: the outermost.
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t instance_id(unsigned level) const {
    return levels_->instance_id(*scene_, level);
  }

 protected:
  const SceneView* scene_;
  const Levels* levels_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
