// SPDX-License-Identifier: MIT
#pragma once

/// Motion files: BVH, ASF/AMC and SkillMimic's tensors come in as motion of the file's own
/// skeleton; clips go out as BVH and as parameters of body models.
///
/// From the inside out:
///   motion_file.h       SourceMotion: a skeleton through time
///   motion_limits.h     limits of memory and of values
///   bvh.h               reads Biovision hierarchies
///   asf_amc.h           reads Acclaim skeletons and motions
///   skillmimic.h        reads SkillMimic's motions, with their ball
///   bvh_writer.h        a clip as BVH
///   parameter_writer.h  a clip as SMPL-X, SMPL-H, MANO
#include "geometry/io/motion/asf_amc.h"
#include "geometry/io/motion/bvh.h"
#include "geometry/io/motion/bvh_writer.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/io/motion/parameter_writer.h"
#include "geometry/io/motion/skillmimic.h"
