// Closest points beside Embree's rtcPointQuery, whose function for triangles is the usual test of regions in double.

#include <tests/oracle/embree_scene.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/points/point_queries.h>

#include <tests/catch.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261205;

/// By regions (Ericson, "Real-Time Collision Detection", 2005, 5.1.5).
Vec3D closest_in_regions(const Vec3D& p, const Vec3D& a, const Vec3D& b, const Vec3D& c) {
  const auto dot = [](const Vec3D& u, const Vec3D& v) { return u.x * v.x + u.y * v.y + u.z * v.z; };
  const Vec3D ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
               d6 = dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const double scale = 1 / (va + vb + vc);
  return a + vb * scale * ab + vc * scale * ac;
}

struct Best {
  const Mesh* mesh;
  Vec3D point;
  double squared = std::numeric_limits<double>::infinity();
};

bool on_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& best = *static_cast<Best*>(arguments->userPtr);
  const Corners c = corners(*best.mesh, arguments->primID);
  const Vec3D away = best.point - closest_in_regions(best.point, vec3d(c.p0), vec3d(c.p1), vec3d(c.p2));
  const double squared = away.x * away.x + away.y * away.y + away.z * away.z;
  if (!(squared < best.squared)) return false;
  best.squared = squared;
  arguments->query->radius = std::nextafter(static_cast<float>(std::sqrt(squared)), 1e38f);
  return true;
}

double ask_embree(const EmbreeScene& scene, const Mesh& mesh, const Vec3& point) {
  Best best{&mesh, Vec3D(point)};
  RTCPointQuery query{point.x, point.y, point.z, 0.0f, std::numeric_limits<float>::infinity()};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene.get(), &query, &context, on_triangle, &best);
  return std::sqrt(best.squared);
}

}  // namespace

TEST_CASE("Embree's point queries find the same distances") {
  for (const Mesh& mesh : {icosphere(4), star(4, 6), oracle::soup(3000, 0.1, 4), torus(60, 30, 0.4)}) {
    EmbreeScene embree;
    embree.add(mesh);
    embree.commit();
    const Scene scene = make_scene({mesh});
    Random random(kSeed);
    double worst = 0.0;
    for (unsigned i = 0; i < trials(3000); ++i) {
      const Vec3 point = point_near(mesh, random, 1.0, {});
      const double expected = ask_embree(embree, mesh, point), found = closest_point(scene.traced, point).distance();
      INFO("seed " << kSeed << ", point " << i << ": " << expected << ", found " << found);
      // Embree's boxes are of floats: it may leave out what is nearer by their rounding.
      REQUIRE(std::abs(found - expected) <= 1e-6 * (1.0 + expected));
      worst = std::max(worst, std::abs(found - expected));
    }
    std::printf("beside Embree, seed %llu: distances differ by %.3g at most\n", static_cast<unsigned long long>(kSeed),
                worst);
  }
}
