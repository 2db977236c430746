#pragma once
/// Which units of work wait, run or are done, and on which rank. It sends nothing.

#include <cstddef>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace hiprt::tools {

class DealQueue {
 public:
  /// @param retries how often a unit is dealt again after the loss of its rank.
  DealQueue(std::span<const double> costs, int ranks, unsigned retries);

  /// Takes the most expensive unit that waits, for @p rank; of equal costs, the lowest number. Rank 0 gets units that
  /// cost a rank its life only when no other rank is left: its loss ends the run.
  std::optional<std::size_t> next(int rank);
  /// @return false: the unit is not in work on this rank.
  bool finish(int rank, std::size_t unit);
  /// The units of a lost rank wait again, or are given up. @return those units.
  std::vector<std::size_t> lose(int rank);

  std::size_t running(int rank) const { return running_[static_cast<std::size_t>(rank)].size(); }
  bool is_lost(int rank) const { return lost_[static_cast<std::size_t>(rank)] != 0; }
  /// Whether a rank besides rank 0 lives.
  bool others_live() const;
  /// Whether every unit is done or given up.
  bool ended() const { return open_ == 0; }
  /// Units without a result, in ascending order.
  std::vector<std::size_t> not_done() const;

 private:
  using Waiting = std::set<std::pair<double, std::size_t>>;  ///< Negated cost, then number.

  std::vector<double> costs_;
  Waiting fresh_, retried_;
  std::vector<std::set<std::size_t>> running_;
  std::vector<char> lost_, done_;
  std::vector<unsigned> losses_;
  unsigned retries_;
  std::size_t open_;
};

}  // namespace hiprt::tools
