// The constants of PathTransform, each computed from the terms of docs/proofs/instances.md and docs/proofs/motion.md.

#include <tests/traversal/instances/instance_scenes.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr float kUnit = 0x1p-24f;

/// An instance that stands where it is, and transforms with another record.
class OneInstance {
 public:
  explicit OneInstance(bool moves) {
    const build::Motion still{.keys = {{.time = 0}, {.time = 1}}};
    scene_.add_file({oracle::icosphere(0)}, NodeLayout::kPlanes);
    scene_.groups.push_back({{.object = 0, .motion = moves ? &still : nullptr}});
    scene_.build();
    view_ = scene_.view();
    record_ = view_.instances[0];
    view_.instances = &record_;
    if (!moves) return;
    motion_ = view_.motions[0];
    motion_.rounding = 2.0f;
    motion_.farthest = 5.0f;
    view_.motions = &motion_;
  }
  InstanceRecord& record() { return record_; }
  PathTransform<1> transform() const {
    InstancePath<1> path;
    path.depth = 1;
    return {view_, path};
  }

 private:
  InstanceScene scene_;
  InstanceRecord record_{};
  MotionRecord motion_{};
  SceneView view_;
};

/// Errors are rounded up.
void check_error(const Bounded& is, float wanted) {
  CHECK(is.error >= kUnit * wanted);
  CHECK(is.error <= kUnit * wanted * (1 + 0x1p-18f));
}

}  // namespace

TEST_CASE("errors of transforms: five roundings into an object, four of a normal out of it") {
  const OneInstance instance(false);
  const PathTransform<1> transform = instance.transform();
  check_error(transform.point_to_object({Vec3(8, 0, 0)}), 5 * 8);
  check_error(transform.vector_to_object({Vec3(0, 8, 0)}), 5 * 8);
  check_error(transform.normal_to_scene({Vec3(0, 0, 8)}), 4 * 8);
  // The way back is computed in double and rounded once.
  check_error(transform.point_to_scene({Vec3(8, 0, 0)}), 8);
  check_error(transform.vector_to_scene({Vec3(0, 8, 0)}), 8);
  check_error(transform.normal_to_object({Vec3(0, 0, 8)}), 8);
}

TEST_CASE("errors of transforms: fourteen and six of a motion") {
  const OneInstance instance(true);
  const PathTransform<1> transform = instance.transform();
  constexpr float kTurn = 14 * 2 * 8, kShift = 6 * 5;
  check_error(transform.point_to_object({Vec3(8, 0, 0)}), 5 * 8 + kTurn + kShift);
  check_error(transform.vector_to_object({Vec3(0, 8, 0)}), 5 * 8 + kTurn);
  check_error(transform.normal_to_scene({Vec3(0, 0, 8)}), 4 * 8 + kTurn);
  check_error(transform.point_to_scene({Vec3(8, 0, 0)}), 8 + kTurn + kShift);
  check_error(transform.vector_to_scene({Vec3(0, 8, 0)}), 8 + kTurn);
  check_error(transform.normal_to_object({Vec3(0, 0, 8)}), 8 + kTurn);
}

TEST_CASE("all roundings of a transform can be halves downwards: four of a point, three of a normal") {
  // Each operation ends in the middle between two floats. The lower one is even.
  constexpr float kOne = 1 + 0x1p-12f;
  constexpr double kSquare = double{kOne} * double{kOne};
  OneInstance instance(false);
  InstanceRecord& record = instance.record();
  for (unsigned k = 0; k < 3; ++k) {
    record.linear[0][k] = record.linear[k][0] = k == 2 ? kOne : kUnit;
    record.translation[k] = k == 2 ? -kUnit : 0.0f;
  }
  const PathTransform<1> transform = instance.transform();
  const Bounded point = transform.point_to_object({Vec3(1, 1, kOne)});
  const double exact = kUnit + kUnit + double{kOne} * (double{kOne} + double{kUnit});
  CHECK(exact - double{point.value.x} >= 4 * double{kUnit});
  CHECK(exact - double{point.value.x} <= double{point.error});
  const Bounded normal = transform.normal_to_scene({Vec3(1, 1, kOne)});
  const double exact_normal = kUnit + kUnit + kSquare;
  CHECK(exact_normal - double{normal.value.x} >= 3 * double{kUnit});
  CHECK(exact_normal - double{normal.value.x} <= double{normal.error});
}
