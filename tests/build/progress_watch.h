#pragma once
/// Checks a progress callback: fractions rise and end at 1 or less, and each step has a name.

#include <hiprt_build/build.h>

#include <tests/catch.h>

#include <set>
#include <string>

namespace hiprt::test {

/// Outlives the work that it watches.
class ProgressWatch {
 public:
  /// Lets the work go on.
  build::ProgressCallback callback() {
    return [this](const build::Progress& progress) {
      CHECK(progress.fraction >= last_);
      CHECK(progress.fraction <= 1);
      last_ = progress.fraction;
      steps_.insert(progress.step);
      ++calls_;
      return true;
    };
  }

  double last() const { return last_; }
  unsigned calls() const { return calls_; }
  const std::set<std::string>& steps() const { return steps_; }

 private:
  double last_ = 0;
  unsigned calls_ = 0;
  std::set<std::string> steps_;
};

}  // namespace hiprt::test
