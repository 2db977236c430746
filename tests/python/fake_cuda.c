/* A CUDA driver without a GPU, for test_gpu_driver.py: memory is the host's, kernels do nothing. It counts what lives,
   and its events are reached when the test says so. */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { kNotReady = 600, kMost = 256 };
static int contexts, memories, events, launches, is_finished, waits;
static void *launch_stream, *wait_stream[kMost];

int fake_contexts(void) { return contexts; }
int fake_memories(void) { return memories; }
int fake_events(void) { return events; }
int fake_launches(void) { return launches; }
uintptr_t fake_launch_stream(void) { return (uintptr_t)launch_stream; }
int fake_waits(void) { return waits; }
uintptr_t fake_wait_stream(int i) { return (uintptr_t)wait_stream[i]; }
void fake_finish(int finished) { is_finished = finished; }

int cuInit(unsigned flags) { return (int)flags; }
int cuDeviceGetCount(int* count) { return *count = 1, 0; }
int cuDevicePrimaryCtxRetain(void** context, int device) { return *context = (void*)(uintptr_t)(device + 1), 0; }
int cuCtxPushCurrent_v2(void* context) { return contexts++, context == NULL; }
int cuCtxPopCurrent_v2(void** context) { return contexts--, *context = NULL, 0; }
int cuDeviceGetAttribute(int* value, int attribute, int device) { return *value = attribute == 75 ? 9 : 0, device; }
int cuGetErrorName(int status, const char** text) { return *text = "FAKE", status == 0; }
int cuPointerGetAttribute(void* value, int attribute, uintptr_t memory) {
  *(int*)value = 0;
  return attribute != 9 || memory == 0;
}
int cuMemAlloc_v2(void** memory, size_t bytes) {
  *memory = aligned_alloc(256, (bytes + 255) / 256 * 256);
  memories++;
  return contexts == 0 || *memory == NULL;
}
int cuMemFree_v2(void* memory) { return free(memory), memories--, 0; }
int cuMemcpyHtoDAsync_v2(void* to, const void* from, size_t bytes, void* stream) {
  (void)stream;
  return memcpy(to, from, bytes), 0;
}
int cuStreamCreate(void** stream, unsigned flags) { return *stream = (void*)0x77, flags != 1; }
int cuStreamSynchronize(void* stream) { return (void)stream, 0; }
int cuCtxSynchronize(void) { return contexts == 0; }
int cuEventCreate(void** event, unsigned flags) { return *event = malloc(8), events++, flags != 2; }
int cuEventDestroy_v2(void* event) { return free(event), events--, 0; }
int cuEventRecord(void* event, void* stream) { return (void)event, (void)stream, 0; }
int cuEventQuery(void* event) { return (void)event, is_finished ? 0 : kNotReady; }
int cuEventSynchronize(void* event) { return (void)event, 0; }
int cuStreamWaitEvent(void* stream, void* event, unsigned flags) {
  (void)event;
  wait_stream[waits++ % kMost] = stream;
  return (int)flags;
}
int cuModuleLoadData(void** module, const void* code) {
  *module = (void*)1;
  return memcmp(code,
                "\x7f"
                "ELF",
                4) != 0;
}
int cuModuleGetFunction(void** function, void* module, const char* name) {
  *function = (void*)2;
  return module == NULL || strcmp(name, "hiprt_query") != 0;
}
int cuLaunchKernel(void* function, unsigned x, unsigned y, unsigned z, unsigned threads, unsigned b, unsigned c,
                   unsigned shared, void* stream, void** arguments, void** extra) {
  const unsigned long long size = *(unsigned long long*)arguments[2];
  (void)function, (void)extra;
  launches++;
  launch_stream = stream;
  return contexts != 1 || x != (size + threads - 1) / threads || y * z * b * c != 1 || shared != 0;
}
