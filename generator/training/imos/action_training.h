// SPDX-License-Identifier: MIT
#pragma once

#include "generator/imos/action_set.h"
#include "generator/training/imos/imos_trainer.h"

namespace holdfast::imos {

/// For RunTraining: networks of IMoS, evaluated by free rollouts on a hundred sequences trained on
/// and on those to validate with. Without a critic the best have the least MPJPE; with one the last
/// are kept: a distance to what truly happened is least for the mean of what may happen. Notes say
/// seconds per key frame by action, and sequences by action and object. `trainer`, of `set.train`,
/// and `set` must outlive it.
Training ActionTraining(Trainer& trainer, const ActionSet& set);

/// Errors (RolloutErrors) by which a line is judged.
const nlohmann::json& ErrorsOf(const nlohmann::json& line);

}  // namespace holdfast::imos
