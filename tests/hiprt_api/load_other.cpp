// Another file of a program with hiprtew.h.

#include <hiprt/hiprtew.h>

bool other_file_calls() {
  hiprtContext context = nullptr;
  const hiprtContextCreationInput input{};
  return hiprtCreateContext(1, input, context) == hiprtErrorInvalidApiVersion &&
         hiprtCompactScenes(nullptr, 0, nullptr, nullptr, nullptr) == hiprtErrorInvalidParameter;
}
