#include <tools/cli/render/compare_command.h>

#include <tools/base/interrupt.h>
#include <tools/base/output_file.h>
#include <tools/base/text.h>
#include <tools/cli/progress.h>
#include <tools/cli/report.h>
#include <tools/render/image/image_read.h>
#include <tools/render/image/image_write.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>

namespace hiprt::tools {
namespace {

std::string check_png(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  return extension == ".png" || extension == ".PNG" ? std::string() : in_quotes(path) + " does not end in .png";
}

/// Of files that may not be there yet.
bool same_file(const std::string& a, const std::string& b) {
  std::error_code error_a, error_b;
  const auto path_a = std::filesystem::weakly_canonical(a, error_a),
             path_b = std::filesystem::weakly_canonical(b, error_b);
  return !error_a && !error_b && path_a == path_b;
}

/// Four digits of what may be small.
std::string scientific(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3e", value);
  return text.data();
}

}  // namespace

void CompareCommand::add_options(CLI::App& app) {
  constexpr const char* kGroup = "Comparison";
  CLI::Option* const compare = app.add_option("--compare", reference_path_,
                                              "Print the error of the picture against this OpenEXR file of the same "
                                              "size: MSE, relative MSE, PSNR and FLIP")
                                   ->type_name("REF.exr")
                                   ->group(kGroup);
  app.add_option("--difference", map_path_, "PNG of the FLIP error of every pixel, from 0 (dark violet) to 1 (yellow)")
      ->needs(compare)
      ->check(CLI::Validator(check_png, ""))
      ->type_name("FILE")
      ->group(kGroup);
}

build::Result<void> CompareCommand::prepare(std::uint32_t width, std::uint32_t height, const std::string& input,
                                            std::span<const std::string> outputs) {
  if (reference_path_.empty()) return {};
  for (const std::string& output : outputs)
    if (auto checked = check_output(output, std::span(&reference_path_, 1)); !checked) return checked;
  if (!map_path_.empty()) {
    for (const std::string& taken : {input, reference_path_})
      if (auto checked = check_output(map_path_, std::span(&taken, 1)); !checked) return checked;
    for (const std::string& output : outputs)
      if (same_file(output, map_path_))
        return tl::unexpected(
            build::Error{build::ErrorCode::kInvalidInput, map_path_ + ": both the picture and its --difference"});
  }
  auto reference = read_exr_colors(reference_path_);
  if (!reference) return tl::unexpected(std::move(reference.error()));
  if (reference->width != width || reference->height != height)
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                       reference_path_ + ": " + std::to_string(reference->width) + " x " +
                                           std::to_string(reference->height) + " pixels, the picture " +
                                           std::to_string(width) + " x " + std::to_string(height)});
  if (auto finite = check_finite(*reference, reference_path_); !finite) return finite;
  reference_ = std::move(*reference);
  return {};
}

build::Result<void> CompareCommand::run(const Image& image, unsigned threads) {
  if (!reference_) return {};
  auto difference = compare(colors_of(image), std::move(*reference_), threads);
  reference_.reset();
  if (!difference) return tl::unexpected(std::move(difference.error()));
  difference_ = std::move(*difference);
  if (map_path_.empty()) return {};
  ProgressBar bar;
  const auto progress = [&](double done) {
    bar.update("difference", done);
    return !interrupted();
  };
  const auto bytes = write_png(map_path_, flip_picture(*difference_), progress);
  if (!bytes) return tl::unexpected(bytes.error());
  map_bytes_ = *bytes;
  return {};
}

std::string CompareCommand::text() const {
  if (!difference_) return {};
  const std::string psnr = std::isfinite(difference_->psnr) ? fixed(difference_->psnr, 2) + " dB" : "infinite";
  std::string text = "against " + reference_path_ + ": MSE " + scientific(difference_->mse) + ", relative MSE " +
                     scientific(difference_->relative_mse) + ", PSNR " + psnr + ", FLIP " +
                     fixed(difference_->flip, 4) + "\n";
  if (!map_path_.empty()) text += map_path_ + "  " + bytes_text(map_bytes_) + "\n";
  return text;
}

nlohmann::json CompareCommand::json() const {
  if (!difference_) return nullptr;
  nlohmann::json result{{"reference", reference_path_},
                        {"mse", difference_->mse},
                        {"relative_mse", difference_->relative_mse},
                        {"psnr", nullptr},
                        {"flip", difference_->flip},
                        {"difference", nullptr}};
  if (std::isfinite(difference_->psnr)) result["psnr"] = difference_->psnr;
  if (!map_path_.empty()) result["difference"] = {{"path", map_path_}, {"bytes", map_bytes_}};
  return result;
}

}  // namespace hiprt::tools
