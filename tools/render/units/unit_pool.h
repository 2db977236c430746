#pragma once
/// The threads of a process that compute units of a picture.

#include <tools/render/units/picture_work.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace hiprt::tools {

struct UnitJob {
  PictureUnit unit;
  std::vector<std::byte> state;  ///< Of the unit's pixels.
};

struct UnitResult {
  UnitJob job;  ///< With the state after the unit.
  RayCounts rays;
  double seconds = 0.0;
  std::optional<build::Error> error;
};

class UnitPool {
 public:
  /// @param work must live as long as this.
  explicit UnitPool(PictureWork& work);
  UnitPool(const UnitPool&) = delete;
  UnitPool& operator=(const UnitPool&) = delete;
  /// Drops jobs that wait, and waits for those in work.
  ~UnitPool();

  void add(UnitJob job);
  /// @return what was computed since the last call, after at most @p seconds. Units that an interruption cut off are
  /// left out.
  std::vector<UnitResult> wait(double seconds);

 private:
  void compute();

  PictureWork& work_;
  std::mutex mutex_;
  std::condition_variable changed_, computed_;
  std::deque<UnitJob> jobs_;
  std::vector<UnitResult> results_;
  bool stop_ = false;
  std::vector<std::jthread> threads_;
};

}  // namespace hiprt::tools
