// SPDX-License-Identifier: MIT
#pragma once

#include "generator/scripted/reach_motion.h"
#include "generator/training/wandr/trainer.h"

namespace holdfast::wandr {

/// For RunTraining: a network of WANDR, evaluated by the adaptive protocol on starts that no table
/// is made of, one sample a goal; the best reaches most goals. `body` has the trainer's bones,
/// `held_out` (may be null) clips for losses on what is not trained on. All must outlive it.
Training ReachTraining(Trainer& trainer, const Corpus& corpus, const Corpus* held_out,
                       const BodyMeasures& body);

}  // namespace holdfast::wandr
