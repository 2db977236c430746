// A stack policy of the caller's: entries in the caller's memory, interleaved as for the lanes of a GPU.

#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr unsigned kLanes = 4;

struct InterleavedStack {
  static constexpr unsigned kCapacity = 183;
  struct Storage {
    StackEntry* entries = nullptr;  ///< kCapacity * kLanes, this lane's from its number on.
  };

  template <class Entry> class Of {
   public:
    explicit Of(const Storage& storage) : entries_(storage.entries) {}
    bool has_room() const { return size_ + kMostPushed <= kCapacity; }
    void push(Entry entry) { entries_[kLanes * size_++] = entry; }
    Entry pop() { return static_cast<Entry>(entries_[kLanes * --size_]); }
    bool empty() const { return size_ == 0; }

   private:
    StackEntry* entries_;
    unsigned size_ = 0;
  };
};
static_assert(TraversalStack<InterleavedStack>);

struct P : Policies {
  using Stack = InterleavedStack;
};

}  // namespace

TEST_CASE("a stack in the caller's memory gives the same hits and touches its own lane only", "[stack]") {
  constexpr std::uint64_t kSeed = 77;
  INFO("seed " << kSeed);
  constexpr StackEntry kUntouched = 0xfeedfeedfeedfeedu;
  const Scene scene = make_scene({soup(trials(20000), 0.05, kSeed)});
  std::vector<StackEntry> memory(P::Stack::kCapacity * kLanes, kUntouched);
  Random random(kSeed);
  for (unsigned i = 0; i < trials(20000); ++i) {
    const Ray ray{vec3(random.in_cube(1.5)), 0.0f, vec3(random.in_cube(1))};
    const unsigned lane = random.below(kLanes - 1);
    NoCounter counter;
    const Hit closest = closest_hit<P>(scene.traced, ray, counter, {memory.data() + lane});
    REQUIRE(same_hit(closest, default_tracer().closest(scene, ray)));
    REQUIRE(any_hit<P>(scene.traced, ray, counter, {memory.data() + lane}).found() == closest.found());
  }
  bool used = false;
  for (std::size_t i = 0; i < memory.size(); ++i) {
    used = used || memory[i] != kUntouched;
    if (i % kLanes == kLanes - 1) REQUIRE(memory[i] == kUntouched);
  }
  CHECK(used);
}
