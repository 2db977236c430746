#include <tools/cli/info/bvh_dump.h>
#include <tools/cli/trace/explain.h>

#include <hiprt_build/format/view.h>
#include <hiprt_device/format/layout.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <utility>

namespace hiprt::tools {
namespace {

using nlohmann::json;
using Kind = TraceStep::Kind;

/// JSON has no infinity and no NaN.
json number(float value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : value > 0.0f ? "inf" : "-inf";
}

json point(const Vec3& p) { return {number(p.x), number(p.y), number(p.z)}; }

json ray_json(const Ray& ray) {
  return {{"origin", point(ray.origin)}, {"direction", point(ray.direction)}, {"tmin", number(ray.tmin)},
          {"tmax", number(ray.tmax)},    {"time", number(ray.time)},          {"mask", ray.mask}};
}

/// Describes the steps of a tracer in JSON.
class Teller {
 public:
  Teller(const BufferView& file, const Ray& ray) : file_(file), ray_(ray), best_(ray.tmax) {
    files_.emplace(file.bytes.data(), std::pair(file, kInvalidId));
    for (std::uint32_t i = 0; i < file.objects.size(); ++i) {
      const BufferView object = *open_buffer(file.object_file(file.objects[i]));
      files_.emplace(object.bytes.data(), std::pair(object, i));
    }
  }

  json tell(std::span<const TraceStep> steps) {
    json result = json::array();
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const TraceStep& step = steps[i];
      if (step.kind == Kind::kNode) result.push_back(node(step.visit));
      if (step.kind == Kind::kExit) result.push_back(exit());
      if (step.kind != Kind::kLeaf) continue;
      std::size_t end = i + 1;
      while (end < steps.size() && steps[end].kind == Kind::kCandidate) ++end;
      const bool enters = end < steps.size() && steps[end].kind == Kind::kEnter;
      result.push_back(leaf(step.visit, steps.subspan(i + 1, end - i - 1), enters));
    }
    return result;
  }

  /// The number of children whose boxes the ray meets, but which it does not visit.
  std::uint64_t unvisited() const { return static_cast<std::uint64_t>(met_) - visited_; }

 private:
  const BufferView& file_of(const std::byte* base) const { return files_.at(base).first; }

  /// Begins the description of a step: its level, and its object unless it is in the scene's own tree.
  json begin(const std::byte* base) const {
    const std::uint32_t object = files_.at(base).second;
    json step{{"level", path_.size()}};
    if (object != kInvalidId) step["object"] = object;
    return step;
  }

  void come_to(NodeRef ref) {
    // The other leaves of a run, and the node at which a ray enters an object, are not children.
    if (ref == next_ || entered_ == ref) {
      entered_ = kInvalidRef;
      return;
    }
    ++visited_;
  }

  json node(const NodeVisit& visit) {
    const BufferView& view = file_of(visit.base);
    come_to(visit.node);
    json step = begin(visit.base);
    step.update(target_json(view, visit.node));
    json children = json::array();
    dispatch_layout(view.layout(), [&](auto layout) {
      const auto& record =
          *reinterpret_cast<const typename decltype(layout)::Node*>(visit.base + ref_offset(visit.node));
      for (unsigned i = 0; i < kBranching; ++i) {
        if (record.child[i] == kInvalidRef) continue;
        json child = target_json(view, record.child[i]);
        if (visit.met[i])
          child["t"] = number(visit.enter[i]);
        else
          child["missed"] = true;
        met_ += visit.met[i] ? 1 : 0;
        children.push_back(std::move(child));
      }
    });
    step["children"] = std::move(children);
    return step;
  }

  json leaf(const NodeVisit& visit, std::span<const TraceStep> candidates, bool enters) {
    const BufferView& view = file_of(visit.base);
    come_to(visit.node);
    const LeafInfo& info = reinterpret_cast<const CustomLeaf*>(visit.base + ref_offset(visit.node))->info;
    json step = begin(visit.base);
    step.update(target_json(view, visit.node));
    if (view.has_instances()) return instance(view, info, enters, std::move(step));
    next_ = (info.geometry_and_flags & kLastInRun) != 0 ? kInvalidRef
                                                        : visit.node + make_ref(kNodeGranularity, NodeType::kTriangle0);
    const std::uint32_t geometry = info.geometry_and_flags & kGeometryMask;
    step["geometry"] = geometry;
    json primitives = json::array();
    for (unsigned slot = 0; slot < 2; ++slot) {
      if (info.primitive[slot] == kInvalidId) continue;
      json primitive{{"primitive", info.primitive[slot]}, {"verdict", "not met"}};
      for (const TraceStep& candidate : candidates)
        // A ray may cross a sphere or curve several times; the crossing that is the closest so far counts.
        if (candidate.number == slot && primitive["verdict"] != "closest so far") {
          primitive["t"] = number(candidate.t);
          primitive["verdict"] = verdict(view.geometries[geometry], candidate.t);
        }
      primitives.push_back(std::move(primitive));
    }
    step["primitives"] = std::move(primitives);
    return step;
  }

  const char* verdict(const GeometryRecord& geometry, float t) {
    if (!(t >= std::max(ray_.tmin, 0.0f) && t <= ray_.tmax)) return "outside the ray's range";
    if ((geometry.mask & ray_.mask) == 0) return "of a geometry that the ray does not see";
    if (t > best_) return "behind the closest so far";
    best_ = t;
    return "closest so far";
  }

  json instance(const BufferView& view, const LeafInfo& info, bool enters, json step) {
    const InstanceRecord& record = view.instances[info.primitive[0]];
    step["instance"] = info.primitive[0];
    step["of"] = record.object;
    step["id"] = record.id;
    step["verdict"] = enters                           ? "entered"
                      : (record.mask & ray_.mask) == 0 ? "not seen: the masks have no bit in common"
                                                       : "not entered: outside its box, or the ray has no direction "
                                                         "there";
    if (!enters) return step;
    path_.push_back(info.primitive[0]);
    entered_ = entered_ref(info);
    const BufferView& object = file_of(file_.bytes.data() + file_.objects[record.object].offset);
    step["at"] = target_json(object, entered_);
    return step;
  }

  json exit() {
    const std::uint32_t left = path_.back();
    path_.pop_back();
    return {{"level", path_.size()}, {"left", left}};
  }

  const BufferView& file_;
  const Ray& ray_;
  float best_;
  std::map<const std::byte*, std::pair<BufferView, std::uint32_t>> files_;
  std::vector<std::uint32_t> path_;
  NodeRef next_ = kInvalidRef;     ///< The leaf after the last one in its run.
  NodeRef entered_ = kInvalidRef;  ///< The node at which the ray enters an object, until the ray visits it.
  std::uint64_t met_ = 1, visited_ = 0;
};

json hit_json(const Hit& hit) {
  if (!hit.found()) return nullptr;
  return {{"t", hit.t},
          {"u", hit.u},
          {"v", hit.v},
          {"geometry", hit.geometry},
          {"primitive", hit.primitive},
          {"normal", point(hit.normal)},
          {"error", number(hit.error)}};
}

/// A number with enough digits to distinguish all floats.
std::string text(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_number_float()) return value.dump();
  std::array<char, 32> digits{};
  std::snprintf(digits.data(), digits.size(), "%.9g", value.get<double>());
  return digits.data();
}

std::string point_text(const json& p) { return "(" + text(p[0]) + " " + text(p[1]) + " " + text(p[2]) + ")"; }

/// "node 3" or "leaf 7".
std::string target_text(const json& target) {
  const char* const kind = target.contains("node") ? "node" : "leaf";
  return std::string(kind) + " " + text(target[kind]);
}

std::string object_text(const json& step) {
  return step.contains("object") ? " of object " + text(step["object"]) : std::string();
}

std::string children_text(const json& children) {
  std::string met, missed;
  std::vector<const json*> by_distance;
  for (const json& child : children) {
    if (child.contains("t"))
      by_distance.push_back(&child);
    else
      missed += (missed.empty() ? "" : ", ") + target_text(child);
  }
  std::stable_sort(by_distance.begin(), by_distance.end(), [](const json* a, const json* b) {
    return (*a)["t"].is_number() && (*b)["t"].is_number() && (*a)["t"].get<double>() < (*b)["t"].get<double>();
  });
  for (const json* child : by_distance)
    met += (met.empty() ? "" : ", ") + target_text(*child) + " at " + text((*child)["t"]);
  if (met.empty()) met = "no child met";
  return missed.empty() ? met : met + "; misses " + missed;
}

std::string step_text(const json& step) {
  if (step.contains("left")) return "out of instance " + text(step["left"]);
  const std::string name = target_text(step) + object_text(step) + ": ";
  if (step.contains("children")) return name + children_text(step["children"]);
  if (step.contains("instance")) {
    const std::string instance =
        "instance " + text(step["instance"]) + " (id " + text(step["id"]) + ") of object " + text(step["of"]) + " ";
    const std::string verdict = step["verdict"].get<std::string>();
    return name + instance + (step.contains("at") ? verdict + " at " + target_text(step["at"]) : verdict);
  }
  std::string primitives;
  for (const json& primitive : step["primitives"]) {
    primitives += (primitives.empty() ? "" : ", ") + text(primitive["primitive"]) + " ";
    if (primitive.contains("t")) primitives += "at t = " + text(primitive["t"]) + ", ";
    primitives += primitive["verdict"].get<std::string>();
  }
  return name + "geometry " + text(step["geometry"]) + ", primitive " + primitives;
}

std::string hit_text(const json& explanation) {
  const json& hit = explanation["hit"];
  if (hit.is_null()) return "no hit";
  std::string path;
  for (const json& instance : explanation["path"])
    path += (path.empty() ? " in instance " : ", in that ") + text(instance);
  return "hit: geometry " + text(hit["geometry"]) + ", primitive " + text(hit["primitive"]) + path +
         ", t = " + text(hit["t"]) + ", u = " + text(hit["u"]) + ", v = " + text(hit["v"]) + ", normal " +
         point_text(hit["normal"]) + ", error " + text(hit["error"]);
}

}  // namespace

json explanation_json(const BufferView& file, const Ray& ray, const Explanation& explanation) {
  Teller teller(file, ray);
  json steps = teller.tell(explanation.steps);
  json path = json::array();
  for (const std::uint32_t instance : explanation.path)
    if (instance != kInvalidId) path.push_back(instance);
  const RayCost& cost = explanation.cost;
  return {{"ray", ray_json(ray)},
          {"steps", std::move(steps)},
          {"hit", hit_json(explanation.hit)},
          {"path", std::move(path)},
          {"work",
           {{"nodes", cost.box_tests},
            {"leaves", cost.leaf_tests},
            {"triangles", cost.triangle_tests},
            {"instances", cost.instance_tests},
            {"unvisited", teller.unvisited()}}}};
}

std::string explanation_text(const json& explanation) {
  const json &ray = explanation["ray"], &work = explanation["work"];
  std::string result = "ray: from " + point_text(ray["origin"]) + " along " + point_text(ray["direction"]) +
                       ", t in [" + text(ray["tmin"]) + ", " + text(ray["tmax"]) + "], time " + text(ray["time"]) +
                       "\n";
  std::size_t number = 0;
  for (const json& step : explanation["steps"]) {
    std::array<char, 32> number_text{};
    std::snprintf(number_text.data(), number_text.size(), "%5zu  ", ++number);
    result += number_text.data() + std::string(2 * step["level"].get<std::size_t>(), ' ') + step_text(step) + "\n";
  }
  result += hit_text(explanation) + "\n";
  result += "work: nodes " + text(work["nodes"]) + ", leaves " + text(work["leaves"]) + " with triangles " +
            text(work["triangles"]) + ", instances " + text(work["instances"]) +
            "; met, but not looked into, being farther than a hit: " + text(work["unvisited"]) + "\n";
  return result;
}

}  // namespace hiprt::tools
