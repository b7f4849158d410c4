// SPDX-License-Identifier: MIT
#pragma once

#include "generator/training/imos/imos_batch.h"

/// Few people show what a data set has. What follows makes more of them, in place and differently
/// in each batch, so that networks learn what somebody does and not who they are.
namespace holdfast::imos {

/// Adds N(0, deviation^2) to betas. Bones stay.
void DisturbShapes(SequenceTensors& batch, double deviation, at::Generator& generator);

/// Turns joints by N(0, deviation^2) axis-angles, radians: those of legs, trunk and head by the
/// same in all key frames (the pelvis by half of it), those of arms in the given key frames, less
/// and less afterwards, and not at all from key frame 10 on: from elsewhere to where the hand
/// should be. What a wrist carries goes with it; joints follow.
void DisturbStances(SequenceTensors& batch, double deviation_rad, at::Generator& generator);

}  // namespace holdfast::imos
