#pragma once
/// Loops on many threads: oneTBB's, or std::thread's where there is no oneTBB (CMake variable HIPRT_THREADS). Internal.
///
///     Threads::count()                       threads that the process may use
///     Threads::run(threads, body)            body(), whose loops use at most that many threads; 0: all
///     Threads::for_each(n, body)             body(i) for i in [0, n), in any order
///     Threads::invoke(first, second)         both, at the same time if a thread is free
///     Threads::reduce(n, chunk, none, sum, combine)
///                                            combines sum(begin, end, so_far) over parts of [0, n) of about chunk
///
/// They can be nested, and pass on one of the exceptions that bodies throw; other bodies may be left out then. The
/// results of reduce() must not depend on how the range is parted.

#if HIPRT_STD_THREADS
#include <hiprt_build/exec/threads_std.h>
#else
#include <hiprt_build/exec/threads_tbb.h>
#endif

namespace hiprt::build {

#if HIPRT_STD_THREADS
using Threads = StdThreads;
#else
using Threads = TbbThreads;
#endif

}  // namespace hiprt::build
