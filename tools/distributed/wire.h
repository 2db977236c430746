#pragma once
/// What Ranks needs of a message-passing library. One thread makes all calls, and no call waits for another rank,
/// except open(), meet() and close().

#include <hiprt_build/error.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace hiprt::tools {

/// Pieces have at most this many bytes; Ranks splits messages. MPI counts in int: a piece must stay below 2^31.
inline constexpr std::size_t kMostPieceBytes = std::size_t{16} << 20;

/// The longest description of a rank that meet() exchanges, in bytes.
inline constexpr std::size_t kRankCardBytes = 512;

struct WirePiece {
  int from = -1, tag = 0;
  std::vector<std::byte> bytes;
};

class Wire {
 public:
  Wire() = default;
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;
  virtual ~Wire() = default;

  /// Starts the library. May wait for all ranks.
  virtual build::Result<void> open() = 0;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  /// Exchanges kRankCardBytes bytes of every rank. Waits for all ranks.
  virtual build::Result<std::vector<std::byte>> meet(std::span<const std::byte> card) = 0;
  /// Starts to send a piece. @p bytes must not change until sent() returns true.
  /// @return a ticket for sent(), not 0; 0: it cannot be sent.
  virtual std::uint64_t send(int to, int tag, std::span<const std::byte> bytes) = 0;
  /// Whether the bytes of a ticket may go. Says true once per ticket.
  virtual bool sent(std::uint64_t ticket) = 0;
  /// The next piece that has arrived as a whole. Pieces of one rank and tag keep their order.
  virtual std::optional<WirePiece> receive() = 0;
  /// Gives up the pieces that a lost rank has begun to send.
  virtual void forget(int rank) = 0;
  /// Ends the library. It may wait for all ranks, for ever if one is dead.
  virtual void close() = 0;
};

/// @return the wire of MPI; without MPI a wire whose open() fails with the reason.
std::unique_ptr<Wire> make_wire();

}  // namespace hiprt::tools
