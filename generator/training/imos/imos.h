// SPDX-License-Identifier: MIT
#pragma once

/// Trains the networks of IMoS and the action classifier (LibTorch): sequences of key frames come
/// in; weights for generator/imos come out.
///
/// From the inside out:
///   imos_losses.h          weights and parts of the loss
///   imos_batch.h           sequences as tensors
///   imos_kinematics.h      rotations and joints with gradients
///   imos_networks.h        both modules with gradients
///   imos_augmentation.h    perturbed shapes and stances
///   action_critic.h        adversarial loss, action by action
///   imos_unroll.h          one step and its losses
///   imos_trainer.h         Trainer and its TrainingOptions
///   imos_trainer_state.h   its state, for its own sources
///   action_training.h      the trainer for RunTraining
///   motion_augmentation.h  other stances, sizes and jitter
///   recogniser.h           training of the action classifier
#include "generator/training/imos/action_training.h"
#include "generator/training/imos/imos_trainer.h"
#include "generator/training/imos/recogniser.h"
