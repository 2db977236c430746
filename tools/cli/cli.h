#pragma once
/// What the command lines of all tools share.

#include <hiprt_build/error.h>

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <new>
#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace hiprt::tools {

/// Exit statuses.
inline constexpr int kExitSuccess = 0;
inline constexpr int kExitFailure = 1;  ///< Bad input or a failed operation.
inline constexpr int kExitUsage = 2;    ///< A wrong command line.

/// Groups of options in --help, in this order.
inline constexpr const char* kInputGroup = "Input";
inline constexpr const char* kTreeGroup = "Tree";
inline constexpr const char* kInstanceGroup = "Instances";
inline constexpr const char* kOutputGroup = "Output";
inline constexpr const char* kCacheGroup = "Cache and many assets";
inline constexpr const char* kMachineGroup = "Machine";
inline constexpr const char* kExpertGroup = "Experts";

struct ToolInfo {
  const char* name;         ///< "bvhbuild"
  const char* description;  ///< One or a few lines.
  const char* examples;     ///< Lines for the end of --help, without the word "Examples".
};

/// A command line with --help (with examples), --man, --completion, --version and --json. Errors go to stderr as
/// "bvhbuild: what, where"; with --json a failure prints {"error": {"message": ...}} to stdout, too, unless something
/// was printed before.
///
///     int main(int argc, char** argv) {
///       Options options;
///       Cli cli(kInfo);
///       cli.app().add_option("FILE", options.path, "...")->required();
///       return cli.run(argc, argv, [&] { return do_it(cli, options); });
///     }
class Cli {
 public:
  explicit Cli(const ToolInfo& info);
  Cli(const Cli&) = delete;
  Cli& operator=(const Cli&) = delete;
  ~Cli();

  CLI::App& app() { return *app_; }
  bool json() const { return json_; }

  /// Parses the arguments and calls @p tool, except after --help and its like or a wrong command line.
  /// @return the exit status. Exceptions become failures, and so do errors of stdout. From now on the program ignores
  /// SIGXFSZ.
  int run(int argc, const char* const* argv, const std::function<build::Result<void>()>& tool);

  /// Prints "NAME: warning: message" to stderr.
  void warn(const std::string& message) const;
  /// Prints a JSON value and a line break to stdout. Bytes that are not UTF-8 (of file names) are replaced.
  void print(const nlohmann::json& value) const;

 private:
  void add_general_options();
  int parse(int argc, const char* const* argv, bool& stop);
  std::string usage_error(const CLI::ParseError& error) const;
  int fail(const std::string& message) const;
  int fail_without_memory(const std::bad_alloc& failure) const noexcept;

  ToolInfo info_;
  std::unique_ptr<CLI::App> app_;
  bool json_ = false;
  mutable bool printed_ = false;
};

/// @return e.g. "bvhbuild 0.2.0", for provenance records.
std::string tool_version(const ToolInfo& info);

/// Adds --max-memory SIZE, for MemoryLimit. 0, the default, is half of the machine's memory.
void add_memory_option(CLI::App& app, std::uint64_t& bytes);

/// Adds --threads N, 0 to 4096 (0, the default: as many as the machine has).
void add_threads_option(CLI::App& app, unsigned& threads);

}  // namespace hiprt::tools
