#pragma once
/// Work whose result shows every wrong, missing, repeated or misplaced step, and ranks that fail.

#include <tests/oracle/random.h>
#include <tools/render/units/crew.h>
#include <tools/render/units/picture_state.h>

#include <algorithm>
#include <cstring>
#include <deque>

namespace hiprt::test {

/// The state of a pixel is a hash of its place and its steps in their order.
class HashWork : public tools::PictureWork {
 public:
  HashWork(std::uint32_t steps, unsigned workers) : steps_(steps), workers_(workers) {}

  std::uint32_t steps() const override { return steps_; }
  std::size_t pixel_bytes() const override { return sizeof(std::uint64_t); }
  unsigned workers() const override { return workers_; }
  build::Result<tools::RayCounts> run(const tools::PictureUnit& unit, std::span<std::byte> state) override {
    for (std::uint32_t y = 0; y < unit.height; ++y)
      for (std::uint32_t x = 0; x < unit.width; ++x) {
        std::byte* const at = state.data() + (std::size_t{y} * unit.width + x) * sizeof(std::uint64_t);
        std::uint64_t value = 0;
        if (unit.first != 0) std::memcpy(&value, at, sizeof(value));
        for (std::uint32_t s = 0; s < unit.steps; ++s) value = step(value, unit.left + x, unit.top + y, unit.first + s);
        std::memcpy(at, &value, sizeof(value));
      }
    tools::RayCounts rays;
    rays.primary = unit.pixels() * unit.steps;
    return rays;
  }

  /// The pixels of a whole picture, one after the other.
  std::vector<std::byte> whole(std::uint32_t width, std::uint32_t height) const {
    std::vector<std::byte> pixels(std::size_t{width} * height * sizeof(std::uint64_t));
    for (std::uint32_t y = 0; y < height; ++y)
      for (std::uint32_t x = 0; x < width; ++x) {
        std::uint64_t value = 0;
        for (std::uint32_t s = 0; s < steps_; ++s) value = step(value, x, y, s);
        std::memcpy(pixels.data() + (std::size_t{y} * width + x) * sizeof(value), &value, sizeof(value));
      }
    return pixels;
  }

 private:
  static std::uint64_t step(std::uint64_t value, std::uint32_t x, std::uint32_t y, std::uint32_t s) {
    return oracle::Random(value ^ (std::uint64_t{x} << 40) ^ (std::uint64_t{y} << 20) ^ s).bits();
  }

  std::uint32_t steps_;
  unsigned workers_;
};

/// Ranks that compute in poll(), in any order, some results late. Each but this process may be lost once.
class FailingCrew : public tools::Crew {
 public:
  FailingCrew(HashWork& work, unsigned ranks, std::uint64_t seed, double loss)
      : work_(work), random_(seed), loss_(loss), workers_(ranks), jobs_(ranks) {
    for (unsigned& workers : workers_) workers = 1 + random_.below(4);
  }

  unsigned ranks() const override { return static_cast<unsigned>(workers_.size()); }
  unsigned workers(unsigned rank) const override { return workers_[rank]; }
  unsigned lost() const { return lost_; }
  void send(unsigned rank, tools::UnitJob job) override { jobs_[rank].push_back(std::move(job)); }

  build::Result<std::vector<tools::CrewEvent>> poll() override {
    std::vector<tools::CrewEvent> events;
    for (unsigned rank = 1; rank < ranks(); ++rank) {
      // What a lost rank sent before its loss was noticed arrives behind the news.
      const bool loses = workers_[rank] != 0 && !jobs_[rank].empty() && random_.unit() < loss_;
      if (loses) {
        workers_[rank] = 0;
        ++lost_;
        events.push_back({rank, std::nullopt});
      }
      if (workers_[rank] == 0 && !loses) {
        jobs_[rank].clear();
        continue;
      }
      while (!jobs_[rank].empty() && random_.coin()) events.push_back({rank, take(rank)});
    }
    return events;
  }

 private:
  tools::UnitResult take(unsigned rank) {
    auto& jobs = jobs_[rank];
    const auto at = jobs.begin() + random_.below(static_cast<std::uint32_t>(jobs.size()));
    tools::UnitResult result{std::move(*at), {}, random_.log_uniform(1e-6, 1.0), {}};
    jobs.erase(at);
    result.rays = *work_.run(result.job.unit, result.job.state);
    return result;
  }

  HashWork& work_;
  oracle::Random random_;
  double loss_;
  std::vector<unsigned> workers_;
  std::vector<std::deque<tools::UnitJob>> jobs_;
  unsigned lost_ = 0;
};

}  // namespace hiprt::test
