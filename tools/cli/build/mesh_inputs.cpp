#include <tools/cli/build/mesh_inputs.h>

#include <tools/base/interrupt.h>
#include <tools/base/output_file.h>
#include <tools/cli/cli.h>
#include <tools/cli/progress.h>

namespace hiprt::tools {

void warn_of(const Cli& cli, const std::string& input, const Mesh& mesh) {
  for (const std::string& warning : mesh.warnings) cli.warn(input + ": " + warning);
  if (mesh.skipped_faces != 0)
    cli.warn(input + ": skipped " + std::to_string(mesh.skipped_faces) + " faces with fewer than three corners");
  if (mesh.triangles.empty()) cli.warn(input + ": no triangles in it");
}

build::Result<std::vector<Mesh>> read_meshes(const Cli& cli, std::span<const std::string> inputs,
                                             const std::string& output, ProgressBar& bar) {
  std::vector<Mesh> meshes;
  for (const std::string& input : inputs) {
    bar.update("read", 0);
    auto mesh = load_mesh(input);
    if (interrupted()) return cancelled();
    if (!mesh) return tl::unexpected(mesh.error());
    bar.clear();
    if (auto checked = check_output(output, mesh->files); !checked) return tl::unexpected(checked.error());
    warn_of(cli, input, *mesh);
    meshes.push_back(std::move(*mesh));
  }
  return meshes;
}

}  // namespace hiprt::tools
