#pragma once
/// bvhrender --compare: compares the rendered picture with a reference.

#include <tools/render/image/image_compare.h>

#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <span>
#include <string>

namespace CLI {
class App;
}  // namespace CLI

namespace hiprt::tools {

class CompareCommand {
 public:
  /// Adds --compare and --difference.
  void add_options(CLI::App& app);

  /// Reads and checks the reference, and checks the path of the map. Call it before long work. Does nothing without
  /// --compare.
  /// @param input, outputs files of the rendering. No file may have two roles.
  /// @return the errors of read_exr_colors(), check_finite() and check_output(). kInvalidInput for a reference of
  /// another size.
  build::Result<void> prepare(std::uint32_t width, std::uint32_t height, const std::string& input,
                              std::span<const std::string> outputs);

  /// Compares and writes the map. Does nothing without --compare.
  /// @pre prepare() succeeded, and @p image has the size that it got.
  /// @return the errors of compare() and write_png().
  build::Result<void> run(const Image& image, unsigned threads);

  /// The result as lines of text; empty without --compare.
  std::string text() const;
  /// The result as JSON; null without --compare.
  nlohmann::json json() const;

 private:
  std::string reference_path_, map_path_;
  std::optional<ColorImage> reference_;
  std::optional<ImageDifference> difference_;
  std::size_t map_bytes_ = 0;
};

}  // namespace hiprt::tools
