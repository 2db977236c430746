#pragma once
/// Records the streams of the runtime's calls. The linker puts the recorder between the program and the HIP or CUDA
/// runtime (--wrap, see CMakeLists.txt).

#include <hiprt_build/gpu/hip.h>

#include <string>
#include <vector>

namespace hiprt::checks {

/// A call that was made while recording. Those without a stream (hipMemcpy, hipDeviceSynchronize, hipSetDevice), which
/// hiprt must not make, have the stream kNoStream.
struct Call {
  std::string name;  ///< Without "hip" or "cuda".
  hipStream_t stream;
};
inline const hipStream_t kNoStream = reinterpret_cast<hipStream_t>(-1);

/// Records from now on, until taken().
void start_recording();
/// @return the calls since start_recording(), in order; ends it.
std::vector<Call> taken();

/// The next call of that name (without "hip") does nothing and returns @p status.
void fail_next(const char* name, hipError_t status);

/// Counts the calls that may fail from now on: allocations, copies, fills, launches, events, waits, and questions about
/// devices and memory. Call @p number
/// does nothing and fails: allocations with hipErrorOutOfMemory, others with @p status. The first one has number 1, and
/// 0 lets none fail.
void fail_call(unsigned number, hipError_t status = hipErrorUnknown);
/// Lets no more calls fail. @return how many there were since fail_call().
unsigned calls_that_may_fail();

/// A new stream, not the default stream.
class Stream {
 public:
  Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream() { static_cast<void>(hipStreamDestroy(stream_)); }
  operator hipStream_t() const { return stream_; }

 private:
  hipStream_t stream_ = nullptr;
};

}  // namespace hiprt::checks
