// Without MPI. HIPRT_MPI_REASON says why there is none.
#include <tools/distributed/launch.h>
#include <tools/distributed/wire.h>

#include <tools/base/errors.h>

namespace hiprt::tools {
namespace {

class NoWire final : public Wire {
 public:
  build::Result<void> open() override {
    return fail(build::ErrorCode::kBackend,
                "several processes of it were started as one run, but it was built without MPI (" HIPRT_MPI_REASON
                "): start it alone, or install libopenmpi-dev and build it again");
  }
  int rank() const override { return 0; }
  int size() const override { return 1; }
  build::Result<std::vector<std::byte>> meet(std::span<const std::byte> card) override {
    return std::vector<std::byte>(card.begin(), card.end());
  }
  std::uint64_t send(int, int, std::span<const std::byte>) override { return 0; }
  bool sent(std::uint64_t) override { return true; }
  std::optional<WirePiece> receive() override { return std::nullopt; }
  void forget(int) override {}
  void close() override {}
};

}  // namespace

std::unique_ptr<Wire> make_wire() { return std::make_unique<NoWire>(); }

std::string mpi_summary() { return "not compiled in (" HIPRT_MPI_REASON ")"; }

}  // namespace hiprt::tools
