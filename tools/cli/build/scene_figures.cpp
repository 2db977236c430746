#include <tools/cli/build/scene_figures.h>

#include <hiprt_build/format/view.h>
#include <hiprt_device/format/node.h>

#include <nlohmann/json.hpp>

#include <span>
#include <string>

namespace hiprt::tools {
namespace {

Count sum(Count a, Count b) {
  std::uint64_t result = 0;
  if (!a || !b || __builtin_add_overflow(*a, *b, &result)) return std::nullopt;
  return result;
}

/// Calls visit(object) for every instance in a leaf, opened ones once: the format promises nothing of others.
template <class Visit> void for_each_instance(const BufferView& view, Visit&& visit) {
  for (std::size_t i = 0; i < view.instances.size(); ++i)
    if (view.primitive_map[i] != kInvalidId) visit(std::size_t{view.instances[i].object});
}

/// What an object has, with all that is below it.
struct Content {
  Count instances = 0, triangles = 0, customs = 0;  ///< Instances of objects that are no groups.

  void add(const Content& other) {
    instances = sum(instances, other.instances);
    triangles = sum(triangles, other.triangles);
    customs = sum(customs, other.customs);
  }
};

Content content_of_group(const BufferView& group, std::span<const Content> objects) {
  Content result;
  for_each_instance(group, [&](std::size_t object) { result.add(objects[object]); });
  return result;
}

/// One level after the other, until there are no groups in it.
std::vector<SceneLevel> levels_of(const BufferView& scene, std::span<const BufferView> objects) {
  std::vector<SceneLevel> levels;
  std::vector<Count> path_counts(objects.size(), 0);
  for_each_instance(scene, [&](std::size_t object) { path_counts[object] = sum(path_counts[object], 1); });
  for (bool more = true; more;) {
    SceneLevel level;
    std::vector<Count> next(objects.size(), 0);
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (path_counts[i] == Count(0)) continue;
      level.instances = sum(level.instances, path_counts[i]);
      ++(objects[i].has_instances() ? level.groups : level.objects);
      if (!objects[i].has_instances()) continue;
      for_each_instance(objects[i], [&](std::size_t object) { next[object] = sum(next[object], path_counts[i]); });
    }
    if (level.instances != Count(0)) levels.push_back(level);
    more = level.groups != 0;
    path_counts.swap(next);
  }
  return levels;
}

std::string text(Count count) { return count ? std::to_string(*count) : "more than 18446744073709551615"; }

std::string both(Count all, std::uint64_t unique) {
  return text(all) + " in instances, " + std::to_string(unique) + " in objects";
}

nlohmann::json json_of(Count count) { return count ? nlohmann::json(*count) : nlohmann::json(); }

}  // namespace

SceneFigures measure_scene(const BufferView& scene) {
  SceneFigures figures;
  std::vector<BufferView> objects;
  std::vector<Content> contents;
  const auto add_group = [&](const BufferView& group) {
    figures.instances += group.instances.size();
    figures.dropped_instances += group.geometries[0].dropped_count;
    figures.opened_parts += group.leaves.count + group.geometries[0].dropped_count - group.instances.size();
    for (const MotionRecord& motion : group.motions) figures.moving_instances += motion.count != 0 ? 1 : 0;
    figures.motion_segments += group.segments.size();
    figures.motion_bytes += group.motions.size_bytes() + group.segments.size_bytes();
    contents.push_back(content_of_group(group, contents));
  };
  for (const ObjectRecord& record : scene.objects) {
    const BufferView& object = objects.emplace_back(*open_buffer(scene.object_file(record)));
    if (object.has_instances()) {
      ++figures.groups;
      figures.group_bytes += record.size;
      add_group(object);
      continue;
    }
    ++figures.objects;
    figures.object_bytes += record.size;
    const std::uint64_t triangles = count_triangles(object), customs = count_customs(object);
    figures.triangles += triangles;
    figures.customs += customs;
    for (std::size_t i = 0; i < object.shapes.size(); ++i) {
      const std::uint64_t count = object.geometries[i].primitive_count;
      if (object.shapes[i].kind == ShapeKind::kSpheres) figures.spheres += count;
      if (object.shapes[i].kind == ShapeKind::kCurves) figures.curve_segments += count;
      if (object.shapes[i].kind == ShapeKind::kMovingTriangles) figures.moving_triangles += count;
    }
    contents.push_back({1, triangles, customs});
  }
  add_group(scene);
  figures.all_instances = contents.back().instances;
  figures.all_triangles = contents.back().triangles;
  figures.all_customs = contents.back().customs;
  figures.top_bytes = scene.bytes.size() - figures.group_bytes - figures.object_bytes;
  figures.levels = levels_of(scene, objects);
  return figures;
}

void add_scene(Table& table, const SceneFigures& figures) {
  table.row("objects", std::to_string(figures.objects));
  table.row("groups", std::to_string(figures.groups) + " with the scene");
  table.row("instances of objects", text(figures.all_instances));
  table.row("instance records",
            std::to_string(figures.instances) + ", " + std::to_string(figures.dropped_instances) + " dropped");
  if (figures.opened_parts != 0)
    table.row("leaves of opened instances", std::to_string(figures.opened_parts) + " more");
  if (figures.moving_instances != 0)
    table.row("moving instances", std::to_string(figures.moving_instances) + ", " +
                                      std::to_string(figures.motion_segments) + " segments between their keys");
  table.row("triangles", both(figures.all_triangles, figures.triangles));
  if (figures.customs != 0) table.row("custom primitives", both(figures.all_customs, figures.customs));
  for (const auto& [count, name] : {std::pair{figures.spheres, "spheres"},
                                    {figures.curve_segments, "segments of curves"},
                                    {figures.moving_triangles, "moving triangles"}})
    if (count != 0) table.row(name, std::to_string(count) + " in objects, of the custom primitives");
  table.row("levels", std::to_string(figures.levels.size()));
  for (std::size_t i = 0; i < figures.levels.size(); ++i) {
    const SceneLevel& level = figures.levels[i];
    table.row("level " + std::to_string(i + 1), text(level.instances) + " instances of " +
                                                    std::to_string(level.groups) + " groups and " +
                                                    std::to_string(level.objects) + " objects");
  }
  table.row("bytes of the top tree", bytes_text(figures.top_bytes));
  table.row("bytes of groups' trees", bytes_text(figures.group_bytes));
  table.row("bytes of objects", bytes_text(figures.object_bytes));
  if (figures.moving_instances != 0) table.row("bytes of motions", bytes_text(figures.motion_bytes));
}

nlohmann::json scene_json(const SceneFigures& figures) {
  nlohmann::json levels = nlohmann::json::array();
  for (const SceneLevel& level : figures.levels)
    levels.push_back({{"instances", json_of(level.instances)}, {"groups", level.groups}, {"objects", level.objects}});
  return {{"objects", figures.objects},
          {"groups", figures.groups},
          {"instances",
           {{"records", figures.instances},
            {"dropped", figures.dropped_instances},
            {"opened", figures.opened_parts},
            {"moving", figures.moving_instances},
            {"motion_segments", figures.motion_segments},
            {"of_objects", json_of(figures.all_instances)}}},
          {"triangles", {{"unique", figures.triangles}, {"instantiated", json_of(figures.all_triangles)}}},
          {"customs", {{"unique", figures.customs}, {"instantiated", json_of(figures.all_customs)}}},
          {"shapes",
           {{"spheres", figures.spheres},
            {"curve_segments", figures.curve_segments},
            {"moving_triangles", figures.moving_triangles}}},
          {"levels", std::move(levels)},
          {"bytes",
           {{"top", figures.top_bytes},
            {"groups", figures.group_bytes},
            {"objects", figures.object_bytes},
            {"motions", figures.motion_bytes}}}};
}

}  // namespace hiprt::tools
