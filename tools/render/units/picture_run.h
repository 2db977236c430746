#pragma once
/// Computes a picture of units on this process and on other ranks.

#include <tools/render/units/checkpoint.h>
#include <tools/render/units/crew.h>

#include <functional>

namespace hiprt::tools {

/// Callbacks, called by the thread that calls compute().
struct PictureHooks {
  std::function<void(double)> fraction{};                       ///< 0 to 1, often.
  std::function<void()> step{};                                 ///< Often, when the state is consistent.
  std::function<void(const build::Error&)> checkpoint_fault{};  ///< A checkpoint could not be written. Called once.
};

/// Computes the steps that @p state lacks.
/// @param crew nullptr: this process does all the work. @param checkpoint nullptr: nothing is kept. Otherwise the state
/// is written to it from time to time, and also at the end if the picture is not whole, for whatever reason.
/// @return whether the picture is whole; false after interrupted(). The errors of PictureWork::run(), Crew::poll(), and
/// after an interruption those of Checkpoint::write().
build::Result<bool> compute(PictureWork& work, PictureState& state, Crew* crew, Checkpoint* checkpoint,
                            const PictureHooks& hooks);

}  // namespace hiprt::tools
