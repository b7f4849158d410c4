// SPDX-License-Identifier: MIT
#pragma once

/// Measures of hands and objects: clips, poses and meshes come in; penetration, contact, jitter
/// and pose errors come out, with the protocol they were measured by.
///
/// From the inside out:
///   object_shape.h         moments of area, diameter
///   object_symmetry.h      rotations that keep the surface
///   object_pose_error.h    error between poses of one object
///   rigid_jitter.h         acceleration and jerk of rigid bodies
///   contact_metrics.h      one hand, one frame; ContactProtocol
///   contact_track.h        contact from frame to frame
///   ball_tree.h            points in balls; private
///   exact_intersection.h   exact volumes of two solids
///   clipped_volume.h       exact volumes from clipped faces; private
///   clearance_memory.h     distances carried from frame to frame; private
///   hand_object_score.h    one hand and object, a clip
///   own_body_score.h       object and arms in the own body
///   contact_score.h        all hands of a clip together
///   clip_contact_points.h  touching vertices and hand poses
///   contact_writer.h       these as .npz or .csv
#include "geometry/score/contact_score.h"
#include "geometry/score/contact_writer.h"
#include "geometry/score/hand_object_score.h"
#include "geometry/score/object_pose_error.h"
#include "geometry/score/own_body_score.h"
