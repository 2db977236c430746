#include <hiprt_build/python/errors.h>

namespace hiprt::python {
namespace {

/// Name of the class in hiprt/_errors.py.
const char* class_of(build::ErrorCode code) {
  switch (code) {
    case build::ErrorCode::kInvalidInput:
    case build::ErrorCode::kTooLarge:
      return "InputError";
    case build::ErrorCode::kOutOfMemory:
      return "OutOfMemoryError";
    case build::ErrorCode::kCancelled:
      return "Cancelled";
    case build::ErrorCode::kIo:
      return "FileError";
    case build::ErrorCode::kBackend:
    case build::ErrorCode::kNoDevice:
    case build::ErrorCode::kGpu:
      return "GpuError";
  }
  return "Error";
}

void translate(const std::exception_ptr& thrown, void*) {
  try {
    std::rethrow_exception(thrown);
  } catch (const LibraryError& failure) {
    const nanobind::object type = nanobind::module_::import_("hiprt._errors").attr(class_of(failure.error().code));
    PyErr_SetString(type.ptr(), failure.what());
  }
}

}  // namespace

void register_errors() { nanobind::register_exception_translator(translate); }

}  // namespace hiprt::python
