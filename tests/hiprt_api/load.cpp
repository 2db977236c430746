// Loads the library at run time: all functions are found. The main file has the pointers.

// HIPRT gives the name.
#define _ENABLE_HIPRTEW
#include <hiprt/hiprtew.h>

#include <cstdio>

bool other_file_calls();

int main() {
  int result = HIPRTEW_NOT_INITIALIZED;
  hiprtewInit(&result);
  if (result != HIPRTEW_SUCCESS) return std::printf("hiprtewInit: %d\n", result);
  if (hiprtDestroyContext(nullptr) != hiprtErrorInvalidParameter || !other_file_calls()) return 1;
  std::puts("loaded");
  return 0;
}
