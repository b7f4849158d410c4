// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/clip/clip_body.h"
#include "solver/trial/trial_clip.h"

namespace holdfast {

/// Writes a video of a trial of `scene` from TryClip: the hand squeezes, then hand and object are
/// rotated to each direction in turn, with gravity always down in the image, as MuJoCo moved them.
/// A caption shows direction and slip. Throws Error as WriteVideo does.
void WriteTrialFilm(const std::filesystem::path& path, const ClipScene& scene,
                    const ClipTrial& trial, int threads = 1);

}  // namespace holdfast
