// SPDX-License-Identifier: MIT
#pragma once

/// What trainings share (LibTorch): weights of generator/nn come in, are optimized with
/// checkpoints and evaluations, and go out as weights.
///
/// From the inside out:
///   network_tensors.h       weights into LibTorch and back
///   torch_network.h         networks of generator/nn with gradients
///   checkpoint_file.h       tensors, texts and optimizer states
///   least_squares_critic.h  least-squares adversarial loss
///   training_run.h          RunTraining: iterations, evaluations, files
#include "generator/training/checkpoint_file.h"
#include "generator/training/least_squares_critic.h"
#include "generator/training/torch_network.h"
#include "generator/training/training_run.h"
