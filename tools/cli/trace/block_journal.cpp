#include <tools/cli/trace/block_journal.h>

#include <tools/base/bytes.h>
#include <tools/base/digest.h>
#include <tools/base/errors.h>

#include <algorithm>
#include <cstring>
#include <string_view>
#include <utility>

namespace hiprt::tools {
namespace {

constexpr std::string_view kMagic = "HIPRTBLK";

}  // namespace

std::vector<std::byte> encode(const PictureKey& key, const BlockJournal& journal) {
  ByteWriter writer;
  writer.add_bytes(std::as_bytes(std::span(kMagic)));
  writer.add(std::uint64_t{key.size()});
  for (const auto& [word, value] : key) {
    writer.add_text(word);
    writer.add_text(value);
  }
  writer.add(journal.hits);
  writer.add(journal.seconds);
  writer.add_array(std::span(std::as_const(journal.done)));
  writer.add(digest_of(writer.bytes()));
  return std::move(writer.bytes());
}

build::Result<BlockJournal> decode_journal(std::span<const std::byte> bytes, const PictureKey& key,
                                           std::size_t blocks) {
  constexpr std::size_t kLeast = kMagic.size() + sizeof(Digest);
  if (bytes.size() < kLeast || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0)
    return invalid_input("no checkpoint of traced blocks: it does not begin with " + std::string(kMagic));
  const auto content = bytes.first(bytes.size() - sizeof(Digest));
  const Digest digest = digest_of(content);
  if (std::memcmp(digest.data(), bytes.data() + content.size(), sizeof(Digest)) != 0)
    return invalid_input("wrong checksum: the checkpoint is damaged; remove it to begin again");
  ByteReader reader(content.subspan(kMagic.size()));
  PictureKey there(std::min<std::uint64_t>(reader.get<std::uint64_t>(), content.size()));
  for (auto& [word, value] : there) {
    word = reader.get_text();
    value = reader.get_text();
  }
  if (const std::string other = difference(there, key); !other.empty())
    return invalid_input("it is the checkpoint of another run: " + other + "; give another name to --resume");
  BlockJournal journal{{}, reader.get<std::uint64_t>(), reader.get<double>()};
  journal.done = reader.get_array<char>();
  if (!reader.ok() || !reader.at_end() || journal.done.size() != blocks)
    return invalid_input("malformed: the checkpoint is damaged; remove it to begin again");
  return journal;
}

}  // namespace hiprt::tools
