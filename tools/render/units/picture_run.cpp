#include <tools/render/units/picture_run.h>

#include <tools/base/interrupt.h>
#include <tools/render/units/unit_dealer.h>

#include <hiprt_build/exec/stopwatch.h>

#include <utility>

namespace hiprt::tools {
namespace {

/// Seconds that results of other ranks may lie, and that the loop sleeps.
constexpr double kTick = 0.001;
/// The same without other ranks.
constexpr double kLongTick = 0.05;

class PictureRun {
 public:
  PictureRun(PictureWork& work, PictureState& state, Crew* crew)
      : state_(state),
        crew_(crew),
        ranks_(crew == nullptr ? 1 : crew->ranks()),
        dealer_(state.grid, work.steps(), state.done, ranks_),
        pool_(work) {
    dealer_.join(0, work.workers());
    if (crew == nullptr) return;
    for (unsigned rank = 1; rank < ranks_; ++rank) dealer_.join(rank, crew->workers(rank));
  }

  bool finished() const { return dealer_.finished(); }
  double fraction() const { return dealer_.fraction(); }

  void deal() {
    for (unsigned rank = 0; rank < ranks_; ++rank)
      while (const auto unit = dealer_.next(rank)) {
        UnitJob job{*unit, state_.cut(*unit)};
        if (rank == 0)
          pool_.add(std::move(job));
        else
          crew_->send(rank, std::move(job));
      }
  }

  build::Result<void> collect() {
    for (UnitResult& result : pool_.wait(crew_ == nullptr ? kLongTick : kTick))
      if (auto taken = take(0, result); !taken) return taken;
    if (crew_ == nullptr) return {};
    auto events = crew_->poll();
    if (!events) return tl::unexpected(std::move(events.error()));
    for (CrewEvent& event : *events) {
      if (!event.result)
        dealer_.leave(event.rank);
      else if (auto taken = take(event.rank, *event.result); !taken)
        return taken;
    }
    return {};
  }

 private:
  build::Result<void> take(unsigned rank, UnitResult& result) {
    if (result.error) return tl::unexpected(std::move(*result.error));
    const PictureUnit& unit = result.job.unit;
    if (!dealer_.take(rank, unit, result.seconds)) return {};
    state_.paste(unit, result.job.state);
    state_.advance(unit);
    state_.rays += result.rays;
    return {};
  }

  PictureState& state_;
  Crew* crew_;
  unsigned ranks_;
  UnitDealer dealer_;
  UnitPool pool_;
};

}  // namespace

build::Result<bool> compute(PictureWork& work, PictureState& state, Crew* crew, Checkpoint* checkpoint,
                            const PictureHooks& hooks) {
  PictureRun run(work, state, crew);
  build::Stopwatch watch;
  bool told = false;
  while (!run.finished() && !interrupted()) {
    run.deal();
    if (auto collected = run.collect(); !collected) {
      // The error that ended the run is told, not one of the checkpoint.
      if (checkpoint != nullptr) static_cast<void>(checkpoint->write(state));
      return tl::unexpected(std::move(collected.error()));
    }
    state.seconds += watch.lap();
    if (hooks.fraction) hooks.fraction(run.fraction());
    if (hooks.step) hooks.step();
    if (checkpoint == nullptr) continue;
    const auto kept = checkpoint->keep(state);
    if (kept || told) continue;
    told = true;
    if (hooks.checkpoint_fault) hooks.checkpoint_fault(kept.error());
  }
  if (run.finished()) return true;
  if (checkpoint != nullptr)
    if (auto written = checkpoint->write(state); !written) return tl::unexpected(std::move(written.error()));
  return false;
}

}  // namespace hiprt::tools
