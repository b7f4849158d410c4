// SPDX-License-Identifier: MIT
#pragma once

/// What every other folder uses: errors, rotations and rigid poses, threads, progress, seeds,
/// embedded files. Meshes, bodies, clips and files have the folders below it.
///
/// From the inside out:
///   core_time.h     seconds that a thread has had a core
///   isa.h           instruction sets, the best at run time
///   progress.h      callback of long work, may stop it
///   parallel.h      loops over indices on threads
///   seed.h          SplitMix64, many seeds from one
///   error.h         the exception: where, what, what to do
///   value_ranges.h  ranges of numbers that come from files
///   suggestion.h    edit distance, "did you mean"
///   numbered_name.h names of files a frame: x_%04d.ply
///   embedded.h      files of meshes/ inside the library
///   rotation.h      SO(3): exp, log, Jacobians, nearest rotation
///   pose.h          rigid transforms, an object's pose
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "geometry/pose.h"
#include "geometry/progress.h"
#include "geometry/rotation.h"
