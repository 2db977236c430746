#include <tools/distributed/deal_queue.h>

#include <algorithm>

namespace hiprt::tools {

DealQueue::DealQueue(std::span<const double> costs, int ranks, unsigned retries)
    : costs_(costs.begin(), costs.end()),
      running_(static_cast<std::size_t>(ranks)),
      lost_(running_.size()),
      done_(costs.size()),
      losses_(costs.size()),
      retries_(retries),
      open_(costs.size()) {
  for (std::size_t i = 0; i < costs_.size(); ++i) fresh_.emplace(-costs_[i], i);
}

bool DealQueue::others_live() const { return std::find(lost_.begin() + 1, lost_.end(), 0) != lost_.end(); }

std::optional<std::size_t> DealQueue::next(int rank) {
  const bool may_retry = rank != 0 || !others_live();
  Waiting* from = &fresh_;
  if (may_retry && !retried_.empty() && (fresh_.empty() || *retried_.begin() < *fresh_.begin())) from = &retried_;
  if (from->empty()) return std::nullopt;
  const std::size_t unit = from->begin()->second;
  from->erase(from->begin());
  running_[static_cast<std::size_t>(rank)].insert(unit);
  return unit;
}

bool DealQueue::finish(int rank, std::size_t unit) {
  if (running_[static_cast<std::size_t>(rank)].erase(unit) == 0) return false;
  done_[unit] = 1;
  --open_;
  return true;
}

std::vector<std::size_t> DealQueue::lose(int rank) {
  std::set<std::size_t>& running = running_[static_cast<std::size_t>(rank)];
  lost_[static_cast<std::size_t>(rank)] = 1;
  std::vector<std::size_t> units(running.begin(), running.end());
  running.clear();
  for (const std::size_t unit : units) {
    if (++losses_[unit] <= retries_)
      retried_.emplace(-costs_[unit], unit);
    else
      --open_;
  }
  return units;
}

std::vector<std::size_t> DealQueue::not_done() const {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < done_.size(); ++i)
    if (done_[i] == 0) result.push_back(i);
  return result;
}

}  // namespace hiprt::tools
