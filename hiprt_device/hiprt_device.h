#pragma once
/// Everything a kernel needs: scenes, rays, hits, policies, stacks, filters, custom primitives and queries. By example:
/// docs/API.md. The library's own custom primitives have headers of their own (primitives/), as a program's have.

#include <hiprt_device/amd_ray_test.h>
#include <hiprt_device/batch.h>
#include <hiprt_device/double_rays.h>
#include <hiprt_device/exact_triangle_test.h>
#include <hiprt_device/filter.h>
#include <hiprt_device/path_transform.h>
#include <hiprt_device/placed_object.h>
#include <hiprt_device/primitive_table.h>
#include <hiprt_device/query.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>
#include <hiprt_device/spawn.h>
#include <hiprt_device/stacks/private.h>
#include <hiprt_device/stacks/restart.h>
#include <hiprt_device/stacks/rolling.h>
#include <hiprt_device/stacks/shared.h>
#include <hiprt_device/stacks/spill.h>
#include <hiprt_device/stacks/tiered.h>
#include <hiprt_device/t_error.h>
