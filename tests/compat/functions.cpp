// The dispatchers that a program defines: they call the functions in its payload.

#include <tests/compat/program.h>

bool intersectFunc(std::uint32_t geomType, std::uint32_t rayType, const hiprtFuncTableHeader& tableHeader,
                   const hiprtRay& ray, void* payload, hiprtHit& hit) {
  return static_cast<const hiprt::test::Program*>(payload)->intersect({geomType, rayType, tableHeader, ray}, hit);
}

bool filterFunc(std::uint32_t geomType, std::uint32_t rayType, const hiprtFuncTableHeader& tableHeader,
                const hiprtRay& ray, void* payload, const hiprtHit& hit) {
  return static_cast<const hiprt::test::Program*>(payload)->filter({geomType, rayType, tableHeader, ray}, hit);
}
