// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "generator/matching/capture_quality.h"
#include "generator/matching/motion_library.h"
#include "geometry/body/body_model.h"
#include "geometry/parallel.h"

namespace holdfast {

/// One captured motion of a set.
struct Capture {
  std::string file;      ///< relative to the set's folder
  std::string name;      ///< of the imported clip: CaptureName
  std::string subject;   ///< who moved
  std::string category;  ///< "walk", "turn", "reach" ...; empty when the set does not say
  double mark_s = -1.0;  ///< seconds at which the wrist is at what it reaches for; -1: not known
  Side wrist = Side::kRight;
  bool held_out = false;  ///< of a subject that is kept away from training
  std::string fault;      ///< why it is not used; empty when it is
  Clip clip;              ///< on the body, 30 Hz; empty when it could not be imported
  MotionQuality quality;
  MotionStatistics statistics;
};

/// A folder of captured motion, ready to make motion from. Of use are captures without a fault:
/// walking, and reaches at their marks. A pick-up without a mark has it where the right wrist is
/// lowest. Reaches with leaps, catches and blows are left out: both feet off the ground, or a wrist
/// faster than 4 m/s.
struct CaptureSet {
  std::string name;               ///< of the folder
  std::string body_model;         ///< name of the body that all clips move
  std::vector<Capture> captures;  ///< in the order of the index, or by file
  MotionLibrary library;          ///< what may be learned from
  JointLimits joint_limits = {};  ///< LimitsOf that
  MotionStatistics train = {}, held_out = {};
  double train_minutes = 0.0, held_out_minutes = 0.0;  ///< of captures without a fault
  int dropped = 0;                                     ///< captures with one
  int reach_sources = 0;                               ///< reaches to learn from
};

/// The path of a capture's file with '_' for '/', without .bvh, .amc, .npz (and .gz).
std::string CaptureName(const std::string& file);

/// Imports and measures a folder of captured motion on up to `threads` threads (stage "captured
/// clips"). With `index.csv` (header line with `file`, `subject`, `category`, and for reaches
/// `hand`, `key_frame`, `fps`; other columns are not read; a note "same take as CMU 08_02" names
/// the subject where it is not known) the files are those it lists; otherwise all `.bvh`, `.amc`
/// (also `.gz`) and `.npz` below the folder, subjects their folders' names.
///
/// Held out are the subjects named (or clips named, where the subject of a take is not stated), or
/// without names the subjects with the least motion until they have a tenth of it.
///
/// Imported clips are kept in `cache`, below train/, held_out/ and dropped/ so that whoever trains
/// on a folder cannot take the wrong ones, and taken from there when they are newer than their
/// file. Nothing when `progress` stops it. Throws Error naming file, line and column for an index
/// that does not read, for files that it names and that are not there, for an empty folder, a
/// `cache` that cannot be written, and a name that no capture
/// has, and where nobody to learn from walks.
std::optional<CaptureSet> ImportCaptures(const std::filesystem::path& folder,
                                         const std::filesystem::path& cache, const BodyModel& body,
                                         const std::vector<std::string>& held_out, int threads,
                                         const StagedProgress& progress = {});

}  // namespace holdfast
