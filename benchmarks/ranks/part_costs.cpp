#include "part_costs.h"

#include "measured_costs.h"

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace hiprt::bench {
namespace {

using tools::Query;

/// Notes the calls for some paths.
class CallRecorder final : public tools::TourWatcher {
 public:
  explicit CallRecorder(VisitSums& visits) : all_visits_(visits) {}

  void start() {
    calls_ = {};
    left_ = processor_seconds();
  }

  PathCalls stop(double paths) {
    calls_.paths = paths;
    calls_.seconds = processor_seconds() - left_;
    return std::move(calls_);
  }

  void begin(Query, std::size_t rays) override {
    tours_.assign(rays, {});
    visits_.clear();
    visit_seconds_ = 0.0;
  }

  void begin_visit() override { visit_began_ = processor_seconds(); }

  void end_visit(const tools::RayTour::Parcel& parcel, const tools::PartAnswer& answer) override {
    const double seconds = processor_seconds() - visit_began_;
    visit_seconds_ += seconds;
    for (const std::uint32_t ray : parcel.numbers) tours_[ray].push_back(static_cast<std::uint16_t>(parcel.part));
    Sums& sums = visits_[static_cast<std::uint16_t>(parcel.part)];
    sums.rays += static_cast<double>(parcel.numbers.size());
    sums.hits += static_cast<double>(answer.hits.size());
    sums.seconds += seconds;
    all_visits_.seconds += seconds;
    all_visits_.rays += static_cast<double>(parcel.numbers.size());
    all_visits_.parcels += 1.0;
  }

  void end() override {
    const double now = processor_seconds();
    TraceCall& call = calls_.calls.emplace_back();
    call.seconds = now - left_ - visit_seconds_;
    call.rays = static_cast<double>(tours_.size());
    std::map<std::vector<std::uint16_t>, double> counts;
    for (std::vector<std::uint16_t>& tour : tours_)
      if (!tour.empty()) counts[std::move(tour)] += 1.0;
    for (const auto& [parts, rays] : counts) call.tours.push_back({parts, rays});
    for (const auto& [part, sums] : visits_)
      call.visits.push_back({part, sums.seconds / sums.rays, sums.hits / sums.rays});
    left_ = processor_seconds();
  }

 private:
  struct Sums {
    double rays = 0.0, hits = 0.0, seconds = 0.0;
  };

  VisitSums& all_visits_;
  PathCalls calls_;
  double left_ = 0.0;  ///< When the last call was left.
  double visit_began_ = 0.0, visit_seconds_ = 0.0;
  std::vector<std::vector<std::uint16_t>> tours_;
  std::map<std::uint16_t, Sums> visits_;
};

/// Seconds of @p work, the least of several rounds.
template <class Work> double least_seconds_of(const Work& work) {
  double least = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 20; ++round) {
    const double begin = processor_seconds();
    work();
    least = std::min(least, processor_seconds() - begin);
  }
  return least;
}

}  // namespace

build::Result<PartPictureCosts> measure_parts(tools::PartsEngine& engine, const tools::RenderCommand& command,
                                              std::uint32_t steps, VisitSums& visits) {
  CallRecorder recorder(visits);
  engine.exchange().watch(recorder);
  tools::PictureWork& work = engine.work();
  PartPictureCosts costs;
  costs.grid = tools::choose_grid(command.render.width, command.render.height, 1);
  costs.steps = command.render.samples;
  costs.levels = engine.exchange().manifest().levels;
  costs.pixel_bytes = work.pixel_bytes();
  for (std::uint32_t tile = 0; tile < costs.grid.tiles(); ++tile) {
    if (tools::interrupted()) return tools::cancelled();
    const tools::PictureUnit unit = costs.grid.unit(tile, 1, 0, steps);
    std::vector<std::byte> state(unit.pixels() * work.pixel_bytes());
    recorder.start();
    const auto rays = work.run(unit, state);
    costs.calls.push_back(recorder.stop(static_cast<double>(unit.pixels()) * steps));
    if (!rays) return tl::unexpected(rays.error());
    costs.calls_of_tile.push_back(tile);
  }
  return costs;
}

PartPictureCosts enlarged(const PartPictureCosts& measured, std::uint32_t width, std::uint32_t height,
                          std::uint32_t steps, unsigned workers) {
  PartPictureCosts costs = measured;
  costs.grid = tools::choose_grid(width, height, workers);
  costs.steps = steps;
  costs.calls_of_tile.clear();
  for (std::uint32_t tile = 0; tile < costs.grid.tiles(); ++tile)
    costs.calls_of_tile.push_back(measured.calls_of_tile[tile_of_view(costs.grid, tile, measured.grid)]);
  return costs;
}

ExchangeCosts measure_encoding(std::uint32_t levels) {
  constexpr std::uint32_t kRays = 4096;
  constexpr double kPerRay = 1.0 / kRays;
  const tools::PartQuestion question{0, 0, 1, Query::kClosest, std::vector<Ray>(kRays)};
  const std::vector<std::byte> question_bytes = encode(question);
  const auto answer_of = [&](tools::VisitResult result) {
    tools::PartAnswer answer{Query::kClosest, std::vector(kRays, result), {}, {}};
    if (result != tools::VisitResult::kHit) return answer;
    answer.hits.resize(kRays);
    answer.paths.resize(std::size_t{kRays} * levels);
    return answer;
  };
  const auto encoding = [&](const tools::PartAnswer& answer) {
    return kPerRay * least_seconds_of([&] { static_cast<void>(encode(1, answer)); });
  };
  const auto decoding = [&](const tools::PartAnswer& answer) {
    const std::vector<std::byte> bytes = encode(1, answer);
    return kPerRay * least_seconds_of([&] { static_cast<void>(tools::decode_answer(bytes, levels)); });
  };
  const tools::PartAnswer miss = answer_of(tools::VisitResult::kMiss), hit = answer_of(tools::VisitResult::kHit);
  ExchangeCosts costs;
  costs.home_ray = kPerRay * least_seconds_of([&] { static_cast<void>(encode(question)); }) + decoding(miss);
  costs.home_hit = std::max(0.0, decoding(hit) - decoding(miss));
  costs.owner_ray = kPerRay * least_seconds_of([&] { static_cast<void>(tools::decode_question(question_bytes, 1)); }) +
                    encoding(miss);
  costs.owner_hit = std::max(0.0, encoding(hit) - encoding(miss));
  return costs;
}

}  // namespace hiprt::bench
