// expect: hiprt: Policies::Stack needs
// A stack without pop().

#include <hiprt_device/hiprt_device.h>

struct Stack {
  struct Storage {};
  template <class Entry> struct Of {
    explicit Of(const Storage&) {}
    bool has_room() const { return true; }
    void push(Entry) {}
    bool empty() const { return true; }
#if !HIPRT_FAULT
    Entry pop() { return Entry{}; }
#endif
  };
};
struct P : hiprt::Policies {
  using Stack = ::Stack;
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) {
  return hiprt::ClosestHit<P>(scene, ray, Stack::Storage{}).next_hit();
}
