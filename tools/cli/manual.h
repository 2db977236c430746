#pragma once
/// Manual pages and completion scripts, from the option table that --help prints.

#include <tools/cli/cli.h>

#include <string>
#include <string_view>

namespace hiprt::tools {

/// @return the manual page of the program in the language of man(7). It has no date: equal sources give equal pages.
std::string manual_page(const CLI::App& app, const ToolInfo& info);

/// @param shell "bash", "zsh" or "fish".
/// @return a script that completes the program's options, their values and file names.
std::string completion_script(const CLI::App& app, const ToolInfo& info, std::string_view shell);

}  // namespace hiprt::tools
