#include <tools/distributed/ranks.h>

#include <tools/distributed/launch.h>
#include <tools/distributed/rank_service.h>

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string_view>
#include <utility>

namespace hiprt::tools {
namespace {

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && std::string_view(value) != "0" && std::string_view(value) != "false";
}

/// Whether mpirun of Open MPI 4 has --enable-recovery.
bool has_enabled_recovery() { return is_set("OMPI_MCA_orte_enable_recovery"); }

/// Whether Open MPI's mpirun was told to let a run go on after the end of a rank (recovery_words()).
bool mpirun_recovers() { return has_enabled_recovery() || is_set("OMPI_MCA_mpi_ft_enable"); }

/// Open MPI 4.1 with --enable-recovery ends with 0 whatever the ranks return, except after a signal. It then ends its
/// ranks within 3 s, so that only the first living rank sends the signal.
void tell_mpirun_of_failure() {
  constexpr unsigned kSecondsToEnd = 3;
  const std::string parent = parent_name();
  const bool is_launcher = parent == "mpirun" || parent == "mpiexec" || parent == "orterun";
  if (!has_enabled_recovery() || !is_launcher) return;
  const char* local = std::getenv("OMPI_COMM_WORLD_LOCAL_RANK");
  for (unsigned left = kSecondsToEnd * (local == nullptr ? 0u : static_cast<unsigned>(std::atoi(local))); left > 0;)
    left = ::sleep(left);
  ::kill(::getppid(), SIGTERM);
  // Ending first would let it end with 0.
  std::signal(SIGTERM, SIG_IGN);
  ::sleep(kSecondsToEnd + 2);
}

void use_transport_that_survives() {
  ::setenv("OMPI_MCA_pml", "ob1", 0);
  ::setenv("OMPI_MCA_btl", "tcp,self", 0);
}

/// MPI's transport by TCP writes without MSG_NOSIGNAL: the end of a rank would end others that still write to it.
void survive_broken_connections() { std::signal(SIGPIPE, SIG_IGN); }

void flush_output() {
  std::cout.flush();
  std::fflush(nullptr);
}

}  // namespace

Ranks::Ranks() : service_(std::make_shared<RankService>(nullptr, RankOptions{})) {}

build::Result<std::unique_ptr<Ranks>> Ranks::join(const RankOptions& options) {
  const auto launch = launch_of_environment();
  if (!launch || launch->size == 1) return std::make_unique<Ranks>();
  if (options.lossy || mpirun_recovers()) use_transport_that_survives();
  survive_broken_connections();
  return join(make_wire(), options);
}

build::Result<std::unique_ptr<Ranks>> Ranks::join(std::unique_ptr<Wire> wire, const RankOptions& options) {
  auto ranks = std::make_unique<Ranks>();
  ranks->service_ = std::make_shared<RankService>(std::move(wire), options);
  ranks->thread_ = std::thread([service = ranks->service_] { service->run(); });
  if (auto started = ranks->service_->wait_for_start(); !started) {
    // It may hang in MPI.
    ranks->thread_.detach();
    return tl::unexpected(started.error());
  }
  return ranks;
}

Ranks::~Ranks() {
  if (thread_.joinable()) end_thread(false);
}

bool Ranks::end_thread(bool close) {
  const bool ended = service_->end(close);
  if (ended)
    thread_.join();
  else
    thread_.detach();
  return ended;
}

int Ranks::rank() const { return service_->rank(); }
int Ranks::size() const { return service_->size(); }

int Ranks::local_rank() const {
  int count = 0;
  for (int i = 0; i < rank(); ++i) count += service_->peer(i).host == service_->peer(rank()).host ? 1 : 0;
  return count;
}

int Ranks::local_size() const {
  int count = 0;
  for (int i = 0; i < size(); ++i) count += service_->peer(i).host == service_->peer(rank()).host ? 1 : 0;
  return count;
}

std::vector<int> Ranks::first_of_hosts() const {
  std::vector<int> result;
  for (int i = 0; i < size(); ++i) {
    const auto same_host = [&](int first) { return service_->peer(first).host == service_->peer(i).host; };
    if (std::none_of(result.begin(), result.end(), same_host)) result.push_back(i);
  }
  return result;
}

std::string Ranks::host(int rank) const {
  const std::string& host = service_->peer(rank).host;
  return host.substr(0, host.find(' '));
}

std::string Ranks::name(int rank) const {
  return "rank " + std::to_string(rank) + " (process " + std::to_string(service_->peer(rank).pid) + " on " +
         host(rank) + ")";
}

void Ranks::send(int to, int tag, std::vector<std::byte> bytes) {
  send(to, tag, std::make_shared<const std::vector<std::byte>>(std::move(bytes)));
}

void Ranks::send(int to, int tag, SharedBytes bytes) { service_->send(to, tag, std::move(bytes)); }

std::optional<RankMessage> Ranks::receive(std::span<const int> tags, std::chrono::milliseconds timeout) {
  return service_->receive(tags, timeout);
}

bool Ranks::flush(std::chrono::milliseconds timeout) { return service_->flush(timeout); }

std::vector<int> Ranks::lost() const { return service_->lost(); }
bool Ranks::is_lost(int rank) const { return service_->is_lost(rank); }
bool Ranks::must_stop() const { return service_->must_stop(); }
void Ranks::stop_others() { service_->stop_others(); }
build::Result<void> Ranks::health() const { return service_->health(); }

int Ranks::leave(int status) {
  if (!thread_.joinable()) return status;
  // Rank 0 speaks for the run, and if it is lost, the others.
  const bool failed = status != 0 && (is_first() || !health());
  const bool clean = service_->agree_to_leave();
  flush_output();
  if (clean && end_thread(true)) {
    if (failed) tell_mpirun_of_failure();
    return status;
  }
  if (failed) tell_mpirun_of_failure();
  ::_exit(status);
}

int leave_run(Ranks* ranks, int status) {
  if (ranks != nullptr) return ranks->leave(status);
  const auto launch = launch_of_environment();
  if (!launch || launch->size == 1 || status == 0) return status;
  flush_output();
  tell_mpirun_of_failure();
  ::_exit(status);
}

std::string recovery_warning() {
  if (std::getenv("OMPI_COMM_WORLD_RANK") == nullptr || mpirun_recovers()) return {};
  return "mpirun ends the run when a rank is lost: start it with mpirun " + recovery_words();
}

}  // namespace hiprt::tools
