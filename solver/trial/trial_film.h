// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/clip/clip_body.h"
#include "solver/trial/trial_clip.h"

namespace holdfast {

/// Pictures of a trial of `scene` as TryClip made it: the hand squeezes, then hand and object are
/// turned to each direction in turn, gravity always down in the picture, as MuJoCo moved them. A
/// line says which direction and the slip. Throws Error as WriteVideo does.
void WriteTrialFilm(const std::filesystem::path& path, const ClipScene& scene,
                    const ClipTrial& trial, int threads = 1);

}  // namespace holdfast
