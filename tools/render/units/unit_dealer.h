#pragma once
/// Deals the units of a picture to ranks, and deals those of lost ranks again.
///
/// A tile is dealt to one rank at a time, and its steps go on from the state that the rank returns. So a result does
/// not depend on who computed it, or when. Units take about kUnitSeconds on the rank that gets them, by its measured
/// speed, and less towards the end (guided self-scheduling: Polychronopoulos and Kuck 1987).

#include <tools/render/units/picture_state.h>

#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace hiprt::tools {

class UnitDealer {
 public:
  /// Most seconds of a unit. A rank that is lost loses about twice that per worker.
  static constexpr double kUnitSeconds = 0.5;
  /// Least seconds: shorter units cost more for messages than they win by balance.
  static constexpr double kLeastSeconds = 0.02;

  /// @param done steps of every tile (PictureState::done). @param steps of a whole picture.
  UnitDealer(const PictureGrid& grid, std::uint32_t steps, std::span<const std::uint32_t> done, unsigned ranks);

  /// The rank takes part from now on. @param workers units that it computes at the same time, at least 1.
  void join(unsigned rank, unsigned workers);
  /// The rank takes part no more. Its units are dealt again.
  void leave(unsigned rank);

  /// @return a unit for the rank. Nothing: all tiles are finished or in work, or it has enough (two per worker).
  std::optional<PictureUnit> next(unsigned rank);
  /// A rank has computed a unit. @param seconds that it took.
  /// @return false: the unit is not in the rank's hands, for example because it was taken for lost.
  bool take(unsigned rank, const PictureUnit& unit, double seconds);

  bool finished() const { return left_ == 0; }
  /// 0 to 1.
  double fraction() const;

 private:
  struct Held {
    PictureUnit unit;
    std::uint32_t tile, tiles;
  };
  struct Rank {
    unsigned workers = 0;
    double speed = 0.0;  ///< Steps of pixels per second and worker; 0: unknown.
    std::vector<Held> held;
  };

  double work_of(const Rank& rank) const;
  void open(const Held& held);

  PictureGrid grid_;
  std::uint32_t steps_;
  std::vector<std::uint32_t> done_;
  /// Tiles with steps to do that no rank has: (steps done, tile). The least advanced one is dealt first, so that an
  /// interrupted picture is even.
  std::set<std::pair<std::uint32_t, std::uint32_t>> open_;
  std::vector<Rank> ranks_;
  std::uint64_t left_ = 0, all_;  ///< Steps of pixels.
};

}  // namespace hiprt::tools
