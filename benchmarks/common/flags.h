#pragma once
/// Flags of the benchmark programs, "--name=value", in addition to those of Google Benchmark.

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace hiprt::bench {

struct Flag {
  std::string_view name;   ///< Without the two dashes.
  std::string_view value;  ///< What --help calls the value, e.g. "N".
  std::string help;
  /// Parses the text behind '='. @return an error message, or nothing.
  std::function<std::string(std::string_view text)> set;
};

/// A flag for a number of [least, most].
Flag number_flag(std::string_view name, std::string help, unsigned& value, unsigned least, unsigned most);
/// A flag for any text that is not empty.
Flag text_flag(std::string_view name, std::string_view value_name, std::string help, std::string& value);
/// A flag for words separated by commas; empty words are refused.
Flag list_flag(std::string_view name, std::string_view value_name, std::string help, std::vector<std::string>& values);
/// As list_flag(), of known words, each at most once. @param none the word for an empty list, if there is one.
Flag words_flag(std::string_view name, std::string help, std::vector<std::string>& values,
                const std::vector<std::string>& known, const std::string& none = {});
/// A flag for one of the known words.
Flag word_flag(std::string_view name, std::string help, std::string& value, const std::vector<std::string>& known);
/// --device=cpu|gpu.
Flag device_flag(std::string help, std::string& value);

/// Sets the flags of the command line and removes them, so that Google Benchmark sees only its own flags.
/// @return an error message with the flag, or nothing.
std::string take_flags(int& argc, char** argv, const std::vector<Flag>& flags);

/// The lines of --help.
std::string describe(const std::vector<Flag>& flags);

/// Main function of a program that does not use Google Benchmark: parses the flags, and prints @p description and the
/// flags for --help.
/// @param body called with the command line as one text.
/// @return body's exit status; 0 after --help; 2, with a message, for a wrong command line.
int run_with_flags(const char* name, std::string_view description, const std::vector<Flag>& flags, int argc,
                   char** argv, const std::function<int(const std::string& command)>& body);

}  // namespace hiprt::bench
