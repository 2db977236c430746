#include <tools/scene_io/gltf/gltf_instancing.h>

#include <tools/base/errors.h>
#include <tools/scene_io/gltf/gltf_accessor.h>

#include <tiny_gltf.h>

#include <algorithm>
#include <optional>

namespace hiprt::tools {
namespace {

/// The vectors of one attribute; empty if it is not there.
build::Result<std::vector<double>> read_attribute(const tinygltf::Model& model, const tinygltf::Value& attributes,
                                                  const char* name, unsigned components) {
  if (!attributes.Has(name)) return std::vector<double>{};
  const tinygltf::Value& index = attributes.Get(name);
  if (!index.IsInt()) return invalid_input(std::string(name) + " is not the number of an accessor");
  auto values = read_vectors(model, index.GetNumberAsInt(), components);
  if (!values) values.error().message.insert(0, std::string(name) + ": ");
  return values;
}

struct Attributes {
  std::vector<double> translation, rotation, scale;
};

build::Result<Attributes> read_attributes(const tinygltf::Model& model, const tinygltf::Value& attributes) {
  Attributes result;
  const auto read = [&](const char* name, unsigned components, std::vector<double>& to) -> build::Result<void> {
    auto values = read_attribute(model, attributes, name, components);
    if (!values) return tl::unexpected(std::move(values.error()));
    to = std::move(*values);
    return {};
  };
  if (auto done = read("TRANSLATION", 3, result.translation); !done) return tl::unexpected(done.error());
  if (auto done = read("ROTATION", 4, result.rotation); !done) return tl::unexpected(done.error());
  if (auto done = read("SCALE", 3, result.scale); !done) return tl::unexpected(done.error());
  return result;
}

/// How many instances there are: all attributes say the same number.
build::Result<std::size_t> count_of(const tinygltf::Value& attributes, const Attributes& values) {
  std::optional<std::size_t> count;
  const auto agrees = [&](const char* name, std::size_t own) {
    if (!attributes.Has(name)) return true;
    if (!count) count = own;
    return *count == own;
  };
  if (!agrees("TRANSLATION", values.translation.size() / 3) || !agrees("ROTATION", values.rotation.size() / 4) ||
      !agrees("SCALE", values.scale.size() / 3))
    return invalid_input("TRANSLATION, ROTATION and SCALE have different numbers of elements");
  if (!count) return invalid_input("neither TRANSLATION nor ROTATION nor SCALE is there");
  return *count;
}

build::Result<std::vector<Transform>> read_instances(const tinygltf::Model& model, const tinygltf::Value& extension) {
  if (!extension.IsObject() || !extension.Has("attributes") || !extension.Get("attributes").IsObject())
    return invalid_input("'attributes' are missing");
  const tinygltf::Value& attributes = extension.Get("attributes");
  const auto values = read_attributes(model, attributes);
  if (!values) return tl::unexpected(values.error());
  const auto count = count_of(attributes, *values);
  if (!count) return tl::unexpected(count.error());
  std::vector<Transform> result;
  for (std::size_t i = 0; i < *count; ++i) {
    Placement placement;
    const auto take = [&](const std::vector<double>& from, auto& to) {
      if (!from.empty()) std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(i * to.size()), to.size(), to.begin());
    };
    take(values->translation, placement.translation);
    take(values->rotation, placement.rotation);
    take(values->scale, placement.scale);
    const auto transform = transform_of(placement);
    if (!transform) return invalid_input("instance " + std::to_string(i) + ": its " + transform.error().message);
    result.push_back(*transform);
  }
  return result;
}

}  // namespace

build::Result<std::vector<Transform>> gpu_instances(const tinygltf::Model& model, int node) {
  const auto& extensions = model.nodes[static_cast<std::size_t>(node)].extensions;
  const auto found = extensions.find(std::string(kGpuInstancing));
  if (found == extensions.end()) return std::vector<Transform>{{}};
  auto result = read_instances(model, found->second);
  if (!result)
    result.error().message.insert(0, "node " + std::to_string(node) + ", " + std::string(kGpuInstancing) + ": ");
  return result;
}

}  // namespace hiprt::tools
