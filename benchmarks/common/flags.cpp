#include "flags.h"

#include <algorithm>
#include <charconv>
#include <iostream>
#include <span>
#include <utility>

namespace hiprt::bench {

Flag number_flag(std::string_view name, std::string help, unsigned& value, unsigned least, unsigned most) {
  help += " (" + std::to_string(value) + ")";
  return {name, "N", std::move(help), [&value, least, most](std::string_view text) -> std::string {
            unsigned number = 0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
            if (error != std::errc{} || end != text.data() + text.size() || number < least || number > most)
              return "expected a number from " + std::to_string(least) + " to " + std::to_string(most);
            value = number;
            return {};
          }};
}

Flag text_flag(std::string_view name, std::string_view value_name, std::string help, std::string& value) {
  return {name, value_name, std::move(help), [&value](std::string_view text) -> std::string {
            if (text.empty()) return "expected a value";
            value = text;
            return {};
          }};
}

Flag list_flag(std::string_view name, std::string_view value_name, std::string help, std::vector<std::string>& values) {
  return {name, value_name, std::move(help), [&values](std::string_view text) -> std::string {
            values.clear();
            while (true) {
              const std::size_t comma = std::min(text.find(','), text.size());
              if (comma == 0) return "expected words separated by commas";
              values.emplace_back(text.substr(0, comma));
              if (comma == text.size()) return {};
              text.remove_prefix(comma + 1);
            }
          }};
}

Flag words_flag(std::string_view name, std::string help, std::vector<std::string>& values,
                const std::vector<std::string>& known, const std::string& none) {
  std::string all;
  for (const std::string& word : known) all += (all.empty() ? "" : ",") + word;
  return {name, "NAME,...", std::move(help) + " (of " + all + (none.empty() ? "" : "; or " + none) + ")",
          [&values, known, none, all](std::string_view text) -> std::string {
            std::vector<std::string> given;
            if (!none.empty() && text == none) {
              values.clear();
              return {};
            }
            if (std::string fault = list_flag("", "", "", given).set(text); !fault.empty()) return fault;
            for (const std::string& word : given) {
              if (std::find(known.begin(), known.end(), word) == known.end()) return "'" + word + "' is none of " + all;
              if (std::count(given.begin(), given.end(), word) > 1) return "'" + word + "' is there twice";
            }
            values = given;
            return {};
          }};
}

Flag word_flag(std::string_view name, std::string help, std::string& value, const std::vector<std::string>& known) {
  std::string all;
  for (const std::string& word : known) all += (all.empty() ? "" : "|") + word;
  return {name, "NAME", std::move(help) + " (" + all + ")", [&value, known, all](std::string_view text) -> std::string {
            if (std::find(known.begin(), known.end(), text) == known.end())
              return "'" + std::string(text) + "' is none of " + all;
            value = text;
            return {};
          }};
}

Flag device_flag(std::string help, std::string& value) {
  return {"device", "cpu|gpu", std::move(help), [&value](std::string_view text) -> std::string {
            if (text != "cpu" && text != "gpu") return "expected cpu or gpu";
            value = text;
            return {};
          }};
}

std::string take_flags(int& argc, char** argv, const std::vector<Flag>& flags) {
  int kept = 1;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    const std::size_t equals = std::min(argument.find('='), argument.size());
    const auto flag = std::find_if(flags.begin(), flags.end(), [&](const Flag& candidate) {
      return argument.starts_with("--") && argument.substr(2, equals - 2) == candidate.name;
    });
    if (flag == flags.end()) {
      argv[kept++] = argv[i];
      continue;
    }
    const bool has_value = equals < argument.size();
    const std::string fault = has_value ? flag->set(argument.substr(equals + 1)) : "expected '=' and a value";
    if (!fault.empty()) return std::string(argument) + ": " + fault;
  }
  argc = kept;
  return {};
}

std::string describe(const std::vector<Flag>& flags) {
  constexpr std::size_t kColumn = 24;
  std::string text;
  for (const Flag& flag : flags) {
    std::string line = "  --" + std::string(flag.name) + "=" + std::string(flag.value);
    line.resize(std::max(kColumn, line.size() + 1), ' ');
    text += line + flag.help + "\n";
  }
  return text;
}

int run_with_flags(const char* name, std::string_view description, const std::vector<Flag>& flags, int argc,
                   char** argv, const std::function<int(const std::string& command)>& body) {
  constexpr int kUsage = 2;
  const auto wrong = [&](const std::string& what) {
    std::cerr << name << ": " << what << " (see --help)\n";
    return kUsage;
  };
  std::string command = name;
  bool help = false;
  for (const char* argument : std::span(argv, static_cast<std::size_t>(argc)).subspan(1)) {
    command += std::string(" ") + argument;
    help |= std::string_view(argument) == "--help" || std::string_view(argument) == "-h";
  }
  if (help) {
    std::cout << description << describe(flags);
    return 0;
  }
  if (const std::string fault = take_flags(argc, argv, flags); !fault.empty()) return wrong(fault);
  if (argc > 1) return wrong("unknown argument '" + std::string(argv[1]) + "'");
  return body(command);
}

}  // namespace hiprt::bench
