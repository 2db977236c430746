#pragma once
/// Triangle tests. A test policy prepares a ray once and reports candidates: t, u and v of the triangles of a leaf that
/// the ray's line meets. The query then compares t with [tmin, tmax].

#include <hiprt_device/intersect/candidate.h>
#include <hiprt_device/intersect/fast_triangle_test.h>
#include <hiprt_device/intersect/watertight.h>
