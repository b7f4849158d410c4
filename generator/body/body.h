// SPDX-License-Identifier: MIT
#pragma once

/// Limbs and hands in closed form: rest joints and a target of wrist or ankle come in; joint
/// rotations come out.
///
/// From the inside out:
///   pose_builder.h      a pose, from the root outwards
///   limb_ik.h           arms and legs as two bones
///   finger_pose.h       relaxed and grasping fingers
///   arm_correction.h    a wrist moved by its arm
///   hand_onto_body.h    a MANO hand's motion given a body; what a conversion came to, as JSON
///   rest_pelvis_note.h  whether a network was trained before the embedded body's pelvis moved
#include "generator/body/arm_correction.h"
#include "generator/body/finger_pose.h"
#include "generator/body/hand_onto_body.h"
#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
