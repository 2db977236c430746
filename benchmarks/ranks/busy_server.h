#pragma once

#include <algorithm>

namespace hiprt::bench {

/// Something that does one thing at a time, in simulated time.
class BusyServer {
 public:
  /// @return when it is done with what comes at @p time and takes @p seconds.
  double serve(double time, double seconds) {
    free_ = std::max(free_, time) + seconds;
    busy_ += seconds;
    return free_;
  }
  double free() const { return free_; }
  double busy() const { return busy_; }

 private:
  double free_ = 0.0, busy_ = 0.0;
};

}  // namespace hiprt::bench
