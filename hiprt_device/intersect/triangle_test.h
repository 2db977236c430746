#pragma once
/// Triangle tests.
///
/// A test policy prepares a ray once. It then reports candidates: t, u and v of a leaf's triangles that the ray's line
/// meets. The query compares t with [tmin, tmax].

#include <hiprt_device/intersect/candidate.h>
#include <hiprt_device/intersect/fast_triangle_test.h>
#include <hiprt_device/intersect/watertight.h>
