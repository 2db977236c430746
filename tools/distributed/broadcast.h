#pragma once
/// The bytes of rank 0 on other ranks.

#include <tools/distributed/ranks.h>

namespace hiprt::tools {

/// Sends @p bytes of rank 0 to the ranks @p to; all ranks make the same call. Rank 0 sends to each rank separately: it
/// needs no rank in between that could be lost.
/// @param bytes on rank 0; ignored elsewhere.
/// @return the bytes on rank 0 and on the ranks @p to, else nothing. kBackend if rank 0 is lost.
build::Result<SharedBytes> broadcast(Ranks& ranks, SharedBytes bytes, std::span<const int> to);

/// Waits until all ranks that live have made this call.
build::Result<void> wait_for_all(Ranks& ranks);

}  // namespace hiprt::tools
