#include <tools/scene_io/gltf/gltf_accessor.h>

#include <tools/base/errors.h>

#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>

namespace hiprt::tools {
namespace {

/// Elements in a buffer, all inside it.
struct Elements {
  const unsigned char* data = nullptr;
  std::uint64_t count = 0;
  std::uint64_t stride = 0;
};

template <class T> double component_as(const unsigned char* data, bool normalized) {
  T value;
  std::memcpy(&value, data, sizeof(T));
  const auto number = static_cast<double>(value);
  if (!normalized || !std::numeric_limits<T>::is_integer) return number;
  // glTF 2.0, 3.11: both ends of the signed range mean -1.
  return std::max(number / static_cast<double>(std::numeric_limits<T>::max()), -1.0);
}

double component(const unsigned char* data, int type, bool normalized) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return component_as<std::int8_t>(data, normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return component_as<std::uint8_t>(data, normalized);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return component_as<std::int16_t>(data, normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return component_as<std::uint16_t>(data, normalized);
    case TINYGLTF_COMPONENT_TYPE_INT:
      return component_as<std::int32_t>(data, normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return component_as<std::uint32_t>(data, normalized);
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return component_as<float>(data, normalized);
    default:
      return component_as<double>(data, normalized);
  }
}

class AccessorReader {
 public:
  AccessorReader(const tinygltf::Model& model, int index) : model_(model), index_(index) {}

  /// @return components * count values, in order.
  build::Result<std::vector<double>> read(int type, unsigned components) {
    if (index_ < 0 || static_cast<std::size_t>(index_) >= model_.accessors.size())
      return fail("it does not exist; there are " + std::to_string(model_.accessors.size()));
    const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index_)];
    if (accessor.type != type)
      return fail("it is not of type " + (components == 1   ? "SCALAR"
                                          : components <= 4 ? "VEC" + std::to_string(components)
                                                            : std::string("MAT4")));
    const int size = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
    if (size <= 0) return fail("unknown component type " + std::to_string(accessor.componentType));
    if (accessor.count > std::numeric_limits<std::uint32_t>::max())
      return fail("it has " + std::to_string(accessor.count) + " elements");
    component_type_ = accessor.componentType;
    normalized_ = accessor.normalized;
    components_ = components;
    const auto element_size = static_cast<std::uint64_t>(size) * components;
    std::vector<double> values;
    if (accessor.bufferView >= 0) {
      const auto elements = locate(accessor.bufferView, accessor.byteOffset, accessor.count, element_size, true);
      if (!elements) return tl::unexpected(elements.error());
      values.resize(accessor.count * components);
      for (std::uint64_t i = 0; i < accessor.count; ++i) decode(*elements, i, &values[i * components]);
    } else {
      if (auto checked = check_zeros(accessor.count); !checked) return tl::unexpected(checked.error());
      values.resize(accessor.count * components);
    }
    if (accessor.sparse.isSparse)
      if (auto done = substitute(accessor, element_size, values); !done) return tl::unexpected(done.error());
    return values;
  }

 private:
  tl::unexpected<build::Error> fail(const std::string& what) const {
    return invalid_input("accessor " + std::to_string(index_) + ": " + what);
  }

  /// Without a bufferView all elements are zeros (glTF 2.0, 3.6.2.2), however many the accessor says. Whatever uses
  /// them takes as many bytes elsewhere, if there are more than a few.
  build::Result<void> check_zeros(std::uint64_t count) const {
    constexpr std::uint64_t kFew = 4096;
    std::uint64_t bytes = 0;
    for (const tinygltf::Buffer& buffer : model_.buffers) bytes += buffer.data.size();
    if (count <= kFew + bytes) return {};
    return fail("it has no bufferView, so it is " + std::to_string(count) +
                " elements of zeros, but all buffers have only " + std::to_string(bytes) + " bytes");
  }

  build::Result<Elements> locate(int view_index, std::uint64_t offset, std::uint64_t count, std::uint64_t element_size,
                                 bool strided) const {
    if (view_index < 0 || static_cast<std::size_t>(view_index) >= model_.bufferViews.size())
      return fail("bufferView " + std::to_string(view_index) + " does not exist");
    const tinygltf::BufferView& view = model_.bufferViews[static_cast<std::size_t>(view_index)];
    if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model_.buffers.size())
      return fail("buffer " + std::to_string(view.buffer) + " does not exist");
    const std::vector<unsigned char>& data = model_.buffers[static_cast<std::size_t>(view.buffer)].data;
    if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
      return fail("bufferView " + std::to_string(view_index) + " ends behind its buffer's " +
                  std::to_string(data.size()) + " bytes");
    const std::uint64_t stride = strided && view.byteStride != 0 ? view.byteStride : element_size;
    if (count != 0) {
      const bool fits = offset <= view.byteLength && element_size <= view.byteLength - offset &&
                        count - 1 <= (view.byteLength - offset - element_size) / stride;
      if (!fits)
        return fail(std::to_string(count) + " elements of " + std::to_string(element_size) + " bytes, " +
                    std::to_string(stride) + " apart, from byte " + std::to_string(offset) +
                    " do not fit in bufferView " + std::to_string(view_index) + " of " +
                    std::to_string(view.byteLength) + " bytes");
    }
    return Elements{data.data() + view.byteOffset + (count != 0 ? offset : 0), count, stride};
  }

  void decode(const Elements& elements, std::uint64_t i, double* out) const {
    const auto size =
        static_cast<unsigned>(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(component_type_)));
    const unsigned char* element = elements.data + i * elements.stride;
    for (unsigned c = 0; c < components_; ++c) out[c] = component(element + c * size, component_type_, normalized_);
  }

  build::Result<void> substitute(const tinygltf::Accessor& accessor, std::uint64_t element_size,
                                 std::vector<double>& values) const {
    const auto& sparse = accessor.sparse;
    const int index_type = sparse.indices.componentType;
    const int index_size = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(index_type));
    // Offsets are int in tinygltf 2.8 and size_t in 2.9.
    if (sparse.count < 0 || std::cmp_less(sparse.indices.byteOffset, 0) || std::cmp_less(sparse.values.byteOffset, 0) ||
        index_size <= 0)
      return fail("its sparse part has a negative count or offset, or an unknown type");
    const auto count = static_cast<std::uint64_t>(sparse.count);
    const auto where = locate(sparse.indices.bufferView, static_cast<std::uint64_t>(sparse.indices.byteOffset), count,
                              static_cast<std::uint64_t>(index_size), false);
    if (!where) return tl::unexpected(where.error());
    const auto what = locate(sparse.values.bufferView, static_cast<std::uint64_t>(sparse.values.byteOffset), count,
                             element_size, false);
    if (!what) return tl::unexpected(what.error());
    for (std::uint64_t i = 0; i < count; ++i) {
      const double target = component(where->data + i * where->stride, index_type, false);
      if (!(target >= 0 && target < static_cast<double>(accessor.count)))
        return fail("sparse index " + std::to_string(i) + " is past its " + std::to_string(accessor.count) +
                    " elements");
      decode(*what, i, &values[static_cast<std::uint64_t>(target) * components_]);
    }
    return {};
  }

  const tinygltf::Model& model_;
  int index_;
  int component_type_ = 0;
  bool normalized_ = false;
  unsigned components_ = 1;
};

}  // namespace

build::Result<std::vector<build::Position>> read_positions(const tinygltf::Model& model, int index) {
  const auto values = AccessorReader(model, index).read(TINYGLTF_TYPE_VEC3, 3);
  if (!values) return tl::unexpected(values.error());
  std::vector<build::Position> positions(values->size() / 3);
  for (std::size_t i = 0; i < values->size(); ++i) positions[i / 3][i % 3] = static_cast<float>((*values)[i]);
  return positions;
}

build::Result<std::vector<double>> read_vectors(const tinygltf::Model& model, int index, unsigned components) {
  return AccessorReader(model, index)
      .read(components == 1   ? TINYGLTF_TYPE_SCALAR
            : components == 2 ? TINYGLTF_TYPE_VEC2
            : components == 3 ? TINYGLTF_TYPE_VEC3
                              : TINYGLTF_TYPE_VEC4,
            components);
}

build::Result<std::vector<Transform>> read_matrices(const tinygltf::Model& model, int index) {
  constexpr unsigned kNumbers = 16;
  const auto values = AccessorReader(model, index).read(TINYGLTF_TYPE_MAT4, kNumbers);
  if (!values) return tl::unexpected(values.error());
  std::vector<Transform> result(values->size() / kNumbers);
  for (std::size_t i = 0; i < result.size(); ++i)
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 4; ++column)
        result[i].m[row][column] = (*values)[kNumbers * i + 4 * column + row];
  return result;
}

build::Result<std::vector<std::uint32_t>> read_indices(const tinygltf::Model& model, int index) {
  const auto values = AccessorReader(model, index).read(TINYGLTF_TYPE_SCALAR, 1);
  if (!values) return tl::unexpected(values.error());
  std::vector<std::uint32_t> indices(values->size());
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const double value = (*values)[i];
    if (!(value >= 0 && value <= 4294967295.0 && value == static_cast<double>(static_cast<std::uint32_t>(value))))
      return invalid_input("accessor " + std::to_string(index) + ": element " + std::to_string(i) + " is " +
                           std::to_string(value) + ", not a vertex number");
    indices[i] = static_cast<std::uint32_t>(value);
  }
  return indices;
}

}  // namespace hiprt::tools
