#pragma once
/// What a picture and rank 0 cost on this machine.

#include "simulation.h"

#include <hiprt_build/error.h>
#include <hiprt_build/open_scene.h>
#include <tools/distributed/ranks.h>
#include <tools/render/scene/camera.h>

namespace hiprt::bench {

/// The picture whose tiles are measured.
struct MeasuredPicture {
  std::uint32_t width = 480, height = 270;
  unsigned rounds = 4;  ///< Units of one step per tile, 2 or more. One thread computes one after the other.
};

/// Times each tile of a path-traced picture of clay, in processor time of this thread: other programs hardly change it.
/// The deviation is that of a tile's rounds.
/// @return the costs of one step; the errors of PathWork::run(); kCancelled when interrupted() became true.
build::Result<PictureCosts> measure_picture(const SceneFile& file, const tools::Camera& camera,
                                            const MeasuredPicture& picture);

/// @return the tile of @p other where the middle of @p tile is. Both pictures have the same view.
std::uint32_t tile_of_view(const tools::PictureGrid& grid, std::uint32_t tile, const tools::PictureGrid& other);

/// The costs of another picture of the same view: larger, with more steps, and with tiles for so many workers.
PictureCosts enlarged(const PictureCosts& measured, std::uint32_t width, std::uint32_t height, std::uint32_t steps,
                      unsigned workers);

/// Times, in the same way, what the dealing thread does for a unit: it deals, cuts, encodes, decodes and pastes.
RankCosts measure_dealing(std::size_t pixel_bytes);

/// All ranks of a run call this. Rank 1 returns the messages of rank 0.
/// @param bytes of a message.
/// @return on rank 0 the processor seconds that its thread for MPI takes for a message, the median of five rounds; on
/// the others 0. kBackend if a rank is lost.
build::Result<double> measure_messages(tools::Ranks& ranks, std::size_t bytes);

/// What single messages between two threads that wait for them cost.
struct SingleMessage {
  double latency;  ///< Seconds until the other thread has it: half of the time until its answer comes. The median.
  double seconds;  ///< Processor seconds of a rank for a message out or in, with the context switches.
  double waiting;  ///< Part of a processor that looking for messages takes, while nothing comes.
};

/// All ranks call this, too. @return on rank 0 the costs of messages between ranks 0 and 1.
build::Result<SingleMessage> measure_single_messages(tools::Ranks& ranks);

/// Seconds of the processor of this thread so far.
double processor_seconds();

}  // namespace hiprt::bench
