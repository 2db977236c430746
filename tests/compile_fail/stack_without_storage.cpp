// expect: this stack needs storage
// A call with a stack in shared memory, without its storage.

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/traverse/stacks/rolling.h>

#if HIPRT_FAULT
using Stack = hiprt::RollingStack<8>;
#else
using Stack = hiprt::PrivateStack<>;
#endif
struct P : hiprt::Policies {
  using Stack = ::Stack;
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::any_hit<P>(scene, ray); }
