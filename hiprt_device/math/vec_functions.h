#pragma once
/// GLM's geometric functions (glm::dot, glm::cross, glm::length, glm::normalize, ...) for hiprt::Vec3 on host and
/// device. hiprt_device itself does not need them. Not for run-time compilers.

#include <hiprt_device/math/vec.h>

#if defined(__CUDACC__) && !defined(__clang__)
#pragma nv_diagnostic push
#pragma nv_diag_suppress 20012
#endif
#if defined(__clang__) && defined(__HIP__)
#pragma clang force_cuda_host_device begin
#endif
#include <glm/geometric.hpp>
#if defined(__clang__) && defined(__HIP__)
#pragma clang force_cuda_host_device end
#endif
#if defined(__CUDACC__) && !defined(__clang__)
#pragma nv_diagnostic pop
#endif
