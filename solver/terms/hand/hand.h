// SPDX-License-Identifier: MIT
#pragma once

/// Energy terms of a hand and an object, one per header; E_d, E_c, E_t are the paper's (IMoS, Ghosh
/// et al. 2023). Object pose (R, T), fingers P or hand vertices z in the object's frame go in;
/// residuals or their Gauss-Newton sums come out.
///
/// From the inside out:
///   skin_distance.h         a residual per skin point's signed distance
///   hand_object_distance.h  E_d: change of hand-object distances
///   contact.h               E_c: distance of pairs that touched
///   vertex_goals.h          skin where another hand had it
///   temporal.h              E_t: change from the previous frame
///   slip.h                  E_s: contacts leaving the surface, drag along it
///   penetration.h           E_p: depth of skin in the object
///   object_in_hand.h        E_o: depth of object surface in the hand
///   intrusion.h             places of the object that are in the hand, around one pose
///   wrist_prior.h           E_w: wrist offset from the clip
///   angle_range.h           one joint's angles beyond their ranges
///   hand_prior.h            joint limits, coupling, distance from a posture
///   finger_collision.h      overlap of fingers with each other
///   grasp_contact.h         distance of pads from the surface
///   object_data.h           object's distance from a given pose
///   object_motion.h         velocity of object and fingers; E_a: acceleration
///   support.h               depth of the object below its support
#include "solver/terms/hand/contact.h"
#include "solver/terms/hand/hand_object_distance.h"
#include "solver/terms/hand/penetration.h"
#include "solver/terms/hand/slip.h"
#include "solver/terms/hand/temporal.h"
