#include <tools/render/units/rank_shares.h>

#include <tools/base/bytes.h>

#include <sched.h>

#include <algorithm>
#include <map>
#include <set>
#include <thread>
#include <utility>

namespace hiprt::tools {

std::vector<RankShare> share_hosts(std::span<const RankMeans> ranks) {
  std::set<std::pair<std::string, std::string>> taken;
  std::map<std::pair<std::string, std::uint32_t>, unsigned> users;
  for (const RankMeans& rank : ranks)
    for (const std::uint32_t processor : rank.processors) ++users[{rank.host, processor}];
  std::vector<RankShare> shares;
  for (const RankMeans& rank : ranks) {
    RankShare& share = shares.emplace_back();
    for (std::size_t i = 0; !share.gpu && i < rank.gpus.size(); ++i)
      if (taken.emplace(rank.host, rank.gpus[i]).second) share.gpu = static_cast<int>(i);
    double processors = 0.0;
    for (const std::uint32_t processor : rank.processors) processors += 1.0 / users[{rank.host, processor}];
    // Thirds may add up to a little less than 1.
    share.threads = std::max(1u, static_cast<unsigned>(processors + 1e-6));
  }
  return shares;
}

std::vector<std::uint32_t> own_processors() {
  std::vector<std::uint32_t> numbers;
  // More processors than cpu_set_t has room for need a larger set.
  for (std::size_t most = CPU_SETSIZE; most <= std::size_t{1} << 20 && numbers.empty(); most *= 2) {
    cpu_set_t* const set = CPU_ALLOC(most);
    if (set == nullptr) break;
    const std::size_t bytes = CPU_ALLOC_SIZE(most);
    CPU_ZERO_S(bytes, set);
    if (sched_getaffinity(0, bytes, set) == 0)
      for (std::size_t i = 0; i < most; ++i)
        if (CPU_ISSET_S(i, bytes, set)) numbers.push_back(static_cast<std::uint32_t>(i));
    CPU_FREE(set);
  }
  for (unsigned i = 0; numbers.empty() && i < std::max(1u, std::thread::hardware_concurrency()); ++i)
    numbers.push_back(i);
  return numbers;
}

std::vector<std::byte> encode(const RankMeans& means) {
  ByteWriter writer;
  writer.add_text(means.host);
  writer.add(std::uint64_t{means.gpus.size()});
  for (const std::string& gpu : means.gpus) writer.add_text(gpu);
  writer.add_array(std::span(means.processors));
  return std::move(writer.bytes());
}

std::optional<RankMeans> decode_means(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  RankMeans means{reader.get_text(), {}, {}};
  const auto gpus = reader.get<std::uint64_t>();
  for (std::uint64_t i = 0; i < gpus && reader.ok(); ++i) means.gpus.push_back(reader.get_text());
  means.processors = reader.get_array<std::uint32_t>();
  if (!reader.ok() || !reader.at_end()) return std::nullopt;
  return means;
}

}  // namespace hiprt::tools
