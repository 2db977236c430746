// A program that tests start under mpirun: the ranks square numbers that rank 0 deals.
//
//     deal_program UNITS MICROSECONDS BYTES [lossy]
//
// Rank 0 prints the sum of the squares, how many units had a result, and the lost ranks. Each result has BYTES bytes
// more, which rank 0 checks. Every rank prints its process number to stderr when it begins.

#include <tools/base/interrupt.h>
#include <tools/distributed/broadcast.h>
#include <tools/distributed/deal.h>

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace {

using namespace hiprt;
using namespace hiprt::tools;

struct Plan {
  std::size_t units = 0, bytes = 0;
  unsigned microseconds = 0;
  bool lossy = false;
};

build::Result<std::vector<std::byte>> square(const Plan& plan, const DealtUnit& unit) {
  for (unsigned slept = 0; slept < plan.microseconds && !unit.must_stop(); slept += 1000) ::usleep(1000);
  if (unit.must_stop()) return cancelled();
  const std::uint64_t value = unit.index() * unit.index();
  std::vector<std::byte> result(sizeof(value) + plan.bytes, static_cast<std::byte>(unit.index()));
  std::memcpy(result.data(), &value, sizeof(value));
  return result;
}

int run(Ranks& ranks, const Plan& plan) {
  const std::vector<double> costs(ranks.is_first() ? plan.units : 0, 1.0);
  std::uint64_t sum = 0, count = 0, damaged = 0;
  DealEvents events;
  events.collect = [&](std::size_t unit, int, std::vector<std::byte> result) -> build::Result<void> {
    std::uint64_t value = 0;
    std::memcpy(&value, result.data(), sizeof(value));
    sum += value;
    ++count;
    damaged += result.size() != sizeof(value) + plan.bytes ? 1 : 0;
    for (std::size_t i = sizeof(value); i < result.size(); ++i)
      damaged += result[i] != static_cast<std::byte>(unit) ? 1 : 0;
    return {};
  };
  const auto report = deal(
      ranks, costs, {.ahead = 2, .lossy = plan.lossy}, [&](const DealtUnit& unit) { return square(plan, unit); },
      events);
  if (!report) std::fprintf(stderr, "rank %d: %s\n", ranks.rank(), report.error().message.c_str());
  if (!report || !ranks.is_first()) return report ? 0 : 1;
  std::printf("sum %llu units %llu damaged %llu lost %zu not_done %zu\n", static_cast<unsigned long long>(sum),
              static_cast<unsigned long long>(count), static_cast<unsigned long long>(damaged),
              report->lost_ranks.size(), report->not_done.size());
  return report->not_done.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  const InterruptGuard guard;
  const Plan plan{std::strtoull(argv[1], nullptr, 10), std::strtoull(argv[3], nullptr, 10),
                  static_cast<unsigned>(std::strtoul(argv[2], nullptr, 10)),
                  argc > 4 && std::string_view(argv[4]) == "lossy"};
  // While a machine that is busy with other work fills gigabytes, a rank may say nothing for seconds.
  const std::chrono::milliseconds silence(plan.bytes > 100'000'000 ? 30'000 : 5'000);
  auto ranks = Ranks::join({.lossy = plan.lossy, .silence = silence});
  if (!ranks) {
    std::fprintf(stderr, "%s\n", ranks.error().message.c_str());
    return leave_run(nullptr, 1);
  }
  std::fprintf(stderr, "rank %d process %d\n", (*ranks)->rank(), ::getpid());
  return leave_run(ranks->get(), run(**ranks, plan));
}
