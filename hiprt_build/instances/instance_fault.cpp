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

std::string describe_condition(double condition) {
  return "the transforms on the way to a primitive have a condition of " + text(condition) +
         " together, the limit is " + text(double{kMaxCondition});
}

}  // namespace hiprt::build
