#pragma once
/// Which blocks of a ray file are traced, in a file, so that an interrupted run can go on.

#include <tools/render/units/checkpoint.h>

#include <string>
#include <vector>

namespace hiprt::tools {

struct BlockJournal {
  std::vector<char> done;  ///< Per block.
  std::uint64_t hits = 0;  ///< Found in those blocks.
  double seconds = 0.0;
};

/// @param key what the results depend on.
std::vector<std::byte> encode(const PictureKey& key, const BlockJournal& journal);
/// @return kInvalidInput if the bytes are damaged, or of other work: the message says what differs.
build::Result<BlockJournal> decode_journal(std::span<const std::byte> bytes, const PictureKey& key, std::size_t blocks);

}  // namespace hiprt::tools
