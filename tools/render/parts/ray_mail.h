#pragma once
/// Questions and answers between the processes that have the parts of a scene.

#include <hiprt_build/error.h>

#include <chrono>
#include <cstddef>
#include <optional>
#include <vector>

namespace hiprt::tools {

/// Any thread may call it.
class RayMail {
 public:
  /// Slots number the threads of a process that wait for answers.
  static constexpr unsigned kMostSlots = 512;

  struct Letter {
    unsigned from;
    std::vector<std::byte> bytes;
  };

  RayMail() = default;
  RayMail(const RayMail&) = delete;
  RayMail& operator=(const RayMail&) = delete;
  virtual ~RayMail() = default;

  virtual unsigned rank() const = 0;
  virtual unsigned ranks() const = 0;
  /// Both return at once.
  virtual void ask(unsigned rank, std::vector<std::byte> question) = 0;
  virtual void answer(unsigned rank, unsigned slot, std::vector<std::byte> answer) = 0;
  /// The next question to this process; nothing after @p timeout.
  virtual std::optional<Letter> next_question(std::chrono::milliseconds timeout) = 0;
  /// The next answer to a slot; nothing after @p timeout.
  virtual std::optional<Letter> next_answer(unsigned slot, std::chrono::milliseconds timeout) = 0;
  /// @return the error if the run cannot go on: a rank is lost, or rank 0 has ended it.
  virtual build::Result<void> health() const = 0;
};

}  // namespace hiprt::tools
