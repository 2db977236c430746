#pragma once
/// The pieces that a scene is divided into parts by.

#include <tools/parts/scene_map.h>

namespace hiprt::tools {

/// The scene's instances, and the instances of groups that are too large to stay whole or that emit.
class ScenePieces {
 public:
  /// @param parts that the pieces will be divided into.
  ScenePieces(const SceneDescription& scene, const SceneMap& map, std::size_t parts);

  std::vector<ScenePiece> own;     ///< Without light. Ascending.
  std::vector<ScenePiece> shared;  ///< Objects that emit light. Ascending.

 private:
  struct Closed {
    std::uint64_t bytes;
    ScenePiece piece;
  };

  void add_all(const ScenePiece& outer, const SceneGroup& group);
  static bool opens_later(const Closed& a, const Closed& b);

  const SceneMap& map_;
  std::size_t most_;
  std::vector<Closed> closed_;  ///< Groups, as a heap.
};

}  // namespace hiprt::tools
