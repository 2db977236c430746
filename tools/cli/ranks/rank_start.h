#pragma once
/// How the ranks of bvhrender begin: who has which processor, the scene, and what rank 0 has read for all.

#include <tools/base/digest.h>
#include <tools/cli/bvh_file.h>
#include <tools/cli/ranks/rank_crew.h>
#include <tools/cli/trace_device.h>
#include <tools/render/path/path_data.h>
#include <tools/render/scene/camera.h>
#include <tools/render/units/checkpoint.h>
#include <tools/render/units/rank_shares.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

/// What rank 0 tells a rank.
struct RankBegin {
  RankShare share;
  Camera camera;           ///< Of a picture.
  Digest scene{};          ///< Of the BVH file's bytes.
  bool broadcast = false;  ///< The file comes as a message.
};

/// Rank 0's part.
class LeadStart {
 public:
  explicit LeadStart(RankWatch& watch) : watch_(watch) {}

  /// Waits for the means of all ranks.
  /// @return this rank's share; the errors of RankWatch::news(); kCancelled.
  build::Result<RankShare> gather(const RankMeans& own);
  /// Tells all ranks how to begin. @param bytes of rank 0's BVH file or manifest.
  void begin(std::span<const std::byte> bytes, const Camera& camera, bool broadcasts);
  void send(const PathData& data);
  /// Waits until all ranks can compute. @param key of the picture, which must be theirs.
  /// @return workers of every rank, 0 for lost ones; kInvalidInput if a rank would compute another picture.
  build::Result<std::vector<unsigned>> wait(const PictureKey& key, unsigned own_workers);

 private:
  /// Receives one message of the tag from every rank. @param take called with each.
  build::Result<void> collect(int tag, const std::function<build::Result<void>(const RankMessage&)>& take);
  void share_bytes(std::vector<std::byte> bytes);
  std::vector<int> others() const;

  RankWatch& watch_;
  std::vector<RankShare> shares_;
};

/// The part of the other ranks. Functions wait until rank 0 has answered. They return kCancelled when rank 0 has ended
/// the run or a signal interrupts this process, and the errors of Ranks::health().
class FollowStart {
 public:
  explicit FollowStart(Ranks& ranks) : ranks_(ranks) {}

  build::Result<RankBegin> begin(const RankMeans& own);
  /// @return the file of rank 0: its message, or the mapped file @p path with the same content.
  build::Result<BvhFile> scene(const RankBegin& begin, const std::string& path);
  /// The same for a file that is not a BVH file.
  build::Result<build::Buffer> bytes(const RankBegin& begin, const std::string& path);
  build::Result<PathData> path_data();
  void ready(const PictureKey& key, unsigned workers);

 private:
  build::Result<RankMessage> wait(int tag);
  build::Result<SharedBytes> shared_bytes();

  Ranks& ranks_;
};

/// Takes a rank's share. @param threads of the command line; 0 becomes the rank's share.
GpuChoice take_share(const RankShare& share, unsigned& threads);

/// What this process may use. @param gpus whether it may use GPUs at all.
RankMeans own_means(const Ranks& ranks, bool gpus);

}  // namespace hiprt::tools
