#pragma once
/// Messages of a simulated run of a scene in parts.

#include "part_simulation.h"

#include <cstdint>
#include <vector>

namespace hiprt::bench {

/// Rays on their tour.
struct Walk {
  const RayTours* tours;
  std::uint32_t at;  ///< Index of the part that they visit next.
  double rays;
};

inline constexpr double kQuestionBytes = 24.0, kAnswerBytes = 13.0;  ///< Without rays and answers.

enum class Matter : std::uint8_t { kQuestion, kAnswer, kUnit, kResult };

struct Message {
  Matter matter{};
  bool there = false;  ///< It has left the sender's network card.
  unsigned from = 0, to = 0;
  double bytes = 0.0;
  // Of questions and answers:
  std::uint32_t worker = 0;
  std::vector<Walk> walks{};
  double rays = 0.0, hits = 0.0;
  double seconds = 0.0;  ///< Of the owner.
  // Of units and results:
  tools::PictureUnit unit{};
  double took = 0.0;
};

/// Messages on their way, by number. Numbers of messages that have ended are used again.
class MessagePool {
 public:
  std::uint32_t add(Matter matter, unsigned from, unsigned to, double bytes) {
    auto number = static_cast<std::uint32_t>(messages_.size());
    if (free_.empty()) {
      messages_.emplace_back();
    } else {
      number = free_.back();
      free_.pop_back();
    }
    Message& message = messages_[number];
    message = {};
    message.matter = matter;
    message.from = from;
    message.to = to;
    message.bytes = bytes;
    return number;
  }
  /// The reference is valid until the next add().
  Message& operator[](std::uint32_t number) { return messages_[number]; }
  void end(std::uint32_t number) { free_.push_back(number); }

 private:
  std::vector<Message> messages_;
  std::vector<std::uint32_t> free_;
};

}  // namespace hiprt::bench
