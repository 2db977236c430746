#include <tools/render/units/unit_dealer.h>

#include <algorithm>
#include <cmath>

namespace hiprt::tools {

UnitDealer::UnitDealer(const PictureGrid& grid, std::uint32_t steps, std::span<const std::uint32_t> done,
                       unsigned ranks)
    : grid_(grid),
      steps_(steps),
      done_(done.begin(), done.end()),
      ranks_(ranks),
      all_(std::uint64_t{grid.width} * grid.height * steps) {
  for (std::uint32_t tile = 0; tile < grid.tiles(); ++tile) {
    if (done_[tile] == steps) continue;
    open_.emplace(done_[tile], tile);
    left_ += grid.unit(tile, 1, 0, 0).pixels() * (steps - done_[tile]);
  }
}

void UnitDealer::join(unsigned rank, unsigned workers) { ranks_[rank].workers = workers; }

void UnitDealer::leave(unsigned rank) {
  for (const Held& held : ranks_[rank].held) open(held);
  ranks_[rank] = {};
}

/// @return how many steps of pixels the rank's next unit should have.
double UnitDealer::work_of(const Rank& rank) const {
  if (rank.speed == 0.0) return 1.0;
  double together = 0.0;
  for (const Rank& other : ranks_) together += other.workers * (other.speed > 0.0 ? other.speed : rank.speed);
  // A worker has two units at hand: a quarter of the time that is left is half of it for both.
  const double seconds = std::clamp(static_cast<double>(left_) / together / 4.0, kLeastSeconds, kUnitSeconds);
  return seconds * rank.speed;
}

std::optional<PictureUnit> UnitDealer::next(unsigned number) {
  Rank& rank = ranks_[number];
  if (open_.empty() || rank.held.size() >= std::size_t{2} * rank.workers) return std::nullopt;
  const auto [done, tile] = *open_.begin();
  const double work = work_of(rank), tile_pixels = static_cast<double>(grid_.unit(tile, 1, 0, 0).pixels());
  const std::uint32_t left = steps_ - done;
  const auto steps =
      static_cast<std::uint32_t>(std::clamp(std::floor(work / tile_pixels), 1.0, static_cast<double>(left)));
  std::uint32_t tiles = 0;
  // More tiles of the row, where all that is left of one is too little.
  const auto most = steps < left ? 1.0 : std::max(1.0, std::floor(work / (tile_pixels * left)));
  while (tiles < most && (tiles == 0 || (tile + tiles) % grid_.columns() != 0) &&
         open_.erase({done, tile + tiles}) != 0)
    ++tiles;
  rank.held.push_back({grid_.unit(tile, tiles, done, steps), tile, tiles});
  return rank.held.back().unit;
}

bool UnitDealer::take(unsigned number, const PictureUnit& unit, double seconds) {
  Rank& rank = ranks_[number];
  const auto found = std::ranges::find(rank.held, unit, &Held::unit);
  if (found == rank.held.end()) return false;
  for (std::uint32_t i = 0; i < found->tiles; ++i) done_[found->tile + i] += unit.steps;
  open(*found);
  rank.held.erase(found);
  const double work = static_cast<double>(unit.pixels()) * unit.steps;
  left_ -= unit.pixels() * unit.steps;
  const double speed = work / std::max(seconds, 1e-6);
  rank.speed = rank.speed == 0.0 ? speed : 0.5 * (rank.speed + speed);
  return true;
}

void UnitDealer::open(const Held& held) {
  for (std::uint32_t tile = held.tile; tile < held.tile + held.tiles; ++tile)
    if (done_[tile] < steps_) open_.emplace(done_[tile], tile);
}

double UnitDealer::fraction() const { return 1.0 - static_cast<double>(left_) / static_cast<double>(all_); }

}  // namespace hiprt::tools
