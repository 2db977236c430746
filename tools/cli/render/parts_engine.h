#pragma once
/// bvhrender of a scene in parts.

#include <tools/cli/bvh_file.h>
#include <tools/cli/ranks/rank_mail.h>
#include <tools/cli/render/unit_render.h>
#include <tools/cli/trace_device.h>
#include <tools/parts/part_manifest.h>
#include <tools/render/parts/part_work.h>

#include <hiprt_build/buffer.h>

#include <atomic>

namespace hiprt::tools {

/// A manifest, and its bytes for the picture's key.
struct PartScene {
  build::Buffer bytes;
  PartManifest manifest;
};

/// Checks the options of a scene in parts and reads its manifest.
/// @return kInvalidInput for options that scenes in parts do not have; the errors of read_input() and
/// parse_part_manifest().
build::Result<PartScene> read_part_scene(const RenderCommand& command);
/// The same for bytes that were read.
build::Result<PartScene> part_scene_of(const RenderCommand& command, build::Buffer bytes);

class PartsEngine : public PictureEngine {
 public:
  /// Reads the parts of this rank and the shared part, and starts to answer the questions of other ranks.
  /// @param command with the sky; it, @p scene and @p ranks must live as long as this.
  /// @return kInvalidInput for files that are not those of the manifest; the errors of load_bvh() and
  /// RayMemory::divide().
  static build::Result<std::unique_ptr<PartsEngine>> make(const RenderCommand& command, const PartScene& scene,
                                                          const Camera& camera, Ranks& ranks, const GpuChoice& gpus);

  PictureWork& work() override { return *work_; }
  build::Result<Image> layers() override;
  void stop_layers() override { layers_stopped_ = true; }
  std::string gpu_name() const override { return gpu_name_; }
  PartExchange& exchange() { return *exchange_; }

 private:
  PartsEngine(const RenderCommand& command, const PartScene& scene, Ranks& ranks)
      : command_(command), scene_(scene), mail_(ranks) {}

  build::Result<void> load_shared(const PathSettings& settings, PartExchange::Setup& setup);
  build::Result<std::unique_ptr<PartTracer>> load_own(std::size_t number, const PathSettings& settings,
                                                      const GpuChoice& gpus);

  const RenderCommand& command_;
  const PartScene& scene_;
  RankMail mail_;
  std::string gpu_name_;
  BvhFile shared_file_{};
  HostPart shared_host_;
  PathData shared_data_;
  std::optional<PathScene> shared_;
  std::atomic<bool> layers_stopped_ = false;
  std::unique_ptr<PartExchange> exchange_;
  std::unique_ptr<PartWork> work_;
};

}  // namespace hiprt::tools
