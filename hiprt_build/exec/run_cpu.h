#pragma once
/// Runs an operation on the CPU: with its threads, its memory ledger, and errors instead of exceptions. Internal.

#include <hiprt_build/error.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/format/out_of_memory.h>

#include <exception>
#include <new>
#include <string>
#include <type_traits>

namespace hiprt::build {

/// @param name of the operation in messages: "build", "refit".
/// @param threads 0, or more than the process may use: all that it may use.
/// @return operation(CpuEngine&), a Result; or kCancelled, kOutOfMemory, kBackend.
template <class Operation>
auto run_cpu(const char* name, unsigned threads, const ProgressCallback& progress, const Operation& operation)
    -> std::invoke_result_t<const Operation&, CpuEngine&> try {
  Monitor monitor(progress);
  MemoryLedger ledger;
  CpuEngine engine(monitor, ledger);
  return Threads::run(threads, [&] { return operation(engine); });
} catch (const Cancelled&) {
  return tl::unexpected(Error{ErrorCode::kCancelled, "the " + std::string(name) + " was cancelled"});
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(out_of_memory({"for the ", name}, failure));
} catch (const std::exception& exception) {
  return tl::unexpected(error_or_out_of_memory(ErrorCode::kBackend, exception.what()));
}

}  // namespace hiprt::build
