#pragma once
/// Arrays that the module fills. Python has allocated them, or the module does.

#include <hiprt_build/python/errors.h>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <string>

namespace hiprt::python {

/// An array without gaps that the caller has allocated.
using OutputArray = nanobind::ndarray<nanobind::c_contig, nanobind::device::cpu>;

/// The memory of an output. Refuses arrays of another type or size.
template <class T> T* data_of(const OutputArray& array, const char* name, std::size_t size) {
  if (array.dtype() != nanobind::dtype<T>() || array.size() != size)
    refuse(std::string(name) + ": the output has another type, or another size than " + std::to_string(size));
  return static_cast<T*>(array.data());
}

/// Memory that becomes an array.
template <class T> class NewArray {
 public:
  /// Not initialised.
  explicit NewArray(std::size_t size) : memory_(new T[size == 0 ? 1 : size]) {}
  T* data() { return memory_.get(); }
  /// The array, which owns the memory from then on. @pre the calling thread holds the GIL.
  nanobind::ndarray<nanobind::numpy, T> release(std::initializer_list<std::size_t> shape) {
    T* const data = memory_.release();
    const nanobind::capsule owner(data, [](void* memory) noexcept { delete[] static_cast<T*>(memory); });
    return {data, shape, owner};
  }

 private:
  std::unique_ptr<T[]> memory_;
};

}  // namespace hiprt::python
