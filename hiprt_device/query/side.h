#pragma once
/// The sides of a surface.

namespace hiprt {

enum class Side {
  kOutside,
  kInside,
  kUnknown,  ///< The query failed: the stack was too small, or the policies do not cover the scene.
};

}  // namespace hiprt
