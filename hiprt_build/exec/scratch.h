#pragma once
/// The builder's temporary arrays, counted. Internal.

#include <hiprt_build/format/pages.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

namespace hiprt::build {

/// Bytes in use now and at most. Changed by the thread that runs the build's steps only.
class MemoryLedger {
 public:
  void add(std::uint64_t bytes) { peak_ = std::max(peak_, current_ += bytes); }
  void subtract(std::uint64_t bytes) { current_ -= bytes; }
  std::uint64_t peak() const { return peak_; }

 private:
  std::uint64_t current_ = 0;
  std::uint64_t peak_ = 0;
};

/// An uninitialised array of trivial elements, aligned to a cache line. Throws std::bad_alloc.
template <class T> class ScratchArray {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  ScratchArray() = default;
  ScratchArray(MemoryLedger& ledger, std::size_t size)
      : ledger_(&ledger), size_(size), data_(static_cast<T*>(allocate_pages(size * sizeof(T)))) {
    ledger.add(size * sizeof(T));
  }
  ScratchArray(ScratchArray&& other) noexcept
      : ledger_(other.ledger_), size_(std::exchange(other.size_, 0)), data_(std::exchange(other.data_, nullptr)) {}
  ScratchArray& operator=(ScratchArray&& other) noexcept {
    std::swap(ledger_, other.ledger_);
    std::swap(size_, other.size_);
    std::swap(data_, other.data_);
    return *this;
  }
  ~ScratchArray() { release(); }

  void release() {
    if (data_ == nullptr) return;
    free_pages(data_, size_ * sizeof(T));
    ledger_->subtract(size_ * sizeof(T));
    data_ = nullptr;
    size_ = 0;
  }

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  std::span<T> span() { return {data_, size_}; }
  std::span<const T> span() const { return {data_, size_}; }

 private:
  MemoryLedger* ledger_ = nullptr;
  std::size_t size_ = 0;
  T* data_ = nullptr;
};

}  // namespace hiprt::build
