#include <tools/cli/build/shape_inputs.h>

#include <tools/base/interrupt.h>
#include <tools/base/output_file.h>
#include <tools/cli/cli.h>
#include <tools/cli/progress.h>

namespace hiprt::tools {

build::Result<std::vector<ShapeSet>> read_shapes(const Cli& cli, std::span<const std::string> inputs,
                                                 const std::string& output, ProgressBar& bar) {
  std::vector<ShapeSet> result;
  for (const std::string& input : inputs) {
    bar.update("read", 0);
    auto shapes = load_shapes(input);
    if (interrupted()) return cancelled();
    if (!shapes) return tl::unexpected(shapes.error());
    bar.clear();
    if (auto checked = check_output(output, {&input, 1}); !checked) return tl::unexpected(checked.error());
    for (const std::string& warning : shapes->warnings) cli.warn(input + ": " + warning);
    if (shapes->size() == 0) cli.warn(input + ": no spheres and no segments of curves in it");
    result.push_back(std::move(*shapes));
  }
  return result;
}

}  // namespace hiprt::tools
