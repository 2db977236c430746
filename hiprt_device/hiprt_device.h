#pragma once
/// Everything that a kernel needs: scenes, rays, hits, policies, stacks, filters, custom primitives and queries.
///
/// docs/README.md leads to the guide. The library's own custom primitives have headers of their own (primitives/).

#include <hiprt_device/filter.h>
#include <hiprt_device/instances/path_transform.h>
#include <hiprt_device/instances/placed_object.h>
#include <hiprt_device/intersect/exact_triangle_test.h>
#include <hiprt_device/primitives/primitive_table.h>
#include <hiprt_device/query/batch.h>
#include <hiprt_device/query/double_rays.h>
#include <hiprt_device/query/inside.h>
#include <hiprt_device/query/overlaps.h>
#include <hiprt_device/query/query.h>
#include <hiprt_device/query/spawn.h>
#include <hiprt_device/query/t_error.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>
#include <hiprt_device/traverse/hardware_policies.h>
#include <hiprt_device/traverse/stacks/private.h>
#include <hiprt_device/traverse/stacks/restart.h>
#include <hiprt_device/traverse/stacks/rolling.h>
#include <hiprt_device/traverse/stacks/shared.h>
#include <hiprt_device/traverse/stacks/spill.h>
#include <hiprt_device/traverse/stacks/tiered.h>
#include <hiprt_device/version.h>
