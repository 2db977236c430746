#include <tools/build/cache_key.h>

#include <tools/base/digest.h>

#include <hiprt_device/format/buffer.h>

#include <string_view>
#include <type_traits>

namespace hiprt::tools {
namespace {

/// Counts go before the elements: two inputs that differ never give the same sequence of bytes.
class Hasher {
 public:
  void bytes(const void* data, std::size_t size) { digester_.add({static_cast<const std::byte*>(data), size}); }
  template <class Number> void number(Number value) {
    static_assert(std::is_arithmetic_v<Number> || std::is_enum_v<Number>);
    bytes(&value, sizeof(value));
  }
  void text(std::string_view text) {
    number(std::uint64_t{text.size()});
    bytes(text.data(), text.size());
  }
  template <class T> void span(std::span<const T> elements) {
    number(std::uint64_t{elements.size()});
    bytes(elements.data(), elements.size_bytes());
  }
  /// A view of elements that may have gaps, without the gaps.
  template <class T, class View> void view(const View& elements) {
    number(std::uint64_t{elements.size()});
    if (!elements.has_gaps())
      bytes(elements.data(), elements.size() * sizeof(T));
    else
      for (std::size_t i = 0; i < elements.size(); ++i) {
        const T element = elements[i];
        bytes(&element, sizeof(element));
      }
  }

  std::string hex() const { return to_text(digester_.get()); }

 private:
  Digester digester_;
};

void add(Hasher& hasher, const build::TriangleMesh& mesh) {
  hasher.view<build::Position>(mesh.positions);
  hasher.view<build::Triangle>(mesh.triangles);
  hasher.number(mesh.mask);
  hasher.number(mesh.type);
  hasher.number(mesh.implicit_triangles);
  hasher.span(mesh.pairs);
  hasher.text(mesh.name);
}

void add(Hasher& hasher, const build::CustomGeometry& custom) {
  hasher.view<Box>(custom.boxes);
  hasher.number(custom.mask);
  hasher.number(custom.type);
  hasher.number(custom.shapes.kind);
  hasher.span(custom.shapes.points);
  hasher.span(custom.shapes.segments);
  hasher.number(custom.shapes.keys);
  hasher.text(custom.name);
}

void add(Hasher& hasher, const build::BuildOptions& options) {
  hasher.text(build::name(options.builder));
  hasher.number(options.nodes);
  hasher.number(options.split_budget.value_or(-1));
  hasher.number(options.presplit_budget);
  hasher.number(options.reinsertion_rounds.has_value());
  hasher.number(options.reinsertion_rounds.value_or(0));
  hasher.number(options.ploc_radius);
  hasher.number(options.max_leaf_triangles);
  hasher.number(options.pair_triangles);
  hasher.number(options.costs.box_node);
  hasher.number(options.costs.leaf);
  hasher.number(options.costs.custom);
  hasher.text(options.tool);
}

}  // namespace

std::string cache_key(const build::SceneInput& scene, const BuildRequest& request) {
  Hasher hasher;
  hasher.text("hiprt cache 1");
  hasher.number(kVersionMajor);
  hasher.number(kVersionMinor);
  hasher.text(build::version());
  hasher.text(build::embree_version());
  hasher.number(request.device);
  add(hasher, request.options);
  hasher.number(std::uint64_t{scene.meshes.size()});
  for (const build::TriangleMesh& mesh : scene.meshes) add(hasher, mesh);
  hasher.number(std::uint64_t{scene.customs.size()});
  for (const build::CustomGeometry& custom : scene.customs) add(hasher, custom);
  return hasher.hex();
}

}  // namespace hiprt::tools
