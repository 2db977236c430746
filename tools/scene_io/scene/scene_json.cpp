#include <tools/scene_io/scene/scene_json.h>

#include <tools/base/errors.h>
#include <tools/base/memory_limit.h>
#include <tools/base/names.h>
#include <tools/base/read_input.h>
#include <tools/base/text.h>
#include <tools/scene_io/json_location.h>
#include <tools/scene_io/scene/scene_json_shapes.h>
#include <tools/scene_io/scene/scene_order.h>
#include <tools/scene_io/transform.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <new>
#include <numbers>
#include <unordered_map>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;
using build::Instance;

constexpr std::string_view kFormatName = "hiprt scene";
constexpr std::uint32_t kKnownVersion = 1;
/// As deep as the format is: groups, a group, an instance, motion, keys, a key, rotate, axis in the document. (Of
/// shapes: objects, an object, its part, curves, a strand, a point.)
constexpr std::size_t kMostLevels = 9;
constexpr Names<MotionKind, 3> kInterpolations{
    {{"slerp", MotionKind::kSlerp}, {"nlerp", MotionKind::kNlerp}, {"matrix", MotionKind::kMatrix}}};

template <std::size_t N>
void check_keys(const JsonLocation& location, const Json& object, const std::array<std::string_view, N>& known) {
  for (const auto& [key, value] : object.items())
    if (std::find(known.begin(), known.end(), key) == known.end())
      json_fault(location, "unknown key " + in_quotes(key));
}

std::array<double, 4> rotation_of(const JsonLocation& location, const Json& value) {
  if (value.is_array()) return json_numbers<4>(location, value);
  if (!value.is_object()) json_fault(location, "an array of 4 numbers or an object with 'axis' and 'degrees' expected");
  check_keys(location, value, std::array<std::string_view, 2>{"axis", "degrees"});
  const JsonLocation at(location, "axis");
  const auto axis = json_numbers<3>(at, json_required(location, value, "axis"));
  const double length = std::hypot(axis[0], axis[1], axis[2]);
  if (!(length > 0 && std::isfinite(length))) json_fault(at, "its length is " + Json(length).dump());
  const double angle = json_number(JsonLocation(location, "degrees"), json_required(location, value, "degrees"));
  const double half = std::fmod(angle, 720.0) * std::numbers::pi / 360.0, s = std::sin(half) / length;
  return {axis[0] * s, axis[1] * s, axis[2] * s, std::cos(half)};
}

Transform matrix_of(const JsonLocation& location, const Json& value) {
  const auto numbers = json_numbers<12>(location, value);
  Transform result;
  for (std::size_t i = 0; i < numbers.size(); ++i) result.m[i / 4][i % 4] = numbers[i];
  return result;
}

/// @param instance or a key.
Placement placement_of(const JsonLocation& location, const Json& instance) {
  Placement placement;
  if (const auto value = instance.find("translate"); value != instance.end())
    placement.translation = json_numbers<3>(JsonLocation(location, "translate"), *value);
  if (const auto value = instance.find("scale"); value != instance.end()) {
    const JsonLocation at(location, "scale");
    if (value->is_number())
      placement.scale.fill(json_number(at, *value));
    else
      placement.scale = json_numbers<3>(at, *value);
  }
  if (const auto value = instance.find("rotate"); value != instance.end())
    placement.rotation = rotation_of(JsonLocation(location, "rotate"), *value);
  return placement;
}

Transform transform_of(const JsonLocation& location, const Placement& placement) {
  const auto transform = transform_of(placement);
  if (!transform) json_fault(JsonLocation(location, "rotate"), transform.error().message);
  return *transform;
}

/// @param instance or a key.
build::Affine to_scene_of(const JsonLocation& location, const Json& instance) {
  const auto matrix = instance.find("matrix");
  if (matrix != instance.end())
    for (const char* key : {"translate", "rotate", "scale"})
      if (instance.contains(key)) json_fault(location, std::string("has both 'matrix' and '") + key + "'");
  const build::Affine affine =
      to_float(matrix != instance.end() ? matrix_of(JsonLocation(location, "matrix"), *matrix)
                                        : transform_of(location, placement_of(location, instance)));
  for (const auto& row : affine.row)
    for (const float number : row)
      if (!std::isfinite(number)) json_fault(location, "its transform has numbers that single precision cannot hold");
  return affine;
}

build::MotionKey parts_of(const JsonLocation& location, const Json& key) {
  const Placement placement = placement_of(location, key);
  transform_of(location, placement);  // Faults of the rotation.
  build::MotionKey result;
  const auto round = [&](const auto& from, auto& to) {
    for (std::size_t i = 0; i < from.size(); ++i) {
      to[i] = static_cast<float>(from[i]);
      if (!std::isfinite(to[i])) json_fault(location, "it has numbers that single precision cannot hold");
    }
  };
  round(placement.translation, result.translation);
  round(placement.rotation, result.rotation);
  round(placement.scale, result.scale);
  if (const auto shear = key.find("shear"); shear != key.end())
    round(json_numbers<3>(JsonLocation(location, "shear"), *shear), result.shear);
  return result;
}

/// Why the turn between two keys is not the one that the document may mean; empty: it is.
std::string fault_of_turn(const JsonLocation& location, const Json& before, const Json& key) {
  const auto degrees = [](const Json& from) {
    const auto turn = from.find("rotate");
    return turn != from.end() && turn->is_object() ? turn->value("degrees", 0.0) : 0.0;
  };
  const auto axis = [](const Json& from) {
    const auto turn = from.find("rotate");
    return turn != from.end() && turn->is_object() ? turn->value("axis", Json()) : Json();
  };
  const double angle = std::abs(degrees(key) - degrees(before));
  const bool one_axis = axis(before) == axis(key) || axis(before).is_null() || axis(key).is_null();
  if (!one_axis || angle <= 180) return {};
  return location.text() + ": a turn of " + Json(angle).dump() +
         " degrees from the key before: between two keys the shorter arc is taken; add keys between";
}

/// Keys as matrices, or in parts: all alike.
build::Motion motion_of(const JsonLocation& location, const Json& value, std::vector<std::string>& warnings) {
  json_object(location, value);
  check_keys(location, value, std::array<std::string_view, 2>{"interpolation", "keys"});
  build::Motion motion;
  if (const auto name = value.find("interpolation"); name != value.end()) {
    const JsonLocation at(location, "interpolation");
    const std::string& word = json_string(at, *name);
    motion.kind = value_of(kInterpolations, word);
    if (word_of(kInterpolations, motion.kind) != word)
      json_fault(at, in_quotes(word) + ", 'slerp', 'nlerp' or 'matrix' expected");
  }
  const JsonLocation keys_location(location, "keys");
  const Json& keys = json_array(keys_location, json_required(location, value, "keys"));
  if (keys.empty()) json_fault(keys_location, "0 keys, 1 or more expected");
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const JsonLocation at(keys_location, i);
    const Json& key = json_object(at, keys[i]);
    check_keys(at, key, std::array<std::string_view, 6>{"time", "matrix", "translate", "rotate", "scale", "shear"});
    const auto time = static_cast<float>(json_number(JsonLocation(at, "time"), json_required(at, key, "time")));
    if (key.contains("matrix") != keys[0].contains("matrix"))
      json_fault(at, "some keys have 'matrix' and some have not");
    if (key.contains("matrix")) {
      if (key.contains("shear")) json_fault(at, "has both 'matrix' and 'shear'");
      motion.matrices.push_back({time, to_scene_of(at, key)});
    } else {
      motion.keys.push_back(parts_of(at, key));
      motion.keys.back().time = time;
      if (i == 0 || motion.kind == MotionKind::kMatrix) continue;
      if (std::string fault = fault_of_turn(at, keys[i - 1], key); !fault.empty()) warnings.push_back(std::move(fault));
    }
  }
  return motion;
}

/// Reads one document into a description.
class Reader {
 public:
  Reader(const std::filesystem::path& path, SceneDescription& result) : folder_(path.parent_path()), result_(result) {}

  void read(const Json& document) {
    json_object(root_, document);
    check_keys(root_, document,
               std::array<std::string_view, 6>{"$schema", "format", "version", "objects", "groups", "scene"});
    check_version(document);
    const Json& objects = json_object(objects_location_, json_required(root_, document, "objects"));
    const Json& groups = json_object(groups_location_, json_required(root_, document, "groups"));
    read_objects(objects);
    for (const auto& [name, group] : groups.items()) add_group_name(JsonLocation(groups_location_, name), name);
    for (const auto& [name, group] : groups.items()) read_group(JsonLocation(groups_location_, name), group);
    arrange(document, top_of(document));
  }

 private:
  struct Named {
    bool group;
    std::size_t number;  ///< Of the object, or the group in the order of their names.
    bool used = false;   ///< By an instance.
  };

  void check_version(const Json& document) {
    if (const auto schema = document.find("$schema"); schema != document.end())
      json_string(JsonLocation(root_, "$schema"), *schema);
    const JsonLocation format(root_, "format"), version(root_, "version");
    if (const auto& name = json_string(format, json_required(root_, document, "format")); name != kFormatName)
      json_fault(format, in_quotes(name) + ", '" + std::string(kFormatName) + "' expected");
    if (const auto number = json_uint32(version, json_required(root_, document, "version")); number != kKnownVersion)
      json_fault(version, std::to_string(number) + ", known is " + std::to_string(kKnownVersion));
  }

  void add_group_name(const JsonLocation& location, const std::string& name) {
    if (name.empty()) json_fault(location, "a name is empty");
    if (names_.contains(name)) json_fault(location, "there is an object of that name");
    names_.emplace(name, Named{true, group_names_.size()});
    group_names_.push_back(&name);
  }

  void read_objects(const Json& objects) {
    std::map<std::pair<std::vector<std::size_t>, std::vector<std::size_t>>, std::size_t> known;
    for (const auto& [name, files] : objects.items()) {
      const JsonLocation location(objects_location_, name);
      if (name.empty()) json_fault(location, "a name is empty");
      if (!files.is_object()) json_array(location, files);
      if (files.empty()) json_fault(location, "0 files or shapes, 1 or more expected");
      SceneObject object{name, {}, {}};
      if (files.is_object()) add_shapes(location, files, object);
      for (std::size_t i = 0; files.is_array() && i < files.size(); ++i)
        add_part(JsonLocation(location, i), files[i], object);
      const auto [same, is_new] = known.emplace(std::pair(object.meshes, object.shapes), result_.objects.size());
      if (is_new)
        result_.objects.push_back(std::move(object));
      else
        ++result_.shared_objects;
      names_.emplace(name, Named{false, same->second});
    }
  }

  /// A file of a mesh or of shapes, or shapes themselves.
  void add_part(const JsonLocation& location, const Json& value, SceneObject& object) {
    if (value.is_object()) return add_shapes(location, value, object);
    if (!value.is_string()) json_fault(location, "a path, or an object with 'spheres' or 'curves' expected");
    const std::string& text = json_string(location, value);
    if (text.empty()) json_fault(location, "a path is empty");
    const std::filesystem::path path = (folder_ / text).lexically_normal();
    if (is_shape_file(text))
      object.shapes.push_back(number_of(path, shape_files_, [&] {
        result_.shapes.push_back({.path = path.string()});
        return result_.shapes.size() - 1;
      }));
    else
      object.meshes.push_back(number_of(path, files_, [&] {
        result_.files.push_back(path.string());
        return result_.files.size() - 1;
      }));
  }

  void add_shapes(const JsonLocation& location, const Json& value, SceneObject& object) {
    object.shapes.push_back(result_.shapes.size());
    result_.shapes.push_back(shapes_of_json(location, value));
  }

  /// The number of a file, from add() if it is new. All spellings of its path have one number.
  template <class Add>
  static std::size_t number_of(const std::filesystem::path& path, std::unordered_map<std::string, std::size_t>& known,
                               const Add& add) {
    std::error_code ignored;
    const auto resolved = std::filesystem::weakly_canonical(path, ignored);
    const auto [found, is_new] = known.try_emplace(resolved.empty() ? path.string() : resolved.string());
    if (is_new) found->second = add();
    return found->second;
  }

  void read_group(const JsonLocation& location, const Json& group) {
    json_array(location, group);
    std::vector<Instance>& instances = groups_.emplace_back();
    instances.reserve(group.size());
    for (std::size_t i = 0; i < group.size(); ++i)
      instances.push_back(instance_of(JsonLocation(location, i), group[i]));
  }

  Instance instance_of(const JsonLocation& location, const Json& value) {
    json_object(location, value);
    check_keys(
        location, value,
        std::array<std::string_view, 8>{"object", "matrix", "translate", "rotate", "scale", "motion", "mask", "id"});
    Instance instance;
    const JsonLocation at(location, "object");
    Named& named = find(at, json_string(at, json_required(location, value, "object")));
    named.used = true;
    instance.object = static_cast<std::uint32_t>(named.group ? result_.objects.size() + named.number : named.number);
    instance.to_scene = to_scene_of(location, value);
    if (const auto motion = value.find("motion"); motion != value.end()) {
      for (const char* key : {"matrix", "translate", "rotate", "scale"})
        if (value.contains(key)) json_fault(location, std::string("has both 'motion' and '") + key + "'");
      result_.motions.push_back(
          std::make_unique<build::Motion>(motion_of(JsonLocation(location, "motion"), *motion, result_.warnings)));
      instance.motion = result_.motions.back().get();
    }
    if (const auto mask = value.find("mask"); mask != value.end())
      instance.mask = json_uint32(JsonLocation(location, "mask"), *mask);
    if (const auto id = value.find("id"); id != value.end())
      instance.id = json_uint32(JsonLocation(location, "id"), *id);
    return instance;
  }

  Named& find(const JsonLocation& location, const std::string& name) {
    const auto found = names_.find(name);
    if (found == names_.end()) json_fault(location, in_quotes(name) + " is neither an object nor a group");
    return found->second;
  }

  std::size_t top_of(const Json& document) {
    const JsonLocation location(root_, "scene");
    const std::string& name = json_string(location, json_required(root_, document, "scene"));
    const Named& named = find(location, name);
    if (!named.group) json_fault(location, in_quotes(name) + " is an object, a group expected");
    return named.number;
  }

  /// Groups into the order in which they are built; everything has to be used.
  void arrange(const Json& document, std::size_t top) {
    const std::size_t objects = result_.objects.size();
    GroupOrder order = order_groups(groups_, objects, top);
    if (order.cycle) cycle_fault(*order.cycle);
    for (const auto& [name, object] : document["objects"].items())
      if (!names_.find(name)->second.used)
        json_fault(JsonLocation(objects_location_, name), "no instance in the scene is of it");
    std::vector<std::size_t> index_in_order(groups_.size(), groups_.size());
    for (std::size_t i = 0; i < order.groups.size(); ++i) index_in_order[order.groups[i]] = i;
    for (std::size_t g = 0; g < groups_.size(); ++g)
      if (index_in_order[g] == groups_.size())
        json_fault(JsonLocation(groups_location_, *group_names_[g]), "no instance in the scene is of it");
    for (const std::size_t g : order.groups) {
      for (Instance& instance : groups_[g])
        if (instance.object >= objects)
          instance.object = static_cast<std::uint32_t>(objects + index_in_order[instance.object - objects]);
      result_.groups.push_back({JsonLocation(groups_location_, *group_names_[g]).text(), std::move(groups_[g])});
    }
  }

  [[noreturn]] void cycle_fault(const GroupCycle& cycle) const {
    std::string cycle_text;
    for (const std::size_t g : cycle.groups) cycle_text += in_quotes(*group_names_[g]) + " has ";
    const JsonLocation group(groups_location_, *group_names_[cycle.groups.back()]), instance(group, cycle.instance);
    json_fault(JsonLocation(instance, "object"),
               "a cycle: " + cycle_text + in_quotes(*group_names_[cycle.groups.front()]));
  }

  std::filesystem::path folder_;
  SceneDescription& result_;
  const JsonLocation root_{}, objects_location_{root_, "objects"}, groups_location_{root_, "groups"};
  std::unordered_map<std::string, Named> names_;
  std::unordered_map<std::string, std::size_t> files_, shape_files_;  ///< Numbers by resolved path.
  std::vector<const std::string*> group_names_;
  std::vector<std::vector<Instance>> groups_;  ///< As the document has them; objects' numbers: see order_groups().
};

}  // namespace

build::Result<SceneDescription> read_scene_json(const std::filesystem::path& path) {
  const auto file = read_input(path);
  if (!file) return tl::unexpected(file.error());
  SceneDescription result;
  result.path = path.string();
  try {
    const Json document = parse_json({reinterpret_cast<const char*>(file->bytes().data()), file->size()}, kMostLevels);
    Reader(path, result).read(document);
    return result;
  } catch (const JsonFault& fault) {
    return invalid_input(path.string() + ": " + fault.message);
  } catch (const std::bad_alloc& failure) {
    return tl::unexpected(not_enough_memory(path.native(), "to read it", failure));
  }
}

}  // namespace hiprt::tools
