/// Writes seed files into the folder given as argument: bvh/ for fuzz_bvh, and a folder for each reader of
/// fuzz_readers.

#include "make_reader_corpus.h"
#include "seed_files.h"

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

using namespace hiprt;

namespace {

void make_corpus(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "bvh");
  int number = 0;
  for (const test::TestFile& seed : fuzz::make_bvh_files()) {
    std::ofstream file(folder / "bvh" / ("seed-" + std::to_string(number++) + ".bvh"), std::ios::binary);
    file.write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
    if (!file.flush()) throw std::runtime_error("cannot write into " + folder.string());
  }
  fuzz::make_reader_corpus(folder);
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: make_corpus FOLDER\n");
    return 2;
  }
  try {
    make_corpus(arguments[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_corpus: %s\n", error.what());
    return 1;
  }
  return 0;
}
