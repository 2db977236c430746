// Difficult meshes against Embree 3.13 in robust mode.

#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/embree_agreement.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 5;

struct Case {
  std::string name;
  Mesh mesh;
};

std::vector<Case> cases() {
  std::vector<Case> result;
  for (Closed& closed : closed_meshes()) result.push_back({closed.name, std::move(closed.mesh)});
  result.push_back({"soup", soup(20000, 0.05, 2)});
  result.push_back({"needles 1e6", needles(2000, 1e6, 3)});
  result.push_back({"plane", grid_plane(40, 1, 0.3f)});
  return result;
}

Ray random_ray(const Mesh& mesh, Random& random) {
  Ray ray;
  ray.origin = vec3(random.in_cube(1.5));
  const Position to = random.below(3) == 0 ? random.in_cube(1) : rounded(target_point(mesh, random));
  ray.direction = vec3(to) - ray.origin;
  return ray;
}

}  // namespace

TEST_CASE("Embree's robust mode agrees, or the exact oracle decides for us", "[embree]") {
  print_agreement_header();
  for (const Case& test : cases())
    check_agreement(
        test.name, test.mesh, [&](Random& random) { return random_ray(test.mesh, random); }, trials(60000), kSeed);
}
