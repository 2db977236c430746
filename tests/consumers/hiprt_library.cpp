// A host program of HIPRT. Without a GPU, a context is refused with an error.

#include <hiprt/hiprt.h>

int main() {
  const hiprtContextCreationInput input{};
  hiprtContext context = nullptr;
  const hiprtError status = hiprtCreateContext(HIPRT_API_VERSION, input, context);
  if (status == hiprtSuccess) return hiprtDestroyContext(context) == hiprtSuccess ? 0 : 1;
  return status == hiprtErrorInternal && context == nullptr ? 0 : 1;
}
