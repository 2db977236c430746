#pragma once
/// Messages about invalid transforms. Internal.

#include <hiprt_build/instances/make_instance.h>

#include <string>

namespace hiprt::build {

/// @return the message for the fault of one transform; the parameters are results of make_instance().
/// @param fault not kNone.
std::string describe_fault(TransformFault fault, double determinant, double condition);
/// @return the message for a motion's fault. @param key of the fault. @param determinant of kSingular.
std::string describe_fault(MotionFault fault, std::uint32_t key, double determinant);
/// @return the message for the condition of all transforms on the path to a primitive, together.
std::string describe_condition(double condition);

}  // namespace hiprt::build
