#pragma once
/// Connects the builder's progress callback with a progress sink and with Ctrl-C.

#include <tools/base/interrupt.h>
#include <tools/base/progress_sink.h>

#include <hiprt_build/build.h>

#include <utility>

namespace hiprt::tools {

/// @return a callback that reports to @p sink and cancels the build after an interruption.
inline build::ProgressCallback build_progress(ProgressSink sink) {
  return [sink = std::move(sink)](const build::Progress& progress) {
    sink(progress.step, progress.fraction);
    return !interrupted();
  };
}

}  // namespace hiprt::tools
