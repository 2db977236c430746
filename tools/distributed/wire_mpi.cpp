// The wire of MPI, through its C interface.
#include <tools/distributed/launch.h>
#include <tools/distributed/wire.h>

#include <tools/base/errors.h>
#include <tools/base/text.h>

// Only the C interface: the C++ one has left the standard.
#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>

#include <array>
#include <cstdlib>
#include <deque>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace hiprt::tools {
namespace {

std::string text_of(int error) {
  std::array<char, MPI_MAX_ERROR_STRING> text{};
  int length = 0;
  MPI_Error_string(error, text.data(), &length);
  return {text.data(), static_cast<std::size_t>(length)};
}

/// A piece whose bytes are arriving.
struct Arriving {
  MPI_Request request = MPI_REQUEST_NULL;
  WirePiece piece;
};

class MpiWire final : public Wire {
 public:
  build::Result<void> open() override {
    int provided = 0;
    // The thread that opens the wire makes all calls.
    if (const int error = MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided); error != MPI_SUCCESS)
      return fail(build::ErrorCode::kBackend, "MPI did not start: " + text_of(error));
    MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
    if (provided < MPI_THREAD_FUNNELED)
      return fail(build::ErrorCode::kBackend, "this MPI library cannot be used by a program with threads");
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
    return {};
  }

  int rank() const override { return rank_; }
  int size() const override { return size_; }

  build::Result<std::vector<std::byte>> meet(std::span<const std::byte> card) override {
    std::vector<std::byte> all(static_cast<std::size_t>(size_) * kRankCardBytes);
    const int error = MPI_Allgather(card.data(), static_cast<int>(kRankCardBytes), MPI_BYTE, all.data(),
                                    static_cast<int>(kRankCardBytes), MPI_BYTE, MPI_COMM_WORLD);
    if (error != MPI_SUCCESS) return fail(build::ErrorCode::kBackend, "the ranks did not meet: " + text_of(error));
    return all;
  }

  std::uint64_t send(int to, int tag, std::span<const std::byte> bytes) override {
    MPI_Request request = MPI_REQUEST_NULL;
    if (MPI_Isend(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, to, tag, MPI_COMM_WORLD, &request) !=
        MPI_SUCCESS)
      return 0;
    sending_.emplace(++tickets_, request);
    return tickets_;
  }

  bool sent(std::uint64_t ticket) override {
    const auto found = sending_.find(ticket);
    if (found == sending_.end()) return true;
    int done = 0;
    const int error = MPI_Test(&found->second, &done, MPI_STATUS_IGNORE);
    if (done == 0 && error == MPI_SUCCESS) return false;
    sending_.erase(found);
    return true;
  }

  std::optional<WirePiece> receive() override {
    while (accept()) {
    }
    std::vector<std::pair<int, int>> waiting;  // A piece must not overtake an earlier one of its rank and tag.
    for (auto at = arriving_.begin(); at != arriving_.end(); ++at) {
      const std::pair line(at->piece.from, at->piece.tag);
      bool first = true;
      for (const auto& other : waiting) first = first && other != line;
      int done = 0;
      if (first && MPI_Test(&at->request, &done, MPI_STATUS_IGNORE) != MPI_SUCCESS) {
        arriving_.erase(at);
        return std::nullopt;
      }
      if (done != 0) {
        WirePiece piece = std::move(at->piece);
        arriving_.erase(at);
        return piece;
      }
      waiting.push_back(line);
    }
    return std::nullopt;
  }

  void forget(int rank) override {
    // A receive that has been matched cannot be cancelled: the library may still write to its bytes.
    for (auto at = arriving_.begin(); at != arriving_.end();) {
      if (at->piece.from != rank) {
        ++at;
        continue;
      }
      static_cast<void>(new WirePiece(std::move(at->piece)));  // NOLINT: it must outlive everything.
      at = arriving_.erase(at);
    }
  }

  void close() override {
    int started = 0, ended = 0;
    MPI_Initialized(&started);
    MPI_Finalized(&ended);
    if (started != 0 && ended == 0) MPI_Finalize();
  }

 private:
  /// Begins to receive one piece. @return whether there was one.
  bool accept() {
    constexpr std::size_t kMostArriving = 64;
    if (arriving_.size() >= kMostArriving) return false;
    int there = 0, bytes = 0;
    MPI_Status status{};
    if (MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status) != MPI_SUCCESS || there == 0)
      return false;
    MPI_Get_count(&status, MPI_BYTE, &bytes);
    Arriving& next = arriving_.emplace_back();
    next.piece = {status.MPI_SOURCE, status.MPI_TAG, std::vector<std::byte>(static_cast<std::size_t>(bytes))};
    if (MPI_Irecv(next.piece.bytes.data(), bytes, MPI_BYTE, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD,
                  &next.request) == MPI_SUCCESS)
      return true;
    arriving_.pop_back();
    return false;
  }

  int rank_ = 0, size_ = 1;
  std::uint64_t tickets_ = 0;
  std::unordered_map<std::uint64_t, MPI_Request> sending_;
  std::deque<Arriving> arriving_;
};

}  // namespace

std::unique_ptr<Wire> make_wire() { return std::make_unique<MpiWire>(); }

std::string mpi_summary() {
  std::array<char, MPI_MAX_LIBRARY_VERSION_STRING> text{};
  int length = 0;
  MPI_Get_library_version(text.data(), &length);
  std::string_view whole(text.data(), static_cast<std::size_t>(length));
  // "Open MPI v4.1.4, package: Debian OpenMPI, ident: 4.1.4, ..."
  std::string result(whole.substr(0, whole.find_first_of(",\n")));
  if (const std::size_t v = result.find(" v"); v != std::string::npos) result.erase(v + 1, 1);
  return result;
}

}  // namespace hiprt::tools
