#pragma once
/// What a picture of a scene in parts costs on this machine, and what messages with rays cost.

#include "part_simulation.h"
#include "visit_costs.h"

#include <hiprt_build/error.h>
#include <tools/cli/render/parts_engine.h>

namespace hiprt::bench {

/// Renders a few steps of every tile on one thread that has all parts, and notes which parts the rays visit. Times are
/// processor time of this thread: other programs hardly change them.
/// @param engine of a program that was started alone. @param command the one that it was made from.
/// @param steps of each tile, 1 or more. @param visits what they took is added to it.
/// @return the errors of PartWork::run(); kCancelled when interrupted() became true.
build::Result<PartPictureCosts> measure_parts(tools::PartsEngine& engine, const tools::RenderCommand& command,
                                              std::uint32_t steps, VisitSums& visits);

/// The costs of another picture of the same view: larger, with more steps, and with tiles for so many workers.
PartPictureCosts enlarged(const PartPictureCosts& measured, std::uint32_t width, std::uint32_t height,
                          std::uint32_t steps, unsigned workers);

/// Times how questions and answers are encoded and decoded, in the same way.
ExchangeCosts measure_encoding(std::uint32_t levels);

}  // namespace hiprt::bench
