// SPDX-License-Identifier: MIT
#pragma once

/// Synthetic clips of people who use objects. An action script, a person, an object and a capture
/// of someone standing go in, or markers of someone who drinks or combs; labelled clips with object
/// and fingers fitted, and their quality, come out.
///
/// From the inside out:
///   action_stance.h       gaze, lean, shoulders as scripted
///   action_frame_block.h  terms of one frame, 26 residuals
///   action_grasps.h, action_pairs.h  grasps of one hand; of both at once
///   action_choice.h       grasp and key poses that suit arms
///   action_body.h         trunk, head, right arm of all frames
///   action_motion.h       body and object by a script
///   action_studio.h       persons, objects, their grasps, shared by clips
///   action_clip.h, action_measures.h  MakeActionClip: one clip; its quality, faults
///   captured_action.h     drinking and combing found in a capture; on another body
///   captured_brush.h      a brush in a hand that goes over the head
///   captured_clip.h       MakeCapturedClip: captured arms, an object fitted
///   action_plan.h         actions, objects, subjects of a set
///   action_shelf.h        what clips of a set share, made when it is asked for
///   make_action_set.h     MakeActionSet: a folder of clips
#include "solver/actions/action_clip.h"
#include "solver/actions/action_grasps.h"
#include "solver/actions/make_action_set.h"
