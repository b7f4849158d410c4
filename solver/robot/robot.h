// SPDX-License-Identifier: MIT
#pragma once

/// Robot hands: a clip of a human hand with an object and a robot's URDF or MJCF go in; the robot's
/// wrist and joints, frame by frame, with the contacts kept, come out.
///
/// The hand itself is of solver/robot_hand. From the inside out:
///   robot_anatomy.h        palm, fingers, thumb: which is which
///   robot_keypoints.h      joints and tips that stand for the human's
///   hand_correspondence.h  the human's skin and the robot's, place by place
///   robot_solids.h         links as solids
///   near_samples.h         points near a solid, remembered
///   robot_term.h           poses, normal equations, terms
///   robot_pads.h           touching surfaces, part by part
///   robot_distance_term.h, robot_contact_term.h, robot_penetration_term.h, robot_self_term.h,
///   robot_prior_terms.h    the terms
///   robot_solver.h         least squares over one pose
///   human_demonstration.h  what the human hand does
///   robot_start.h          the robot's hand where the human's is
///   start_choice.h         which of the starts' poses is taken: one that holds
///   robot_hold.h           where links touch, and how far the object gives way in their grip
///   transfer_to_robot.h    the whole clip
///   robot_measures.h       how good it is
///   robot_output.h         files: joints, contacts
///   robot_pictures.h       pictures

#include "solver/robot/robot_measures.h"
#include "solver/robot/robot_output.h"
#include "solver/robot/robot_pictures.h"
#include "solver/robot/transfer_to_robot.h"
#include "solver/robot_hand/read_robot.h"
