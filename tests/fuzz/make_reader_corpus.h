#pragma once
/// Seeds of fuzz_readers.

#include <filesystem>

namespace hiprt::fuzz {

/// Writes them into a folder for each reader, which has the reader's name. Throws std::runtime_error.
void make_reader_corpus(const std::filesystem::path& folder);

}  // namespace hiprt::fuzz
