#include "cli.h"

#include <hiprt_build/build.h>

#include <iostream>
#include <new>
#include <sstream>

namespace hiprt::tools {

std::string tool_version(const ToolInfo& info) { return std::string(info.name) + " " + build::version(); }

void add_threads_option(CLI::App& app, unsigned& threads) {
  app.add_option("--threads", threads, "Threads to use; 0: as many as the machine has")
      ->check(CLI::Range(0u, 4096u))
      ->type_name("N")
      ->capture_default_str();
}

Cli::Cli(const ToolInfo& info) : info_(info), app_(info.description, info.name) {
  app_.footer("\nExamples:\n" + std::string(info.examples) +
              "\nExit status: 0 success, 1 bad input or failed operation, "
              "2 bad usage.");
  app_.set_version_flag("--version", tool_version(info), "Print the version and exit");
  app_.set_help_flag("-h,--help", "Print this help with examples and exit");
  app_.add_flag("--json", json_, "Print the results as JSON");
}

int Cli::parse(int argc, const char* const* argv, bool& stop) {
  stop = true;
  try {
    app_.parse(argc, argv);
    stop = false;
    return kExitSuccess;
  } catch (const CLI::CallForHelp&) {
    std::cout << app_.help();
  } catch (const CLI::CallForVersion&) {
    std::cout << tool_version(info_) << "\n";
  } catch (const CLI::ParseError& error) {
    std::cerr << info_.name << ": " << usage_error(error) << "; see " << info_.name << " --help\n";
    return kExitUsage;
  }
  return kExitSuccess;
}

/// An option that does not exist explains more than the one that it was meant to be and that is missing now.
std::string Cli::usage_error(const CLI::ParseError& error) const {
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError))
    for (const std::string& word : app_.remaining())
      if (word.size() > 1 && word[0] == '-') return "unknown option " + word;
  return error.what();
}

int Cli::run(int argc, const char* const* argv, const std::function<build::Result<void>()>& tool) {
  try {
    bool stop = false;
    const int status = parse(argc, argv, stop);
    if (status != kExitSuccess) return status;
    if (!stop)
      if (const auto done = tool(); !done) return fail(done.error().message);
    if (!std::cout.flush()) return fail("cannot write to standard output");
    return kExitSuccess;
  } catch (const std::bad_alloc&) {
    return fail("not enough memory");
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}

int Cli::fail(const std::string& message) const {
  std::cerr << info_.name << ": " << message << "\n";
  return kExitFailure;
}

void Cli::warn(const std::string& message) const { std::cerr << info_.name << ": warning: " << message << "\n"; }

void Cli::print(const nlohmann::json& value) {
  std::cout << value.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
}

}  // namespace hiprt::tools
