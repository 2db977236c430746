#include <tools/base/gpu_code.h>

namespace hiprt::tools {

const char* gpu_code_summary() { return HIPRT_GPU_CODE_SUMMARY; }

}  // namespace hiprt::tools
