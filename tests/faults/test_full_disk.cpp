// Outputs that cannot be written: full disks, limits of file sizes, read-only disks, paths that are no files. Programs
// end with status 1 and one line, and the old files stay.

#include <tests/faults/program_lines.h>

#include <tests/catch.h>

#include <algorithm>
#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;
using Catch::Contains;

namespace {

using Words = std::vector<std::string>;

/// Runs @p script of sh, whose "$@" are the words, and $0 the folder of the outputs.
test::CommandResult run_in(const std::string& script, const std::string& out, const Words& words) {
  Words command{"/bin/sh", "-c", script, out};
  command.insert(command.end(), words.begin(), words.end());
  return test::run(command);
}

/// Status 1 and one line of the program's that names the fault and the output's path, also as PATH.part.
void check_refused(const test::CommandResult& result, const Words& words, const std::string& path,
                   const std::string& fault) {
  INFO(words[0] << ": status " << result.status << ", " << result.err);
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Catch::StartsWith(std::filesystem::path(words[0]).filename().string() + ": "));
  CHECK_THAT(result.err, (Contains("'" + path + "': ") || Contains("'" + path + ".part': ")) && Contains(fault));
  CHECK(std::count(result.err.begin(), result.err.end(), '\n') == 1);
}

/// A folder in which each output is an old file.
struct OldFiles {
  explicit OldFiles(const ProgramLine& line) {
    for (const std::string& name : line.outputs) folder.write(name, "old");
  }
  std::string out() const { return folder.path().string() + "/"; }
  bool unchanged() const {
    const Contents found = contents_of(folder);
    return std::all_of(found.begin(), found.end(), [](const auto& file) { return file.second == "old"; });
  }

  test::TempFolder folder;
};

/// Mounts an empty disk of $SIZE at "$0", which only this process sees, and writes "old" into $FILES. Status 77: the
/// machine does not permit it. Then it runs "$@". Status 98 and 99: other files than these are left.
const std::string kOnDisk = R"sh(
  mount -t tmpfs -o "size=$SIZE" none "$0" 2>/dev/null || exit 77
  for file in $FILES; do printf old > "$0/$file" || exit 77; done
  [ -z "$REMOUNT" ] || mount -o "remount,$REMOUNT" "$0" 2>/dev/null || exit 77
  "$@"; status=$?
  [ "$(echo $(ls -A "$0"))" = "$FILES" ] || { echo "left: $(ls -A "$0")" >&2; exit 99; }
  for file in $FILES; do [ "$(cat "$0/$file")" = old ] || { echo "changed: $file" >&2; exit 98; }; done
  exit $status)sh";

/// Runs the line's program on a small disk (tmpfs) that the old files fill.
test::CommandResult run_on_disk(const ProgramLine& line, const Words& words, const std::string& out,
                                const std::string& options) {
  std::string files;
  for (const std::string& name : line.outputs) files += (files.empty() ? "" : " ") + name;
  // Each file takes a page.
  const std::string size = std::to_string(4 * line.outputs.size()) + "k";
  Words command{"/usr/bin/env", "SIZE=" + size, "FILES=" + files,  "REMOUNT=" + options,
                "unshare",      "--user",       "--map-root-user", "--mount",
                "/bin/sh",      "-c",           kOnDisk,           out};
  command.insert(command.end(), words.begin(), words.end());
  return test::run(command);
}

}  // namespace

TEST_CASE("programs on a full disk and on a read-only one say so and leave the old files") {
  const ProgramInputs inputs(1);
  unsigned runs = 0;
  for (const ProgramLine& line : program_lines())
    for (const auto& [options, fault] :
         {std::pair{"", "No space left on device"}, std::pair{"ro", "Read-only file system"}}) {
      const test::TempFolder folder;
      const std::string out = folder.path().string() + "/";
      const Words words = line.words(inputs.at(), out);
      const test::CommandResult result = run_on_disk(line, words, folder.path(), options);
      // 1 with another message than the program's: unshare failed.
      if (result.status == 77 || result.err.starts_with("unshare:") || result.err.starts_with("/usr/bin/env:")) {
        std::printf("SKIPPED: this machine does not permit own disks: %s\n", result.err.c_str());
        return;
      }
      ++runs;
      const bool is_last = std::string(options) == "ro";  // The manifest of parts is checked first.
      check_refused(result, words, out + (is_last ? line.outputs.back() : line.outputs.front()), fault);
    }
  std::printf("programs: %u runs on full and read-only disks, as many errors\n", runs);
}

TEST_CASE("programs beyond the limit of file sizes say so and leave the old files") {
  const ProgramInputs inputs(1);
  for (const ProgramLine& line : program_lines()) {
    const OldFiles old(line);
    const Words words = line.words(inputs.at(), old.out());
    check_refused(run_in("ulimit -f 0; exec \"$@\"", old.out(), words), words, old.out() + line.outputs.front(),
                  "File too large");
    CHECK(old.folder.names() == line.outputs);
    CHECK(old.unchanged());
    // There is no place for the message either.
    const test::TempFolder text;
    CHECK(run_in("ulimit -f 0; exec \"$@\" > \"$0\" 2>&1", text / "text", words).status == 1);
    CHECK(old.folder.names() == line.outputs);
    CHECK(old.unchanged());
  }
}

TEST_CASE("programs whose output is a device, or below a file, refuse it and change nothing") {
  const ProgramInputs inputs(1);
  for (const ProgramLine& line : program_lines()) {
    const test::TempFolder links;
    for (const std::string& name : line.outputs) std::filesystem::create_symlink("/dev/full", links / name);
    const std::string out = links.path().string() + "/";
    const Words words = line.words(inputs.at(), out);
    check_refused(test::run(words), words, out + line.outputs.back(), "it is not a regular file");
    CHECK(links.names() == line.outputs);
    for (const std::string& name : line.outputs) CHECK(std::filesystem::is_symlink(links / name));

    const test::TempFolder folder;
    folder.write("file", "old");
    const Words below = line.words(inputs.at(), out + "../" + folder.path().filename().string() + "/file/");
    const test::CommandResult result = test::run(below);
    INFO(result.err);
    CHECK(result.status == 1);
    CHECK_THAT(result.err, Contains("there is no folder '"));
    CHECK(test::read_file(folder / "file") == "old");
  }
}

TEST_CASE("programs whose standard output is full fail, and their files are whole") {
  const ProgramInputs inputs(1);
  for (const ProgramLine& line : program_lines()) {
    const OldFiles old(line);
    Words words = line.words(inputs.at(), old.out());
    const Contents new_files = outputs_of(line, inputs);
    words.push_back("--json");
    const test::CommandResult result = run_in("exec \"$@\" > /dev/full", old.out(), words);
    INFO(result.err);
    CHECK(result.status == 1);
    CHECK_THAT(result.err, Contains("cannot write to standard output"));
    CHECK(contents_of(old.folder) == new_files);
  }
}
