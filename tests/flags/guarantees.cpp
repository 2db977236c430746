// Checks what GUARANTEES.md states for every compiler setting. Prints one digest of the inputs and one of the hits per
// group of checks; test_flags.sh compares them. Exit status 0 if every check passes.

#include <tests/flags/closed.h>
#include <tests/flags/deforming.h>
#include <tests/flags/moving.h>
#include <tests/flags/points.h>
#include <tests/flags/shapes.h>
#include <tests/flags/spawned.h>

using namespace hiprt;
using namespace hiprt::flags;

namespace {

struct Exact : Policies {
  using Triangle = Reference;
};
struct Array : Policies {
  using Lanes = ArrayLanes;
};

unsigned closed() {
  const Mesh mesh = lattice_mesh(3);
  const build::TriangleMesh views[] = {mesh.view()};
  const auto built = [&](NodeLayout nodes) { return must(build::build(views, {.nodes = nodes})); };
  const build::Bvh planes = built(NodeLayout::kPlanes), half = built(NodeLayout::kHalf),
                   floats = built(NodeLayout::kFloat), quantized = built(NodeLayout::kQuantized);
  const SceneView scene = view_of(planes);
  // One instance, turned by a quarter.
  const std::span<const std::byte> files[] = {planes.buffer.bytes()};
  const build::Instance quarter[] = {{.object = 0, .to_scene = {{{0, -1, 0, 0}, {1, 0, 0, 0}, {0, 0, 1, 0}}}}};
  const build::Bvh turned = must(build::build_instances(files, quarter));
  // And one that is scaled, sheared and moved.
  Random random(kSeed + 18);
  const build::Instance anywhere[] = {{.object = 0, .to_scene = lattice_affine(random, 50)}};
  const build::Bvh sheared = must(build::build_instances(files, anywhere));
  // And one that is nearly flat, whose transform magnifies rounding.
  const build::Instance squeezed[] = {{.object = 0, .to_scene = lattice_affine(random, 2, 0x1p-10f)}};
  const build::Bvh flat = must(build::build_instances(files, squeezed));

  unsigned faults = closed_meshes<Policies>("Watertight", scene, mesh);
  faults += closed_meshes<Array>("ArrayLanes", scene, mesh);
  faults += closed_meshes<WithLayout<FloatLayout>>("float", view_of(floats), mesh);
  faults += closed_meshes<WithLayout<HalfLayout>>("half", view_of(half), mesh);
  faults += closed_meshes<WithLayout<QuantizedLayout>>("quantized", view_of(quantized), mesh);
  faults += closed_meshes<Exact>("Reference", scene, mesh);
  faults += closed_meshes<DoubleRays<>>("double", scene, mesh);
  faults += even_crossings(scene, mesh);
  faults += closed_meshes<Instanced<Policies>>("quarter turn", view_of(turned), mesh);
  faults += closed_meshes<Instanced<Policies>>("instance", view_of(sheared), mesh);
  faults += closed_meshes<Instanced<Policies>>("flat instance", view_of(flat), mesh);

  faults += closest_points<Policies>("planes", scene, mesh);
  faults += closest_points<Array>("ArrayLanes", scene, mesh);
  faults += closest_points<WithLayout<QuantizedLayout>>("quantized", view_of(quantized), mesh);
  faults += closest_points<DoubleRays<>>("double", scene, mesh);
  faults += closest_points<Instanced<Policies>>("instance", view_of(sheared), mesh);

  faults += spawned_rays<Policies>("Watertight", scene, mesh);
  faults += spawned_rays<Exact>("Reference", scene, mesh);
  faults += spawned_rays<DoubleRays<>>("double", scene, mesh);
  faults += spawned_rays<Instanced<Policies>>("instance", view_of(sheared), mesh);
  faults += spawned_rays<Instanced<Policies>>("flat instance", view_of(flat), mesh);
  faults += spawned_rays<Instanced<Exact>>("instance, Reference", view_of(sheared), mesh);
  faults += spawned_rays<Instanced<DoubleRays<>>>("instance, double", view_of(sheared), mesh);
  return faults;
}

unsigned boxes() {
  unsigned faults = boxes_of_meshes("at home", Vec3(0), 1.0f);
  faults += boxes_of_meshes("far away", Vec3(700, -1000, 300), 1.0f);
  faults += boxes_of_meshes("tiny", Vec3(0), 0x1p-60f);
  faults += boxes_of_instances<Instanced<Policies>>("instances");
  faults += boxes_of_instances<Instanced<WithLayout<QuantizedLayout>>>("instances, quantized");
  faults += boxes_of_instances<Instanced<Exact>>("instances, Reference");
  faults += boxes_of_instances<Instanced<DoubleRays<>>>("instances, double");
  return faults;
}

unsigned motion() {
  const Mesh mesh = lattice_mesh(2);
  unsigned faults = bounds_of_motion();
  faults += moving_closed_mesh<Policies>("moving", mesh);
  faults += moving_closed_mesh<Exact>("moving, Reference", mesh);
  faults += moving_closed_mesh<DoubleRays<>>("moving, double", mesh);
  faults += boxes_of_moving_instances<Moving<Instanced<Policies>>>("moving");
  faults += boxes_of_moving_instances<Moving<Instanced<WithLayout<QuantizedLayout>>>>("moving, quantized");
  faults += boxes_of_moving_instances<Moving<Instanced<Exact>>>("moving, Reference");
  faults += boxes_of_moving_instances<Moving<Instanced<DoubleRays<>>>>("moving, double");
  faults += deforming_mesh<Policies>("deforming mesh");
  faults += deforming_mesh<DoubleRays<>>("deforming mesh, double");
  return faults;
}

}  // namespace

int main() {
  const unsigned faults = closed() + boxes() + motion() + shapes();
  return faults == 0 ? 0 : 1;
}
