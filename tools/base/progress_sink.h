#pragma once
/// How long work reports how far it is.

#include <functional>

namespace hiprt::tools {

/// Called with the name of the step and the finished fraction, 0 to 1, by one thread at a time. It may be called often.
using ProgressSink = std::function<void(const char* step, double fraction)>;

}  // namespace hiprt::tools
