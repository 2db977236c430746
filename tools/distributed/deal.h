#pragma once
/// Deals units of work to the ranks of a run, the most expensive first, one after the other as ranks get free.
///
///     const auto report = deal(ranks, costs, {}, work, collect);   // every rank makes this call
///
/// Every rank calls work(); rank 0 does it in a second thread. Only rank 0 needs costs and collect().

#include <tools/distributed/ranks.h>

#include <atomic>
#include <functional>

namespace hiprt::tools {

struct DealOptions {
  /// Units that a rank holds at a time. 1: a rank waits for a message between two units. 2: the next one is there.
  std::size_t ahead = 1;
  /// How often a unit is dealt again when its rank was lost, before it is given up. A unit may be what killed the rank,
  /// for example by its memory.
  unsigned retries = 1;
  /// Whether to go on after a rank was lost. If not, deal() then stops the other ranks and returns.
  bool lossy = false;
  bool first_works = true;  ///< Whether rank 0 works, too.
};

/// A unit in work.
class DealtUnit {
 public:
  DealtUnit(Ranks& ranks, const std::atomic<bool>& stop, std::uint32_t epoch, std::size_t unit)
      : ranks_(ranks), stop_(stop), epoch_(epoch), unit_(unit) {}

  std::size_t index() const { return unit_; }
  /// Whether the work should end early, with any error.
  bool must_stop() const { return stop_ || ranks_.must_stop(); }
  /// Sends a note to rank 0, for example how far the work is.
  void note(std::span<const std::byte> bytes) const;

 private:
  Ranks& ranks_;
  const std::atomic<bool>& stop_;
  std::uint32_t epoch_;
  std::size_t unit_;
};

/// @return the result. An error ends the whole run with it.
using DealWork = std::function<build::Result<std::vector<std::byte>>(const DealtUnit& unit)>;

/// What rank 0 is told, in its calling thread. All functions may be empty.
struct DealEvents {
  /// A result. Each unit comes once. An error ends the whole run with it.
  std::function<build::Result<void>(std::size_t unit, int rank, std::vector<std::byte> result)> collect{};
  std::function<void(std::size_t unit, int rank)> begun{};
  std::function<void(std::size_t unit, int rank, std::span<const std::byte> bytes)> note{};
  /// A rank was lost with these units.
  std::function<void(int rank, std::span<const std::size_t> units)> lost{};
  /// Called about every 100 ms. @return false: stop all ranks and return kCancelled.
  std::function<bool()> tick{};
};

struct DealReport {
  std::vector<int> lost_ranks;
  std::vector<std::size_t> not_done;  ///< Units without a result, in ascending order. Empty: all are done.
};

/// @param costs of all units, on rank 0: any unit of measure, only their order matters.
/// @return on rank 0 the report, also after lost ranks; the first error of work() or collect(); kCancelled. On other
/// ranks an empty report, kBackend if rank 0 is lost, or kCancelled if rank 0 stopped them.
build::Result<DealReport> deal(Ranks& ranks, std::span<const double> costs, const DealOptions& options,
                               const DealWork& work, const DealEvents& events);

}  // namespace hiprt::tools
