#pragma once
/// The animations of a glTF file: where its nodes are at a time.

#include <hiprt_build/error.h>

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace tinygltf {
class Model;
struct AnimationSampler;
}  // namespace tinygltf

namespace hiprt::tools {

/// All animations of a file at once. If two of them move the same property of a node, the later one counts.
class Animation {
 public:
  /// @param model checked by check_gltf().
  /// @return kInvalidInput with the animation and channel:
  /// - a sampler or node that does not exist, or a node that has a matrix;
  /// - an unknown path or interpolation;
  /// - times that do not increase, or a wrong number of values.
  static build::Result<Animation> read(const tinygltf::Model& model);

  bool empty() const { return channels_.empty(); }
  /// Moves the nodes to their positions at a time in seconds, and sets their weights of morph targets. Before the first
  /// and after the last key a node rests.
  void pose(double seconds, tinygltf::Model& model) const;

  /// Names turns that motions between these times do not make, because rotations take the shorter arc from key to key.
  /// These are turns above 180 degrees between two times, and of 360 degrees between two keys of the file.
  void warn_of_turns(const std::vector<float>& times, std::vector<std::string>& warnings) const;

 private:
  enum class Path { kTranslation, kRotation, kScale, kWeight };
  enum class Interpolation { kStep, kLinear, kCubic };
  using Value = std::array<double, 4>;

  struct Channel {
    std::size_t node;
    Path path;
    Interpolation interpolation;
    std::vector<double> times;
    std::vector<double> values;  ///< components() per key; kCubic: tangent in, value, tangent out.
    std::string location;        ///< For messages.
    std::size_t target = 0;      ///< kWeight: number of the morph target.

    std::size_t components() const { return path == Path::kRotation ? 4 : path == Path::kWeight ? 1 : 3; }
    /// The angle of all its turns between two times, in radians.
    double turned(double from, double to) const;
    /// The first key after which it turns by 360 degrees within two keys: the same orientation, of the other sign.
    std::optional<std::size_t> whole_turn() const;
    /// Sets path and interpolation from glTF's names. @return what is wrong with them; empty if they are valid.
    std::string set_kind(const std::string& target_path, const std::string& sampler_interpolation);
    /// @return what is wrong with times and values; empty if they are valid.
    std::string fault_of_keys() const;
    /// @param which of the three values of kCubic; else 0.
    Value key(std::size_t i, unsigned which) const;
    Value at(double seconds) const;
  };

  /// Reads the weights of all morph targets, a channel for each.
  static build::Result<void> read_weights(const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                                          const Channel& like, std::vector<Channel>& channels);
  static build::Result<void> read_channel(const tinygltf::Model& model, std::size_t animation, std::size_t channel,
                                          std::vector<Channel>& channels);

  std::vector<Channel> channels_;
};

}  // namespace hiprt::tools
