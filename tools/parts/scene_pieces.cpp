#include <tools/parts/scene_pieces.h>

#include <algorithm>
#include <utility>

namespace hiprt::tools {
namespace {

/// Groups are opened while they have more than this fraction of a part's memory, and until there are so many pieces.
constexpr std::uint64_t kPiecesOfPart = 8;
constexpr std::size_t kMostPiecesOfPart = 4096;

}  // namespace

ScenePieces::ScenePieces(const SceneDescription& scene, const SceneMap& map, std::size_t parts)
    : map_(map), most_(std::max(kMostPiecesOfPart * parts, scene.groups.back().instances.size())) {
  const std::uint64_t large = map.bytes_of_all() / (kPiecesOfPart * parts);
  add_all({{}, 0, {}}, scene.groups.back());
  // The largest first. Pieces that shine are opened down to the objects that do.
  while (!closed_.empty()) {
    std::pop_heap(closed_.begin(), closed_.end(), opens_later);
    const ScenePiece piece = std::move(closed_.back().piece);
    const bool shines = map.shines(piece.object), is_large = closed_.back().bytes > large;
    closed_.pop_back();
    const std::size_t inside = map.group(piece.object).instances.size();
    if (shines || (is_large && own.size() + closed_.size() + inside <= most_))
      add_all(piece, map.group(piece.object));
    else
      own.push_back(piece);
  }
  std::sort(own.begin(), own.end());
  std::sort(shared.begin(), shared.end());
}

void ScenePieces::add_all(const ScenePiece& outer, const SceneGroup& group) {
  for (std::uint32_t i = 0; i < group.instances.size(); ++i) {
    const build::Instance& instance = group.instances[i];
    ScenePiece piece{outer.path, instance.object, outer.to_scene * transform_of(instance)};
    piece.path.push_back(i);
    if (!map_.is_group(piece.object)) {
      (map_.shines(piece.object) ? shared : own).push_back(std::move(piece));
      continue;
    }
    closed_.push_back({map_.bytes(piece.object), std::move(piece)});
    std::push_heap(closed_.begin(), closed_.end(), opens_later);
  }
}

bool ScenePieces::opens_later(const Closed& a, const Closed& b) {
  return a.bytes != b.bytes ? a.bytes < b.bytes : b.piece < a.piece;
}

}  // namespace hiprt::tools
