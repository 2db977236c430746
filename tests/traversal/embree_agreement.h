#pragma once
/// Our default tracer against Embree 3.13 in robust mode on one mesh. Where the two differ, the exact oracle must
/// confirm ours.

#include <tests/oracle/random.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/scenes.h>

#include <functional>
#include <string>

namespace hiprt::checks {

void print_agreement_header();

/// Closest and any hits of @p rays random rays; prints a row of counts. Checks (Catch2) that the oracle can explain
/// every hit of ours that differs from Embree's. All other hits must lie on the triangle that they name.
void check_agreement(const std::string& name, const Mesh& mesh, const std::function<Ray(Random&)>& random_ray,
                     unsigned rays, std::uint64_t seed);

}  // namespace hiprt::checks
