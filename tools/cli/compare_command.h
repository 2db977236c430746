#pragma once
/// bvhrender --compare: the picture that was just rendered beside a reference.

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
  /// --compare and --difference.
  void add_options(CLI::App& app);

  /// To be called before long work: reads the reference and checks it, and where the map is to be written. Does nothing
  /// without --compare.
  /// @param input, outputs of the rendering: no file may be two things.
  /// @return the errors of read_exr_colors(), check_finite() and check_output(), or kInvalidInput: a reference of
  /// another size.
  build::Result<void> prepare(std::uint32_t width, std::uint32_t height, const std::string& input,
                              std::span<const std::string> outputs);

  /// Compares and writes the map. Does nothing without --compare.
  /// @pre prepare() did well, @p image has that size.
  /// @return the errors of compare() and write_png().
  build::Result<void> run(const Image& image, unsigned threads);

  /// Lines; empty without --compare.
  std::string text() const;
  /// null without --compare.
  nlohmann::json json() const;

 private:
  std::string reference_path_, map_path_;
  std::optional<ColorImage> reference_;
  std::optional<ImageDifference> difference_;
  std::size_t map_bytes_ = 0;
};

}  // namespace hiprt::tools
