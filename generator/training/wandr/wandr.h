// SPDX-License-Identifier: MIT
#pragma once

/// Trains the networks of WANDR (LibTorch): folders of clips come in; weights for generator/wandr
/// come out.
///
/// From the inside out:
///   goal_loss.h       loss of motion towards a goal
///   corpus.h          clips to train on
///   unrolled_batch.h  bodies unrolled, gradients carried back
///   window_sampler.h  windows of clips with goals
///   motion_critic.h   adversarial loss on single steps
///   trainer.h         Trainer and its TrainingOptions
///   trainer_state.h   its state, for its own sources
///   reach_training.h  the trainer for RunTraining
#include "generator/training/wandr/corpus.h"
#include "generator/training/wandr/reach_training.h"
#include "generator/training/wandr/trainer.h"
