#include <tools/scene_io/scene/scene_json.h>

#include <tools/cli/names.h>
#include <tools/scene_io/json_place.h>
#include <tools/scene_io/mesh/mesh_formats.h>
#include <tools/scene_io/scene/scene_json_shapes.h>
#include <tools/scene_io/scene/scene_order.h>
#include <tools/scene_io/text.h>
#include <tools/scene_io/transform.h>

#include <hiprt_build/file.h>

#include <algorithm>
#include <cmath>
#include <map>
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
void check_keys(const JsonPlace& place, const Json& object, const std::array<std::string_view, N>& known) {
  for (const auto& [key, value] : object.items())
    if (std::find(known.begin(), known.end(), key) == known.end()) json_fault(place, "unknown key " + in_quotes(key));
}

const Json& required(const JsonPlace& place, const Json& object, const char* key) {
  const auto value = object.find(key);
  if (value == object.end()) json_fault(place, std::string("'") + key + "' is missing");
  return *value;
}

std::array<double, 4> rotation_of(const JsonPlace& place, const Json& value) {
  if (value.is_array()) return json_numbers<4>(place, value);
  if (!value.is_object()) json_fault(place, "an array of 4 numbers or an object with 'axis' and 'degrees' expected");
  check_keys(place, value, std::array<std::string_view, 2>{"axis", "degrees"});
  const JsonPlace at(place, "axis");
  const auto axis = json_numbers<3>(at, required(place, value, "axis"));
  const double length = std::hypot(axis[0], axis[1], axis[2]);
  if (!(length > 0 && std::isfinite(length))) json_fault(at, "its length is " + Json(length).dump());
  const double angle = json_number(JsonPlace(place, "degrees"), required(place, value, "degrees"));
  const double half = std::fmod(angle, 720.0) * std::numbers::pi / 360.0, s = std::sin(half) / length;
  return {axis[0] * s, axis[1] * s, axis[2] * s, std::cos(half)};
}

Transform matrix_of(const JsonPlace& place, const Json& value) {
  const auto numbers = json_numbers<12>(place, value);
  Transform result;
  for (std::size_t i = 0; i < numbers.size(); ++i) result.m[i / 4][i % 4] = numbers[i];
  return result;
}

/// @param instance or a key.
Placement placement_of(const JsonPlace& place, const Json& instance) {
  Placement placement;
  if (const auto value = instance.find("translate"); value != instance.end())
    placement.translation = json_numbers<3>(JsonPlace(place, "translate"), *value);
  if (const auto value = instance.find("scale"); value != instance.end()) {
    const JsonPlace at(place, "scale");
    if (value->is_number())
      placement.scale.fill(json_number(at, *value));
    else
      placement.scale = json_numbers<3>(at, *value);
  }
  if (const auto value = instance.find("rotate"); value != instance.end())
    placement.rotation = rotation_of(JsonPlace(place, "rotate"), *value);
  return placement;
}

Transform transform_of(const JsonPlace& place, const Placement& placement) {
  const auto transform = transform_of(placement);
  if (!transform) json_fault(JsonPlace(place, "rotate"), transform.error().message);
  return *transform;
}

/// @param instance or a key.
build::Affine to_scene_of(const JsonPlace& place, const Json& instance) {
  const auto matrix = instance.find("matrix");
  if (matrix != instance.end())
    for (const char* key : {"translate", "rotate", "scale"})
      if (instance.contains(key)) json_fault(place, std::string("has both 'matrix' and '") + key + "'");
  const build::Affine affine = to_float(matrix != instance.end() ? matrix_of(JsonPlace(place, "matrix"), *matrix)
                                                                 : transform_of(place, placement_of(place, instance)));
  for (const auto& row : affine.row)
    for (const float number : row)
      if (!std::isfinite(number)) json_fault(place, "its transform has numbers that single precision cannot hold");
  return affine;
}

build::MotionKey parts_of(const JsonPlace& place, const Json& key) {
  const Placement placement = placement_of(place, key);
  transform_of(place, placement);  // Faults of the rotation.
  build::MotionKey result;
  const auto round = [&](const auto& from, auto& to) {
    for (std::size_t i = 0; i < from.size(); ++i) {
      to[i] = static_cast<float>(from[i]);
      if (!std::isfinite(to[i])) json_fault(place, "it has numbers that single precision cannot hold");
    }
  };
  round(placement.translation, result.translation);
  round(placement.rotation, result.rotation);
  round(placement.scale, result.scale);
  if (const auto shear = key.find("shear"); shear != key.end())
    round(json_numbers<3>(JsonPlace(place, "shear"), *shear), result.shear);
  return result;
}

/// Keys as matrices, or in parts: all alike.
build::Motion motion_of(const JsonPlace& place, const Json& value) {
  json_object(place, value);
  check_keys(place, value, std::array<std::string_view, 2>{"interpolation", "keys"});
  build::Motion motion;
  if (const auto name = value.find("interpolation"); name != value.end()) {
    const JsonPlace at(place, "interpolation");
    const std::string& word = json_string(at, *name);
    motion.kind = value_of(kInterpolations, word);
    if (word_of(kInterpolations, motion.kind) != word)
      json_fault(at, in_quotes(word) + ", 'slerp', 'nlerp' or 'matrix' expected");
  }
  const JsonPlace keys_place(place, "keys");
  const Json& keys = json_array(keys_place, required(place, value, "keys"));
  if (keys.empty()) json_fault(keys_place, "0 keys, 1 or more expected");
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const JsonPlace at(keys_place, i);
    const Json& key = json_object(at, keys[i]);
    check_keys(at, key, std::array<std::string_view, 6>{"time", "matrix", "translate", "rotate", "scale", "shear"});
    const auto time = static_cast<float>(json_number(JsonPlace(at, "time"), required(at, key, "time")));
    if (key.contains("matrix") != keys[0].contains("matrix"))
      json_fault(at, "some keys have 'matrix' and some have not");
    if (key.contains("matrix")) {
      if (key.contains("shear")) json_fault(at, "has both 'matrix' and 'shear'");
      motion.matrices.push_back({time, to_scene_of(at, key)});
    } else {
      motion.keys.push_back(parts_of(at, key));
      motion.keys.back().time = time;
    }
  }
  return motion;
}

/// One document on its way into a description.
class Reader {
 public:
  Reader(const std::filesystem::path& path, SceneDescription& result) : folder_(path.parent_path()), result_(result) {}

  void read(const Json& document) {
    json_object(root_, document);
    check_keys(root_, document,
               std::array<std::string_view, 6>{"$schema", "format", "version", "objects", "groups", "scene"});
    check_version(document);
    const Json& objects = json_object(objects_place_, required(root_, document, "objects"));
    const Json& groups = json_object(groups_place_, required(root_, document, "groups"));
    read_objects(objects);
    for (const auto& [name, group] : groups.items()) add_group_name(JsonPlace(groups_place_, name), name);
    for (const auto& [name, group] : groups.items()) read_group(JsonPlace(groups_place_, name), group);
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
      json_string(JsonPlace(root_, "$schema"), *schema);
    const JsonPlace format(root_, "format"), version(root_, "version");
    if (const auto& name = json_string(format, required(root_, document, "format")); name != kFormatName)
      json_fault(format, in_quotes(name) + ", '" + std::string(kFormatName) + "' expected");
    if (const auto number = json_uint32(version, required(root_, document, "version")); number != kKnownVersion)
      json_fault(version, std::to_string(number) + ", known is " + std::to_string(kKnownVersion));
  }

  void add_group_name(const JsonPlace& place, const std::string& name) {
    if (name.empty()) json_fault(place, "a name is empty");
    if (names_.contains(name)) json_fault(place, "there is an object of that name");
    names_.emplace(name, Named{true, group_names_.size()});
    group_names_.push_back(&name);
  }

  void read_objects(const Json& objects) {
    std::map<std::pair<std::vector<std::size_t>, std::vector<std::size_t>>, std::size_t> known;
    for (const auto& [name, files] : objects.items()) {
      const JsonPlace place(objects_place_, name);
      if (name.empty()) json_fault(place, "a name is empty");
      if (!files.is_object()) json_array(place, files);
      if (files.empty()) json_fault(place, "0 files or shapes, 1 or more expected");
      SceneObject object{name, {}, {}};
      if (files.is_object()) add_shapes(place, files, object);
      for (std::size_t i = 0; files.is_array() && i < files.size(); ++i)
        add_part(JsonPlace(place, i), files[i], object);
      const auto [same, is_new] = known.emplace(std::pair(object.meshes, object.shapes), result_.objects.size());
      if (is_new)
        result_.objects.push_back(std::move(object));
      else
        ++result_.shared_objects;
      names_.emplace(name, Named{false, same->second});
    }
  }

  /// A file of a mesh or of shapes, or shapes themselves.
  void add_part(const JsonPlace& place, const Json& value, SceneObject& object) {
    if (value.is_object()) return add_shapes(place, value, object);
    if (!value.is_string()) json_fault(place, "a path, or an object with 'spheres' or 'curves' expected");
    const std::string& text = json_string(place, value);
    if (text.empty()) json_fault(place, "a path is empty");
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

  void add_shapes(const JsonPlace& place, const Json& value, SceneObject& object) {
    object.shapes.push_back(result_.shapes.size());
    result_.shapes.push_back(shapes_of_json(place, value));
  }

  /// The number of a file, of add() if it is new; the same for all ways to write its path.
  template <class Add>
  static std::size_t number_of(const std::filesystem::path& path, std::unordered_map<std::string, std::size_t>& known,
                               const Add& add) {
    std::error_code ignored;
    const auto resolved = std::filesystem::weakly_canonical(path, ignored);
    const auto [found, is_new] = known.try_emplace(resolved.empty() ? path.string() : resolved.string());
    if (is_new) found->second = add();
    return found->second;
  }

  void read_group(const JsonPlace& place, const Json& group) {
    json_array(place, group);
    std::vector<Instance>& instances = groups_.emplace_back();
    instances.reserve(group.size());
    for (std::size_t i = 0; i < group.size(); ++i) instances.push_back(instance_of(JsonPlace(place, i), group[i]));
  }

  Instance instance_of(const JsonPlace& place, const Json& value) {
    json_object(place, value);
    check_keys(
        place, value,
        std::array<std::string_view, 8>{"object", "matrix", "translate", "rotate", "scale", "motion", "mask", "id"});
    Instance instance;
    const JsonPlace at(place, "object");
    Named& named = find(at, json_string(at, required(place, value, "object")));
    named.used = true;
    instance.object = static_cast<std::uint32_t>(named.group ? result_.objects.size() + named.number : named.number);
    instance.to_scene = to_scene_of(place, value);
    if (const auto motion = value.find("motion"); motion != value.end()) {
      for (const char* key : {"matrix", "translate", "rotate", "scale"})
        if (value.contains(key)) json_fault(place, std::string("has both 'motion' and '") + key + "'");
      result_.motions.push_back(std::make_unique<build::Motion>(motion_of(JsonPlace(place, "motion"), *motion)));
      instance.motion = result_.motions.back().get();
    }
    if (const auto mask = value.find("mask"); mask != value.end())
      instance.mask = json_uint32(JsonPlace(place, "mask"), *mask);
    if (const auto id = value.find("id"); id != value.end()) instance.id = json_uint32(JsonPlace(place, "id"), *id);
    return instance;
  }

  Named& find(const JsonPlace& place, const std::string& name) {
    const auto found = names_.find(name);
    if (found == names_.end()) json_fault(place, in_quotes(name) + " is neither an object nor a group");
    return found->second;
  }

  std::size_t top_of(const Json& document) {
    const JsonPlace place(root_, "scene");
    const std::string& name = json_string(place, required(root_, document, "scene"));
    const Named& named = find(place, name);
    if (!named.group) json_fault(place, in_quotes(name) + " is an object, a group expected");
    return named.number;
  }

  /// Groups into the order in which they are built; everything has to be used.
  void arrange(const Json& document, std::size_t top) {
    const std::size_t objects = result_.objects.size();
    GroupOrder order = order_groups(groups_, objects, top);
    if (order.cycle) cycle_fault(*order.cycle);
    for (const auto& [name, object] : document["objects"].items())
      if (!names_.find(name)->second.used)
        json_fault(JsonPlace(objects_place_, name), "no instance in the scene is of it");
    std::vector<std::size_t> place_in_order(groups_.size(), groups_.size());
    for (std::size_t i = 0; i < order.groups.size(); ++i) place_in_order[order.groups[i]] = i;
    for (std::size_t g = 0; g < groups_.size(); ++g)
      if (place_in_order[g] == groups_.size())
        json_fault(JsonPlace(groups_place_, *group_names_[g]), "no instance in the scene is of it");
    for (const std::size_t g : order.groups) {
      for (Instance& instance : groups_[g])
        if (instance.object >= objects)
          instance.object = static_cast<std::uint32_t>(objects + place_in_order[instance.object - objects]);
      result_.groups.push_back({JsonPlace(groups_place_, *group_names_[g]).text(), std::move(groups_[g])});
    }
  }

  [[noreturn]] void cycle_fault(const GroupCycle& cycle) const {
    std::string way;
    for (const std::size_t g : cycle.groups) way += in_quotes(*group_names_[g]) + " has ";
    const JsonPlace group(groups_place_, *group_names_[cycle.groups.back()]), instance(group, cycle.instance);
    json_fault(JsonPlace(instance, "object"), "a cycle: " + way + in_quotes(*group_names_[cycle.groups.front()]));
  }

  std::filesystem::path folder_;
  SceneDescription& result_;
  const JsonPlace root_{}, objects_place_{root_, "objects"}, groups_place_{root_, "groups"};
  std::unordered_map<std::string, Named> names_;
  std::unordered_map<std::string, std::size_t> files_, shape_files_;  ///< Numbers by resolved path.
  std::vector<const std::string*> group_names_;
  std::vector<std::vector<Instance>> groups_;  ///< As the document has them; objects' numbers: see order_groups().
};

}  // namespace

build::Result<SceneDescription> read_scene_json(const std::filesystem::path& path) {
  const auto file = build::map_file(path);
  if (!file) return tl::unexpected(file.error());
  SceneDescription result;
  result.path = path.string();
  try {
    const Json document = parse_json({reinterpret_cast<const char*>(file->bytes().data()), file->size()}, kMostLevels);
    Reader(path, result).read(document);
    return result;
  } catch (const JsonFault& fault) {
    return invalid_input(path.string() + ": " + fault.message);
  } catch (const std::bad_alloc&) {
    return tl::unexpected(
        build::Error{build::ErrorCode::kOutOfMemory, path.string() + ": not enough memory to read it"});
  }
}

}  // namespace hiprt::tools
