#pragma once
/// The custom primitive of the GPU tests.

namespace hiprt::checks {

struct Sphere {
  float center[3];
  float radius;
};

}  // namespace hiprt::checks
