// SPDX-License-Identifier: MIT
#pragma once

/// Terms of a whole motion, for latent optimization, one per header. World positions q and
/// rotations of joints, or latents z, go in; residuals and their Jacobians come out.
///
/// From the inside out, none needs another:
///   latent_prior.h        z - z_0: latents off their sample
///   joint_goal.h          q - G: a joint off its goal
///   first_arrival.h       soft minimum of |q_t - G| over frames
///   approach_direction.h  forearm direction off a, unit
///   look_at.h             A e_z - g: face turned off a place
///   stand_near.h          pelvis too far from the goal
///   pelvis_path.h, pelvis_speed.h  off an even walk; too fast
///   heading_turn.h        heading turned too fast
///   heading_along.h       heading off the way
///   cadence.h             steps taken too often
///   upright_trunk.h       neck too far from above the pelvis
///   walking_height.h      pelvis too low on the way
///   joint_acceleration.h  (q_0 - 2 q_1 + q_2) / dt^2
///   rotation_range.h      joint angle beyond captured ones
///   standing_balance.h    c - m: middle of mass off the feet
///   foot_skate.h          q' - q of a foot on the floor
///   floor_contact.h       depth of a joint below the floor
///   airborne.h            height of the lowest foot joint
///   obstacle.h            phi(q): a joint too near a solid
#include "solver/terms/motion/cadence.h"
#include "solver/terms/motion/first_arrival.h"
#include "solver/terms/motion/foot_skate.h"
#include "solver/terms/motion/heading_along.h"
#include "solver/terms/motion/heading_turn.h"
#include "solver/terms/motion/joint_acceleration.h"
#include "solver/terms/motion/joint_goal.h"
#include "solver/terms/motion/latent_prior.h"
