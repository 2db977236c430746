#pragma once
/// One scene: everybody builds in turn, then traces the same rays in turn.

#include "record.h"

#include <hiprt_build/error.h>

#include <functional>
#include <string>
#include <vector>

namespace hiprt::bench {

struct ContestOptions {
  std::vector<std::string> builders{"lbvh", "ploc", "hploc", "sah", "sbvh", "hq"};  ///< Of tools::kBuilders.
  std::vector<std::string> peers = embree_modes();  ///< Of embree_modes(); on a CPU only.
  std::vector<std::string> forms = form_names();    ///< deep: of scenes that have more than one level.
  Picture picture;
  unsigned build_rounds = 3, rounds = 5;
  unsigned most_triangles =
      16'000'000;  ///< Of the flat form: each takes some 700 bytes of memory in all trees together.
  /// Rays in a million that may differ: of our tracer in any form, and of Embree's robust mode in the flat one.
  unsigned most_differing = 300;
};

/// @param progress is told of a step (a string literal) and its finished fraction.
/// @return what was measured, what could not be (a device or Embree cannot do it, or there is too little memory), and
/// wrong answers; other errors.
build::Result<SceneRecord> run_contest(const SourceScene& scene, const ContestOptions& options, const Machine& machine,
                                       const std::function<void(const char* step, double fraction)>& progress);

}  // namespace hiprt::bench
