#pragma once
/// All cells together: means, and tables for people.

#include "side_by_side.h"

#include <string>
#include <vector>

namespace hiprt::bench {

/// What was measured so far, in order; a cell that is measured again replaces the old one.
class Cells {
 public:
  void add(Cell cell);
  const std::vector<Cell>& all() const { return cells_; }
  /// Scenes with a cell, in order.
  std::vector<std::string> scenes() const;
  std::vector<const Cell*> of(const std::string& scene) const;

  /// Geometric mean of an entry's ratio over the scene's kinds of rays. NaN: nothing measured.
  double mean_ratio(const std::string& scene, const std::string& entry) const;
  /// Geometric mean of the scenes' means: of the scenes from files, or of all if there are none.
  double mean_ratio(const std::string& entry) const;

 private:
  std::vector<Cell> cells_;
};

/// Tables in Markdown.
std::string trace_markdown(const Cells& cells, unsigned rounds);

}  // namespace hiprt::bench
