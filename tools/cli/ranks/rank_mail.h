#pragma once
/// Questions and answers of scenes in parts, as messages between ranks.

#include <tools/distributed/ranks.h>
#include <tools/render/parts/ray_mail.h>

namespace hiprt::tools {

class RankMail : public RayMail {
 public:
  /// @param ranks must live as long as this.
  explicit RankMail(Ranks& ranks) : ranks_(ranks) {}

  unsigned rank() const override { return static_cast<unsigned>(ranks_.rank()); }
  unsigned ranks() const override { return static_cast<unsigned>(ranks_.size()); }
  void ask(unsigned rank, std::vector<std::byte> question) override;
  void answer(unsigned rank, unsigned slot, std::vector<std::byte> answer) override;
  std::optional<Letter> next_question(std::chrono::milliseconds timeout) override;
  std::optional<Letter> next_answer(unsigned slot, std::chrono::milliseconds timeout) override;
  /// @return kBackend: a rank is lost, with its parts. kCancelled: rank 0 has ended the run.
  build::Result<void> health() const override;

 private:
  std::optional<Letter> next(int tag, std::chrono::milliseconds timeout);

  Ranks& ranks_;
};

}  // namespace hiprt::tools
