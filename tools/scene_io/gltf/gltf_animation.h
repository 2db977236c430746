#pragma once
/// The animations of a glTF file: where its nodes are at a time.

#include <hiprt_build/error.h>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace tinygltf {
class Model;
}

namespace hiprt::tools {

/// All animations of a file at once. If two of them move the same property of a node, the later one counts. Weights of
/// morph targets are not read.
class Animation {
 public:
  /// @param model checked by check_gltf().
  /// @return kInvalidInput with the animation and channel:
  /// - a sampler or node that does not exist, or a node that has a matrix;
  /// - an unknown path or interpolation;
  /// - times that do not increase, or a wrong number of values.
  static build::Result<Animation> read(const tinygltf::Model& model);

  bool empty() const { return channels_.empty(); }
  /// Moves the nodes to their positions at a time in seconds. Before the first and after the last key a node rests.
  void pose(double seconds, tinygltf::Model& model) const;

 private:
  enum class Path { kTranslation, kRotation, kScale };
  enum class Interpolation { kStep, kLinear, kCubic };
  using Value = std::array<double, 4>;

  struct Channel {
    std::size_t node;
    Path path;
    Interpolation interpolation;
    std::vector<double> times;
    std::vector<double> values;  ///< 3 or 4 per key; kCubic: tangent in, value, tangent out.

    std::size_t components() const { return path == Path::kRotation ? 4 : 3; }
    /// Sets path and interpolation from glTF's names. @return what is wrong with them; empty if they are valid.
    std::string set_kind(const std::string& target_path, const std::string& sampler_interpolation);
    /// @return what is wrong with times and values; empty if they are valid.
    std::string fault_of_keys() const;
    /// @param which of the three values of kCubic; else 0.
    Value key(std::size_t i, unsigned which) const;
    Value at(double seconds) const;
  };

  static build::Result<void> read_channel(const tinygltf::Model& model, std::size_t animation, std::size_t channel,
                                          std::vector<Channel>& channels);

  std::vector<Channel> channels_;
};

}  // namespace hiprt::tools
