#include <hiprt_build/input/provenance.h>

#include <hiprt_build/input/build_input.h>

#include <nlohmann/json.hpp>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>

namespace hiprt::build {
namespace {

/// XXH3-64 of all the bytes, one span after the other, as 16 hexadecimal digits.
template <class... Spans> std::string hash(Monitor& monitor, const Spans&... spans) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  XXH3_state_t state;
  XXH3_INITSTATE(&state);
  XXH3_64bits_reset(&state);
  const auto update = [&](std::span<const std::byte> bytes) {
    for (; !bytes.empty(); bytes = bytes.subspan(std::min(kPiece, bytes.size()))) {
      monitor.check();
      XXH3_64bits_update(&state, bytes.data(), std::min(kPiece, bytes.size()));
    }
  };
  (update(std::as_bytes(spans)), ...);
  char text[17];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(XXH3_64bits_digest(&state)));
  return text;
}

const char* layout_name(NodeLayout layout) {
  constexpr const char* kNames[] = {"float", "planes", "half", "quantized"};
  return kNames[static_cast<std::uint32_t>(layout) - 1];
}

/// The finite numbers of a document's groups, document[group][key]. Read without nlohmann's tree of values: its
/// destructor allocates, which ends the program when there is no memory.
class Numbers final : public nlohmann::json_sax<nlohmann::json> {
 public:
  explicit Numbers(std::string_view document) {
    if (!nlohmann::json::sax_parse(document, this)) values_.clear();
  }
  std::optional<double> get(const std::string& group, const std::string& key) const {
    const auto found = values_.find({group, key});
    return found == values_.end() ? std::nullopt : std::optional(found->second);
  }

  bool number_integer(number_integer_t value) override { return keep(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return keep(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t&) override { return keep(value); }
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return ++depth_ > 0; }
  bool end_object() override { return depth_-- > 0; }
  bool start_array(std::size_t) override { return ++arrays_ > 0; }
  bool end_array() override { return arrays_-- > 0; }
  bool key(string_t& name) override {
    if (arrays_ == 0 && depth_ == 1) group_ = name;
    if (arrays_ == 0 && depth_ == 2) key_ = name;
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception&) override { return false; }

 private:
  bool keep(double value) {
    if (arrays_ == 0 && depth_ == 2 && std::isfinite(value)) values_[{group_, key_}] = value;
    return true;
  }

  std::map<std::pair<std::string, std::string>, double> values_;
  std::string group_, key_;
  int depth_ = 0, arrays_ = 0;
};

/// The text of an object. Its values are made one at a time, for the reason of Numbers.
class ObjectText {
 public:
  template <class Value> ObjectText& add(const char* key, const Value& value) {
    using Json = nlohmann::json;
    return add_text(key, Json(value).dump(-1, ' ', false, Json::error_handler_t::replace));
  }
  /// @param value as JSON.
  ObjectText& add_text(const char* key, const std::string& value) {
    text_ += (text_.empty() ? "\"" : ",\"") + std::string(key) + "\":" + value;
    return *this;
  }
  std::string text() const { return "{" + text_ + "}"; }

 private:
  std::string text_;
};

/// The elements without the gaps between them, so that the hash does not depend on strides.
template <class T, class View> std::span<const T> packed(const View& elements, std::vector<T>& copy) {
  if (!elements.has_gaps()) return {static_cast<const T*>(elements.data()), elements.size()};
  copy.resize(elements.size());
  for (std::size_t i = 0; i < copy.size(); ++i) copy[i] = elements[i];
  return copy;
}

std::string hash_of(Monitor& monitor, const TriangleMesh& mesh) {
  std::vector<Position> positions;
  std::vector<Triangle> triangles;
  return hash(monitor, packed(mesh.positions, positions), packed(mesh.triangles, triangles), std::span(&mesh.mask, 1));
}

std::string hash_of(Monitor& monitor, const CustomGeometry& custom) {
  std::vector<Box> boxes;
  return hash(monitor, packed(custom.boxes, boxes), std::span(&custom.mask, 1), custom.shapes.points,
              custom.shapes.segments, std::span(&custom.shapes.keys, custom.shapes.keys == 0 ? 0 : 1));
}

std::string describe_input(Monitor& monitor, const SceneInput& scene) {
  std::string geometries;
  const auto append = [&](const ObjectText& geometry) {
    geometries += (geometries.empty() ? "" : ",") + geometry.text();
  };
  for (const TriangleMesh& mesh : scene.meshes)
    append(ObjectText()
               .add("name", std::string(mesh.name))
               .add("vertices", mesh.positions.size())
               .add("triangles", triangle_count(mesh))
               .add("xxh3", hash_of(monitor, mesh)));
  for (const CustomGeometry& custom : scene.customs)
    append(ObjectText()
               .add("name", std::string(custom.name))
               .add("customs", custom.boxes.size())
               .add("type", custom.type)
               .add("xxh3", hash_of(monitor, custom)));
  return "[" + geometries + "]";
}

/// @param options nothing unset.
std::string describe_options(const BuildOptions& options) {
  return ObjectText()
      .add("nodes", layout_name(options.nodes))
      .add("max_leaf_triangles", options.max_leaf_triangles)
      .add("presplit_budget", options.presplit_budget)
      .add("split_budget", options.split_budget.value())
      .add("reinsertion_rounds", options.reinsertion_rounds.value())
      .add("ploc_radius", options.ploc_radius)
      .add("pair_triangles", options.pair_triangles)
      .add("widen_boxes", options.widen_boxes)
      .add("cost_box_node", options.costs.box_node)
      .add("cost_leaf", options.costs.leaf)
      .add("cost_custom", options.costs.custom)
      .text();
}

std::string describe_statistics(const BuildStatistics& statistics, double sah_cost) {
  return ObjectText()
      .add("builder", name(statistics.builder))
      .add("triangles", statistics.triangles)
      .add("customs", statistics.customs)
      .add("dropped_not_finite", statistics.dropped_not_finite)
      .add("dropped_degenerate", statistics.dropped_degenerate)
      .add("pairs", statistics.pairs)
      .add("custom_pairs", statistics.custom_pairs)
      .add("nodes", statistics.nodes)
      .add("leaves", statistics.leaves)
      .add("sah_cost", sah_cost)
      .text();
}

}  // namespace

std::string make_provenance(Monitor& monitor, const SceneInput& scene, const BuildOptions& options,
                            const BuildStatistics& statistics, double sah_cost) {
  std::string text = ObjectText()
                         .add("tool", options.tool.empty() ? "hiprt_build" : std::string(options.tool))
                         .add("library", std::string("hiprt ") + version())
                         .add("builder", name(options.builder))
                         .add_text("options", describe_options(options))
                         .add_text("input", describe_input(monitor, scene))
                         .add_text("statistics", describe_statistics(statistics, sah_cost))
                         .text();
  // The last of the statistics, in a fixed number of digits.
  return text.replace(text.size() - 2, 2, ",\"exchange_slack\":0.000000}}");
}

void set_exchange_slack(std::span<char> provenance, double exchange_slack) {
  char text[16];
  const int size = std::snprintf(text, sizeof(text), "%.6f}}", exchange_slack);
  std::copy_n(text, size, provenance.end() - size);
}

BuiltTree read_built_tree(std::string_view provenance) {
  const Numbers document(provenance);
  BuiltTree result;
  const auto read = [&](const char* key, float& cost) {
    const double value = document.get("options", key).value_or(0);
    if (value > 0 && value <= static_cast<double>(std::numeric_limits<float>::max())) cost = static_cast<float>(value);
  };
  read("cost_box_node", result.costs.box_node);
  read("cost_leaf", result.costs.leaf);
  read("cost_custom", result.costs.custom);
  result.sah_cost = document.get("statistics", "sah_cost");
  if (!(result.sah_cost > 0.0)) result.sah_cost.reset();
  result.exchange_slack = document.get("statistics", "exchange_slack");
  if (!(result.exchange_slack >= 0.0 && result.exchange_slack <= 1.0)) result.exchange_slack.reset();
  return result;
}

}  // namespace hiprt::build
