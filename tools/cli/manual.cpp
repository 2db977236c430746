#include <tools/cli/manual.h>

#include <hiprt_build/build.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <sstream>
#include <vector>

namespace hiprt::tools {

namespace {

/// The value of an option, as --help describes it.
struct Value {
  bool taken = false;
  bool file = false;
  std::string name;                  ///< "N", "FILE", "NAME"
  std::vector<std::string> choices;  ///< Empty: any value.
};

/// The parser's type text is for example "NAME:{cpu,amd,nvidia}", "N:UINT in [0 - 4096]" or "REF.exr".
Value value_of(const CLI::Option& option) {
  Value value;
  value.taken = option.get_items_expected_max() > 0;
  if (!value.taken) return value;
  const std::string type = option.get_type_name();
  value.name = type.substr(0, type.find(':'));
  if (const std::size_t begin = type.find(":{"); begin != std::string::npos) {
    std::istringstream list(type.substr(begin + 2, type.find('}') - begin - 2));
    for (std::string choice; std::getline(list, choice, ',');) value.choices.push_back(choice);
  }
  for (const char* word : {"FILE", "MESH", "REF", "CAMERA", "TREE"})
    value.file = value.file || value.name.starts_with(word);
  return value;
}

std::string joined(const std::vector<std::string>& words, const char* separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
  return text;
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return option->nonpositional(); });
}

/// Text with every character of @p special preceded by @p escape.
std::string escaped(std::string_view text, std::string_view special, std::string_view escape) {
  std::string result;
  for (const char character : text) {
    if (special.find(character) != std::string_view::npos) result += escape;
    result += character;
  }
  return result;
}

// --- Manual pages ---------------------------------------------------------------------------------------------------

/// @return the text, with escapes for the characters that man(7) would interpret.
std::string roff(std::string_view text) {
  std::string result;
  for (const char character : text) {
    if (character == '\\') {
      result += "\\e";
    } else if (character == '-') {
      result += "\\-";
    } else {
      if ((character == '.' || character == '\'') && (result.empty() || result.back() == '\n')) result += "\\&";
      result += character;
    }
  }
  return result;
}

/// Splits text into paragraphs. A paragraph with indented lines is a table: its lines are kept.
std::string paragraphs(const std::string& text) {
  std::string result, block;
  const auto flush = [&] {
    if (block.empty()) return;
    const bool table = block.find("\n  ") != std::string::npos || block.starts_with("  ");
    result += ".PP\n" + (table ? ".nf\n" + roff(block) + ".fi\n" : roff(block));
    block.clear();
  };
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) {
      flush();
    } else {
      block += line + "\n";
    }
  }
  flush();
  return result;
}

std::string manual_of(const CLI::Option& option) {
  const Value value = value_of(option);
  std::string text = ".TP\n";
  std::string names;
  for (const std::string& name : option.nonpositional() ? names_of(option) : std::vector{option.get_name()})
    names += (names.empty() ? "" : ", ") + ("\\fB" + roff(name) + "\\fR");
  text += names;
  if (value.taken && !value.name.empty()) text += " \\fI" + roff(value.name) + "\\fR";
  text += "\n" + roff(option.get_description()) + "\n";
  if (!value.choices.empty()) text += ".br\nValues: " + roff(joined(value.choices, ", ")) + "\n";
  if (value.taken && !option.get_default_str().empty())
    text += ".br\nDefault: " + roff(option.get_default_str()) + "\n";
  return text;
}

// --- Completion -----------------------------------------------------------------------------------------------------

std::string bash_script(const CLI::App& app, const std::string& name) {
  std::vector<std::string> all;
  std::string cases;
  for (const CLI::Option* option : options_of(app)) {
    const auto names = names_of(*option);
    all.insert(all.end(), names.begin(), names.end());
    const Value value = value_of(*option);
    if (!value.taken || value.file) continue;
    cases += "    " + joined(names, " | ") + ")\n";
    cases += value.choices.empty() ? "      compopt +o default\n"
                                   : "      mapfile -t COMPREPLY < <(compgen -W \"" + joined(value.choices, " ") +
                                         "\" -- \"$current\")\n";
    cases += "      return ;;\n";
  }
  return "# Completion of " + name + " for bash.\n_" + name +
         "() {\n  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}\n  COMPREPLY=()\n"
         "  case $previous in\n" +
         cases + "  esac\n  if [[ $current == -* ]]; then\n    mapfile -t COMPREPLY < <(compgen -W \"" +
         joined(all, " ") + "\" -- \"$current\")\n  fi\n}\ncomplete -o default -F _" + name + " " + name + "\n";
}

std::string zsh_script(const CLI::App& app, const std::string& name) {
  std::string arguments;
  for (const CLI::Option* option : options_of(app)) {
    const Value value = value_of(*option);
    const std::string description = escaped(option->get_description(), "[]:\\", "\\");
    std::string rest = "[" + description + "]";
    if (value.taken) {
      rest += ":" + escaped(value.name.empty() ? "value" : value.name, "[]:\\", "\\") + ":";
      if (value.file) rest += "_files";
      if (!value.choices.empty()) rest += "(" + joined(value.choices, " ") + ")";
    }
    std::string quoted;
    for (const char character : rest) quoted += character == '\'' ? std::string("'\\''") : std::string(1, character);
    for (const std::string& spelling : names_of(*option)) arguments += "  '*" + spelling + quoted + "' \\\n";
  }
  return "#compdef " + name + "\n# Completion of " + name + " for zsh.\n_arguments -s \\\n" + arguments +
         "  '*:file:_files'\n";
}

std::string fish_script(const CLI::App& app, const std::string& name) {
  std::string text = "# Completion of " + name + " for fish.\n";
  for (const CLI::Option* option : options_of(app)) {
    const Value value = value_of(*option);
    text += "complete -c " + name;
    for (const std::string& spelling : option->get_snames()) text += " -s " + spelling;
    for (const std::string& spelling : option->get_lnames()) text += " -l " + spelling;
    if (value.taken) text += value.file ? " -r -F" : " -x";
    if (!value.choices.empty()) text += " -a '" + joined(value.choices, " ") + "'";
    text += " -d '" + escaped(option->get_description(), "'\\", "\\") + "'\n";
  }
  return text;
}

}  // namespace

std::string manual_page(const CLI::App& app, const ToolInfo& info) {
  const std::string description = info.description, name = info.name;
  std::string title = name;
  std::transform(title.begin(), title.end(), title.begin(), [](char c) { return static_cast<char>(c - 'a' + 'A'); });
  std::string summary = description.substr(0, std::min(description.find_first_of(".:\n"), description.size()));
  summary[0] = static_cast<char>(summary[0] - 'A' + 'a');
  std::string text = ".TH " + title + " 1 \"\" \"hiprt " + build::version() + "\" \"hiprt\"\n.SH NAME\n" + name +
                     " \\- " + roff(summary) + "\n.SH SYNOPSIS\n.B " + name + "\n[\\fIOPTION\\fR]...";
  const auto positionals = app.get_options([](const CLI::Option* option) { return option->get_positional(); });
  for (const CLI::Option* option : positionals) {
    const bool several = option->get_items_expected_max() > 1;
    const std::string word = "\\fI" + roff(option->get_name()) + "\\fR" + (several ? "..." : "");
    text += option->get_required() ? " " + word : " [" + word + "]";
  }
  text += "\n.SH DESCRIPTION\n" + paragraphs(description) + ".SH OPTIONS\n";
  for (const CLI::Option* option : positionals) text += manual_of(*option);
  for (const std::string& group : app.get_groups()) {
    std::string options;
    for (const CLI::Option* option : options_of(app))
      if (option->get_group() == group) options += manual_of(*option);
    if (!options.empty()) text += ".SS " + roff(group) + "\n" + options;
  }
  text +=
      ".SH EXIT STATUS\n0: success. 1: bad input or a failed operation. 2: a wrong command line.\n.SH EXAMPLES\n.nf\n" +
      roff(info.examples) + ".fi\n.SH SEE ALSO\n";
  std::vector<std::string> others;
  for (const char* other : {"bvhbuild", "bvhinfo", "bvhquery", "bvhrender", "bvhtrace"})
    if (name != other) others.push_back(std::string("\\fB") + other + "\\fR(1)");
  return text + joined(others, ", ") + "\n";
}

std::string completion_script(const CLI::App& app, const ToolInfo& info, std::string_view shell) {
  if (shell == "zsh") return zsh_script(app, info.name);
  if (shell == "fish") return fish_script(app, info.name);
  return bash_script(app, info.name);
}

}  // namespace hiprt::tools
