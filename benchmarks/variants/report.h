#pragma once
/// A session as tables and as JSON.

#include "session.h"

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace hiprt::bench {

/// The variants that are compiled in, with their registers.
std::string list_text(const Engine& engine, const std::vector<std::vector<std::string>>& values);

/// Million rays per second: one table per tree.
std::string tables(const Engine& engine, const Report& report);

/// @param context what the caller knows: commit, command line, date, machine.
nlohmann::json to_json(const Engine& engine, const Report& report, const nlohmann::json& context);

}  // namespace hiprt::bench
