#pragma once
/// A small stack without an allocation. Internal.

#include <hiprt_device/format/portability.h>

namespace hiprt::format_detail {

/// A vector of at most kMost elements.
template <class T, unsigned kMost> class ShortStack {
 public:
  HIPRT_HD bool empty() const { return size_ == 0; }
  HIPRT_HD void clear() { size_ = 0; }
  HIPRT_HD void push_back(const T& value) { values_[size_++] = value; }
  HIPRT_HD const T& back() const { return values_[size_ - 1]; }
  HIPRT_HD void pop_back() { --size_; }

 private:
  T values_[kMost];
  unsigned size_ = 0;
};

}  // namespace hiprt::format_detail
