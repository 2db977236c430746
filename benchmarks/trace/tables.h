#pragma once
/// All measurements together: means and tables.

#include "side_by_side.h"

#include <string>
#include <vector>

namespace hiprt::bench {

/// The measurements in order. A cell that is measured again replaces the old one.
class Cells {
 public:
  void add(Cell cell);
  const std::vector<Cell>& all() const { return cells_; }
  /// Scenes that have a cell, in order.
  std::vector<std::string> scenes() const;
  std::vector<const Cell*> of(const std::string& scene) const;

  /// Geometric mean of an entry's ratio over the scene's kinds of rays. NaN: nothing measured.
  double mean_ratio(const std::string& scene, const std::string& entry) const;
  /// Geometric mean of the scenes' means, over the scenes from files. Without such scenes: over all.
  double mean_ratio(const std::string& entry) const;

 private:
  std::vector<Cell> cells_;
};

/// Tables in Markdown.
std::string trace_markdown(const Cells& cells, unsigned rounds);

}  // namespace hiprt::bench
