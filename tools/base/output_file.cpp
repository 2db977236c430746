#include <tools/base/output_file.h>

#include <tools/base/errors.h>

#include <hiprt_build/file.h>

#include <filesystem>

namespace hiprt::tools {

build::Result<void> check_output(const std::string& output, std::span<const std::string> inputs) {
  for (const std::string& input : inputs) {
    std::error_code ignored;
    if (std::filesystem::equivalent(input, output, ignored))
      return invalid_input(output + ": the output is one of the inputs");
  }
  return build::check_writable(output);
}

}  // namespace hiprt::tools
