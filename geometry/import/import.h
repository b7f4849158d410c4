// SPDX-License-Identifier: MIT
#pragma once

/// Files of human motion in any known format come in, detected from the content; clips in SMPL-X
/// parameters (z up, metres) come out, with notes on what was decided.
///
/// From the inside out:
///   imported_clip.h              what importers take and give
///   fields.h                     named values of a file or dict
///   file_kind.h                  what a file is, by its content
///   archive_kind.h, json_kind.h  the same of zip archives, of JSON
///   frame_files.h                folders with one file per frame
///   joint_fields.h               rotations into the joints of poses
///   data_set_files.h             files that another of the set names
///   rotation_arrays.h            rotations of any shape as axis-angle
///   finger_angles.h              hand coefficients and means as angles
///   world_frame.h                worlds turned z-up, put on the ground
///   smplx_parameters.h           bodies in the smplx package's names
///   mano_parameters.h            hands alone, in the same names
///   parameter_array.h            bodies as one array without names
///   amass.h, grab_sequence.h     files of AMASS, of GRAB
///   arctic.h, imos_result.h      files of ARCTIC, results of IMoS
///   import_motion.h              BVH, ASF/AMC and glTF onto a body
///   import_file.h                any of these files
///   held_distance.h              how far holding hands are off
///   load_clip.h                  by name, result folder or file
#include "geometry/import/held_distance.h"
#include "geometry/import/import_file.h"
#include "geometry/import/import_motion.h"
#include "geometry/import/load_clip.h"
