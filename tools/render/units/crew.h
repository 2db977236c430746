#pragma once
/// The other ranks that compute units of a picture.

#include <tools/render/units/unit_pool.h>

#include <optional>
#include <string>
#include <vector>

namespace hiprt::tools {

/// What happened to a rank.
struct CrewEvent {
  unsigned rank;
  std::optional<UnitResult> result;  ///< Nothing: the rank is lost.
};

/// Ranks are numbered from 1; 0 is this process.
class Crew {
 public:
  Crew() = default;
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;
  virtual ~Crew() = default;

  /// Number of ranks with this process.
  virtual unsigned ranks() const = 0;
  /// Units that a rank computes at the same time; 0: it is lost, or takes no part.
  virtual unsigned workers(unsigned rank) const = 0;
  /// Gives a rank a job. A rank that is lost by then ignores it.
  virtual void send(unsigned rank, UnitJob job) = 0;
  /// @return what happened since the last call, without waiting. An error ends the run.
  virtual build::Result<std::vector<CrewEvent>> poll() = 0;
};

}  // namespace hiprt::tools
