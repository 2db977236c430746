#include <hiprt_build/instances/instance_fault.h>

#include <hiprt_build/input/check_input.h>
#include <hiprt_build/instances.h>

namespace hiprt::build {

bool is_invertible(const Affine& to_scene) { return make_instance(to_scene.row).fault == TransformFault::kNone; }

std::string describe_fault(TransformFault fault, double determinant, double condition) {
  if (fault == TransformFault::kNotFinite) return "the transform is not finite";
  return "the transform has no inverse that floats can hold: determinant " + text(determinant) +
         (condition != 0.0 ? ", condition " + text(condition) : "");
}

std::string describe_fault(MotionFault fault, std::uint32_t key, double determinant) {
  const std::string here = "key " + std::to_string(key) + ": ";
  switch (fault) {
    case MotionFault::kNone:
      break;
    case MotionFault::kNotFinite:
      return here + "a number is not finite";
    case MotionFault::kNoRotation:
      return here + "the rotation has length 0";
    case MotionFault::kZeroScale:
      return here + "the scale has a 0";
    case MotionFault::kSignChange:
      return here + "the scale changes its sign: at some time the transform has no inverse";
    case MotionFault::kNoInverse:
      return here + "the matrix has no inverse that floats can hold";
    case MotionFault::kBadTime:
      return here + "its time is not finite, not after that of the key before, or too far from it";
    case MotionFault::kSingular:
      return "between keys " + std::to_string(key) + " and " + std::to_string(key + 1) +
             " the transform has no inverse that floats can hold: determinant " + text(determinant);
    case MotionFault::kBadKeys:
      return "its keys are not all there";
    case MotionFault::kHidden:
      return "all keys hide the instance: leave it out";
  }
  return {};
}

std::string describe_condition(double condition) {
  return "the transforms on the way to a primitive have a condition of " + text(condition) +
         " together, the limit is " + text(double{kMaxCondition});
}

}  // namespace hiprt::build
