#include <tools/cli/cli.h>

#include <hiprt_build/build.h>
#include <hiprt_build/format/out_of_memory.h>
#include <hiprt_build/format/utf8.h>
#include <tools/base/gpu_code.h>
#include <tools/cli/manual.h>
#include <tools/distributed/launch.h>
#include <tools/scene_io/mesh/mesh_assimp.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <new>
#include <sstream>
#include <utility>

namespace hiprt::tools {

namespace {

/// What --version prints.
std::string version_text(const ToolInfo& info) {
  const std::string embree = build::embree_version();
  return tool_version(info) + "\nGPU code: " + gpu_code_summary() + "\nEmbree: " + (embree.empty() ? "none" : embree) +
         "\nMPI: " + mpi_summary() + "\nassimp: " + assimp_version();
}

/// Messages hold names and contents of files: what a terminal would take for a command is shown as \x1b.
std::string printable(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t size = format_detail::utf8_character(text);
    const auto byte = static_cast<unsigned char>(text[0]);
    if (size == 0 || byte < 0x20 || byte == 0x7f) {
      std::array<char, 8> code{};
      std::snprintf(code.data(), code.size(), "\\x%02x", unsigned{byte});
      result += code.data();
    } else {
      result += text.substr(0, size);
    }
    text.remove_prefix(size == 0 ? 1 : size);
  }
  return result;
}

/// --help with descriptions in lines of one width, and without the lists of options that exclude each other: the
/// message of the parser names those.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string text = CLI::Formatter::make_option_opts(option);
    return text.substr(0, text.find(" Excludes:"));
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    constexpr std::size_t kWidth = 84;
    std::string result, line;
    std::istringstream description(CLI::Formatter::make_option_desc(option));
    for (std::string word; description >> word;) {
      if (!line.empty() && line.size() + 1 + word.size() > kWidth) result += std::exchange(line, "") + "\n";
      line += (line.empty() ? "" : " ") + word;
    }
    return result + line;
  }
};

/// From version 2.5 on CLI11 breaks lines, and those of this library are broken already. It aligns long options, too.
template <class Formatter> void keep_lines(Formatter& formatter) {
  if constexpr (requires { formatter.right_column_width(0); }) {
    formatter.right_column_width(200);
    formatter.enable_description_formatting(false);
    formatter.enable_footer_formatting(false);
    formatter.long_option_alignment_ratio(0.2f);
  }
}

}  // namespace

std::string tool_version(const ToolInfo& info) { return std::string(info.name) + " " + build::version(); }

void add_threads_option(CLI::App& app, unsigned& threads) {
  app.add_option("--threads", threads, "Threads to use; 0: as many as the machine has")
      ->check(CLI::Range(0u, 4096u))
      ->type_name("N")
      ->capture_default_str()
      ->group(kMachineGroup);
}

void add_memory_option(CLI::App& app, std::uint64_t& bytes) {
  app.add_option("--max-memory", bytes,
                 "Most memory that reading the input files may take, for example 8G or 500M. Files that need more are "
                 "an error (default: half of the machine's memory)")
      ->transform(CLI::AsSizeValue(/*kb_is_1000=*/false))
      ->type_name("SIZE")
      ->group(kMachineGroup);
}

Cli::Cli(const ToolInfo& info) : info_(info), app_(std::make_unique<CLI::App>(info.description, info.name)) {
  app_->set_help_flag();
  const auto formatter = std::make_shared<HelpFormatter>();
  keep_lines(*formatter);
  app_->formatter(formatter);
  app_->footer("\nExamples:\n" + std::string(info.examples) +
               "\nExit status: 0 success, 1 bad input or failed operation, "
               "2 bad usage.");
}

Cli::~Cli() = default;

/// At the end of --help, below the tool's own groups.
void Cli::add_general_options() {
  app_->add_flag("--json", json_, "Print the results as JSON")->disable_flag_override()->group(kOutputGroup);
  app_->set_help_flag("-h,--help", "Print this help with examples and exit")->group("General");
  // CLI11 calls these functions while it parses, before it reports missing options. --help works in the same way.
  const auto print_and_stop = [](const std::string& text) {
    if (is_first_of_launch()) std::cout << text;
    throw CLI::Success();
  };
  app_->add_flag_callback(
          "--man", [=, this] { print_and_stop(manual_page(*app_, info_)); },
          "Print the manual page, for man -l -, and exit")
      ->disable_flag_override()
      ->trigger_on_parse()
      ->group("General");
  app_->add_option_function<std::string>(
          "--completion",
          [=, this](const std::string& shell) { print_and_stop(completion_script(*app_, info_, shell)); },
          "Print a completion script for this shell and exit")
      ->check(CLI::IsMember({"bash", "zsh", "fish"}))
      ->type_name("SHELL")
      ->trigger_on_parse()
      ->group("General");
  app_->set_version_flag("--version", version_text(info_), "Print the version and exit")->group("General");
}

int Cli::parse(int argc, const char* const* argv, bool& stop) {
  stop = true;
  // Under mpirun one rank speaks for all, which have the same command line.
  std::ostream silent(nullptr);
  std::ostream &out = is_first_of_launch() ? std::cout : silent, &err = is_first_of_launch() ? std::cerr : silent;
  // CLI11 reads [a,b] as a list. "./[a,b]" names the same file.
  std::vector<std::string> words(argv + 1, argv + argc);
  for (std::string& word : words)
    if (word.starts_with('[')) word.insert(0, "./");
  std::reverse(words.begin(), words.end());
  try {
    app_->parse(std::move(words));
    stop = false;
    return kExitSuccess;
  } catch (const CLI::CallForHelp&) {
    out << app_->help();
  } catch (const CLI::CallForVersion&) {
    out << version_text(info_) << "\n";
  } catch (const CLI::Success&) {
    // --man or --completion: printed.
  } catch (const CLI::ParseError& error) {
    err << info_.name << ": " << printable(usage_error(error)) << "; see " << info_.name << " --help\n";
    // The first rank that ends with a failure makes mpirun end the others: rank 0 must have printed by then.
    return is_first_of_launch() ? kExitUsage : kExitSuccess;
  }
  return kExitSuccess;
}

/// An option that does not exist explains more than the one that it was meant to be and that is missing now.
std::string Cli::usage_error(const CLI::ParseError& error) const {
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError))
    for (const std::string& word : app_->remaining())
      if (word.size() > 1 && word[0] == '-') return "unknown option " + word;
  return error.what();
}

int Cli::run(int argc, const char* const* argv, const std::function<build::Result<void>()>& tool) {
  // A write beyond the limit of file sizes is an error and not the end of the program.
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    add_general_options();
    bool stop = false;
    const int status = parse(argc, argv, stop);
    if (status != kExitSuccess) return status;
    if (!stop)
      if (const auto done = tool(); !done) return fail(done.error().message);
    if (!std::cout.flush()) return fail("cannot write to standard output");
    return kExitSuccess;
  } catch (const std::bad_alloc& failure) {
    return fail_without_memory(failure);
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}

int Cli::fail_without_memory(const std::bad_alloc& failure) const noexcept {
  try {
    return fail(build::out_of_memory({"to finish"}, failure).message);
  } catch (const std::bad_alloc&) {
    // Not even for this message.
    std::fputs("not enough memory\n", stderr);
    return kExitFailure;
  }
}

int Cli::fail(const std::string& message) const {
  if (json_ && !printed_) print({{"error", {{"message", message}}}});
  std::cerr << info_.name << ": " << printable(message) << "\n";
  return kExitFailure;
}

void Cli::warn(const std::string& message) const {
  std::cerr << info_.name << ": warning: " << printable(message) << "\n";
}

void Cli::print(const nlohmann::json& value) const {
  printed_ = true;
  std::cout << value.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
}

}  // namespace hiprt::tools
