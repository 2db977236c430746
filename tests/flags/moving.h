#pragma once
/// Instances that move and turn: closed meshes do not leak, boxes hide no hit, hits lie within their instances' boxes,
/// and nothing leaves its bounds.

#include <hiprt_build/format/instance_bounds.h>
#include <tests/flags/boxes.h>
#include <tests/flags/closed.h>
#include <tests/flags/spawned.h>
#include <tests/oracle/textbook_motion.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <span>
#include <string>

namespace hiprt::flags {

inline constexpr MotionKind kMotionKinds[] = {MotionKind::kSlerp, MotionKind::kNlerp, MotionKind::kMatrix};

inline const char* name_of(MotionKind kind) {
  return kind == MotionKind::kSlerp ? "slerp" : kind == MotionKind::kNlerp ? "nlerp" : "matrix";
}

/// A scene of instances and its parts.
struct MovingScene {
  build::Bvh object, whole;
  std::deque<build::Motion> motions;  ///< Instances point at them.
  SceneView view;

  /// Instances have the smallest boxes that there are.
  void make(const Mesh& mesh, NodeLayout layout, std::span<const std::span<const build::Instance>> groups) {
    const build::TriangleMesh views[] = {mesh.view()};
    object = must(build::build(views, {.nodes = layout, .max_leaf_triangles = 1, .pair_triangles = false}));
    const std::span<const std::byte> files[] = {object.buffer.bytes()};
    whole = must(
        build::build_instances(build::InstancedScene{files, groups}, {.bounds = build::InstanceBounds::kPrimitives}));
    view = view_of(whole);
  }
};

/// A closed mesh in one instance that moves and turns, directly and below an instance that does not move. Rays from
/// inside do not leak, and spawned rays do not hit the triangle that they leave. @tparam P policies for the mesh alone.
template <class P> unsigned moving_closed_mesh(const std::string& name, const Mesh& mesh) {
  Random random(kSeed + 8);
  unsigned faults = 0;
  for (const MotionKind kind : kMotionKinds) {
    const std::string called = name + ", " + name_of(kind);
    MovingScene direct, nested;
    direct.motions.push_back(lattice_motion(random, kind, 3, 4));
    nested.motions.push_back(lattice_motion(random, kind, 3, 1000));
    const build::Instance outer[] = {{.object = 0, .motion = &direct.motions[0]}};
    const build::Instance within[] = {{.object = 0, .to_scene = lattice_affine(random, 2)}};
    const build::Instance around[] = {{.object = 1, .motion = &nested.motions[0]}};
    const std::span<const build::Instance> one[] = {outer}, two[] = {within, around};
    direct.make(mesh, P::Layout::kId, one);
    nested.make(mesh, P::Layout::kId, two);
    faults += closed_meshes<Moving<Instanced<P>>>(called, direct.view, mesh, 3000);
    faults += closed_meshes<Moving<Instanced<P, 2>>>(called + ", two levels", nested.view, mesh, 3000);
    faults += spawned_rays<Moving<Instanced<P>>>(called, direct.view, mesh, 1500);
    faults += spawned_rays<Moving<Instanced<P, 2>>>(called + ", two levels", nested.view, mesh, 1500);
  }
  return faults;
}

/// The point of a hit lies within the bounds of its instance and of the scene, up to the hit's error.
template <class Real>
void expect_within_bounds(Check& check, const SceneView& scene, const Box& of_instance, const BasicRay<Real>& ray,
                          const BasicPathHit<Real, 1>& hit) {
  const auto at = exact_point(ray, hit.t);
  const long double error = hit.error;
  for (unsigned axis = 0; axis < 3; ++axis)
    for (const Box& of : {of_instance, scene.bounds}) {
      const long double low = of.min[axis], high = of.max[axis];
      check.expect(at[axis] >= low - error && at[axis] <= high + error,
                   "a hit on instance %u, t %a, at %La on axis %u: outside of [%La, %La] by more than its error %a",
                   hit.path.instance[0], double{hit.t}, at[axis], axis, low, high, double{hit.error});
    }
}

/// The point of a hit is at most the hit's error from the textbook's plane of the triangle.
template <class Real>
void expect_on_triangle(Check& check, const build::Motion& motion, const Mesh& mesh, const BasicRay<Real>& ray,
                        const BasicPathHit<Real, 1>& hit) {
  Vec3D corner[3];
  for (unsigned c = 0; c < 3; ++c) {
    const build::Position& p = mesh.positions[mesh.triangles[hit.primitive][c]];
    const textbook::Real3 there = textbook::moved(motion, ray.time, {p[0], p[1], p[2]});
    corner[c] = Vec3D(there[0], there[1], there[2]);
  }
  const double off = distance_from_plane(exact_point(ray, hit.t), corner);
  check.expect(off <= double{hit.error},
               "a hit on instance %u, t %a: %a from where the textbook has triangle %u, more than its error %a",
               hit.path.instance[0], double{hit.t}, off, hit.primitive, double{hit.error});
}

/// Instances of a mesh that move, turn and cross each other. Trees hide no hit. A hit lies within the bounds of its
/// instance, and at most its error from the triangle's textbook position.
template <class P> unsigned boxes_of_moving_instances(const std::string& name) {
  constexpr std::uint32_t kInstances = 24;
  const Mesh mesh = lattice_soup(3);
  Random random(kSeed + 9);
  MovingScene scene;
  build::Instance instances[kInstances];
  for (std::uint32_t i = 0; i < kInstances; ++i) {
    scene.motions.push_back(lattice_motion(random, kMotionKinds[i % 3], 2 + i % 4, 2));
    instances[i].motion = &scene.motions.back();
  }
  const std::span<const build::Instance> groups[] = {instances};
  scene.make(mesh, P::Layout::kId, groups);
  const auto trials = trials_of_instances<P>(scene.view, mesh, kInstances, 400);
  const unsigned faults = expect_trials<P, false>(name, scene.view, trials);

  Check check(name + ": hits are where they belong", kSeed + 9);
  const auto file = open_buffer(scene.whole.buffer.bytes());
  for (const auto& ray : trials.rays) {
    check.on_ray(ray);
    const auto hit = closest<P>(scene.view, ray);
    check.on_hit(hit);
    if (!hit.found()) continue;
    const std::uint32_t instance = hit.path.instance[0];
    const Box box = format_detail::InstanceMotionBounds(*file, instance).bounds(scene.view.objects[0].bounds);
    expect_within_bounds(check, scene.view, box, ray, hit);
    const build::Motion& motion = scene.motions[instance];
    if (!has_half_turn(motion)) expect_on_triangle(check, motion, mesh, ray, hit);
  }
  return faults + check.finish(100);
}

/// Bounds of an instance, and whose they are.
struct Bounds {
  const char* by;
  Box box;
};

/// The textbook position of a vertex at a time: at_time() agrees within the recorded error. Bounds contain the
/// position, up to the rounding of the record's floats.
inline void expect_as_textbook(Check& check, unsigned number, const MotionRecord& record, const InstanceRecord& placed,
                               const textbook::Real3& there, const Vec3D& where, std::span<const Bounds> all_bounds) {
  long double from = 0, miss = 0, size = 4;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const long double origin = placed.translation[axis], x = where[static_cast<int>(axis)];
    from += (there[axis] - origin) * (there[axis] - origin);
    miss += (there[axis] - x) * (there[axis] - x);
    size += std::fabs(there[axis]);
  }
  const auto off = static_cast<double>(std::sqrt(miss));
  const double allowed =
      0x1p-24 * (14.0 * double{record.rounding} * static_cast<double>(std::sqrt(from)) + 6.0 * double{record.farthest});
  check.expect(off <= allowed, "motion %u: a vertex is %a from where the textbook has it, %a are allowed", number, off,
               allowed);
  const long double slack = 0x1p-21L * size;
  for (unsigned axis = 0; axis < 3; ++axis)
    for (const Bounds& of : all_bounds) {
      const long double low = of.box.min[axis], high = of.box.max[axis];
      check.expect(low - slack <= there[axis] && there[axis] <= high + slack,
                   "motion %u: the textbook has a vertex at %La on axis %u, outside of the bounds [%La, %La] by %s",
                   number, there[axis], axis, low, high, of.by);
    }
}

/// At all times a vertex is within two bounds of the instance: the library's, and the bounds that this program computes
/// with its own compiler settings. For positions computed from the record this holds exactly.
inline void expect_held(Check& check, unsigned number, const MovingScene& scene, const Mesh& mesh) {
  const SceneView& view = scene.view;
  const auto file = open_buffer(scene.whole.buffer.bytes()), object = open_buffer(scene.object.buffer.bytes());
  const MotionRecord& record = view.motions[0];
  const format_detail::InstanceMotionBounds to_scene(*file, 0);
  format_detail::InstanceBounder<PlanesLayout> bounder(format_detail::BoundedObject(*object), to_scene);
  const Bounds all_bounds[] = {{"the library", view.bounds},
                               {"this program", bounder.bounds(object->header->root, bounder.kToPrimitives)}};
  const bool has_judge = !has_half_turn(scene.motions[0]);
  for (std::uint32_t k = 0; k < record.count; ++k) {
    const MotionSegment& segment = file->motion_of(0)[k];
    const SegmentMotion by_record(segment, record.kind);
    for (unsigned step = 0; step <= 32; ++step) {
      // Times between lattice times, exactly.
      const auto s = static_cast<float>(step) / 32.0f;
      const float time = segment.time[0] + s * (segment.time[1] - segment.time[0]);
      check.on_time(time);
      const InstanceRecord placed = at_time(view.instances[0], record, view.base, time);
      for (const build::Position& p : mesh.positions) {
        const double point[3] = {p[0], p[1], p[2]};
        const Vec3D where = point_to_scene(placed, Vec3D(p[0], p[1], p[2]));
        check.put_out(where);
        for (unsigned axis = 0; axis < 3; ++axis) {
          const double x = by_record.curve(axis, point).at(double{s}).value;
          for (const Bounds& of : all_bounds)
            check.expect(double{of.box.min[axis]} <= x && x <= double{of.box.max[axis]},
                         "motion %u: a vertex is at %a on axis %u, outside of the bounds [%a, %a] by %s", number, x,
                         axis, double{of.box.min[axis]}, double{of.box.max[axis]}, of.by);
        }
        if (!has_judge) continue;
        const textbook::Real3 there = textbook::moved(scene.motions[0], time, {p[0], p[1], p[2]});
        expect_as_textbook(check, number, record, placed, there, where, all_bounds);
      }
    }
  }
}

/// Bounds of motions of every kind, one of them with a turn by 180 degrees.
inline unsigned bounds_of_motion() {
  const Mesh mesh = lattice_mesh(0);
  Random random(kSeed + 10);
  unsigned faults = 0;
  for (const MotionKind kind : kMotionKinds) {
    Check check(std::string("bounds of motion, ") + name_of(kind), kSeed + 10);
    for (unsigned i = 0; i < 12; ++i) {
      MovingScene scene;
      scene.motions.push_back(lattice_motion(random, kind, 2 + i % 3, i == 0 ? 1000 : 2));
      auto& keys = scene.motions[0].keys;
      if (i == 1 && kind != MotionKind::kMatrix) {
        const build::MotionKey still, half_a_turn{.rotation = {2, -1, 3, 0}};
        std::copy_n(still.rotation, 4, keys[0].rotation);
        std::copy_n(half_a_turn.rotation, 4, keys[1].rotation);
      }
      for (const build::MotionKey& key : keys)
        for (const float x : key.rotation) check.put_in(x);
      const build::Instance instance[] = {{.object = 0, .motion = &scene.motions[0]}};
      const std::span<const build::Instance> groups[] = {instance};
      scene.make(mesh, NodeLayout::kPlanes, groups);
      expect_held(check, i, scene, mesh);
    }
    faults += check.finish();
  }
  return faults;
}

}  // namespace hiprt::flags
