#pragma once
/// The output of a tool with --json.

#include "run_command.h"

#include <tests/catch.h>

#include <nlohmann/json.hpp>

namespace hiprt::test {

/// @return the parsed output of a successful run.
inline nlohmann::json json_of(const CommandResult& result) {
  INFO(result.err);
  REQUIRE(result.status == 0);
  nlohmann::json value = nlohmann::json::parse(result.out, nullptr, false);
  REQUIRE(!value.is_discarded());
  return value;
}

}  // namespace hiprt::test
