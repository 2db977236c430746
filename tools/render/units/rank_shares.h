#pragma once
/// Which GPU and how many threads each rank of a run gets.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

/// What a rank may use.
struct RankMeans {
  std::string host;                       ///< Ranks with equal names share processors and GPUs.
  std::vector<std::string> gpus;          ///< Addresses of the GPUs that it sees, by their numbers.
  std::vector<std::uint32_t> processors;  ///< Numbers of the processors that it may run on.
};

struct RankShare {
  std::optional<int> gpu;  ///< Number of a GPU that no other rank has. Nothing: there is none left.
  unsigned threads = 1;    ///< Its share of the processors.
};

/// The ranks of a host take its GPUs in the order of their numbers, one each, also where the launcher shows each rank
/// other GPUs. A processor that several ranks may run on is divided among them.
std::vector<RankShare> share_hosts(std::span<const RankMeans> ranks);

/// Numbers of the processors that this process may run on.
std::vector<std::uint32_t> own_processors();

std::vector<std::byte> encode(const RankMeans& means);
/// @return nothing if the bytes are malformed.
std::optional<RankMeans> decode_means(std::span<const std::byte> bytes);

}  // namespace hiprt::tools
