#pragma once
/// Loops over batches on several threads.

#include <cstddef>
#include <functional>

namespace hiprt::tools {

/// Calls @p body(begin, end) for batches that cover [0, count) once, on up to @p threads threads (0: as many as the
/// machine has). Batches are started in no particular order.
/// @return false when interrupted() became true: batches may be missing then.
bool parallel_batches(std::size_t count, std::size_t batch, unsigned threads,
                      const std::function<void(std::size_t begin, std::size_t end)>& body);

}  // namespace hiprt::tools
