#pragma once
/// Everything a kernel needs: scenes, rays, hits, policies and queries.

#include <hiprt_device/query.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>
#include <hiprt_device/spawn.h>
