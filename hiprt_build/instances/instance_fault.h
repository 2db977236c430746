#pragma once
/// What is said of transforms that cannot be. Internal.

#include <hiprt_build/instances/make_instance.h>

#include <string>

namespace hiprt::build {

/// Of one, as make_instance() says it. @param fault not kNone.
std::string describe_fault(TransformFault fault, double determinant, double condition);
/// Of all on the way to a primitive, together.
std::string describe_condition(double condition);

}  // namespace hiprt::build
