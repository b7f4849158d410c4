// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/common.h"
#include "generator/matching/capture_quality.h"
#include "generator/matching/motion_library.h"
#include "geometry/body/body_model.h"

namespace holdfast::apps {

/// One captured motion of a set.
struct Capture {
  std::string file;      ///< relative to the set's folder
  std::string name;      ///< of the imported clip: the path with '_' for '/'
  std::string subject;   ///< who moved
  std::string category;  ///< "walk", "turn", "reach" ...; empty when the set does not say
  double mark_s = -1.0;  ///< seconds at which the wrist is at what it reaches for; -1: not known
  Side wrist = Side::kRight;
  bool held_out = false;  ///< of a subject that is kept away from training
  std::string fault;      ///< why it is not used; empty when it is
  Clip clip;              ///< on the body, 30 Hz; empty when it could not be imported
  MotionQuality quality;
};

/// A folder of captured motion. With `index.csv` (header line with `file`, `subject`, `category`,
/// and for reaches `hand`, `key_frame`, `fps`; other columns are not read; a note "same take as CMU
/// 08_02" names the subject where it is not known) the files are those it lists; otherwise all
/// `.bvh`, `.amc` (also `.gz`) and `.npz` below the folder, subjects their folders' names. Throws
/// Error naming file, line and column for an index that does not read, and for an empty folder.
std::vector<Capture> ListCaptures(const std::filesystem::path& folder);

/// Splits by subject: those named (or clips named, where the subject of a take is not stated), or
/// without names the subjects with the least motion until they have a tenth of it. Throws Error for
/// a name that no capture has.
void HoldOut(std::vector<Capture>& captures, const std::vector<std::string>& subjects);

/// Imports and measures all captures, in parallel. Clips are kept in `cache` (or where SortClips
/// put them) and taken from there when they are newer than their file. False when interrupted.
bool ImportCaptures(const std::filesystem::path& folder, const std::filesystem::path& cache,
                    const BodyModel& body, const CommonOptions& common,
                    std::vector<Capture>& captures);

/// Moves the imported clips below `cache` into train/, held_out/ and dropped/, so that whoever
/// trains on a folder cannot take the wrong ones.
void SortClips(const std::filesystem::path& cache, const std::vector<Capture>& captures);

/// What a capture may be used for, by its category: walking, or a reach at its mark. A pick-up
/// without a mark has it where the right wrist is lowest. Reaches with leaps, catches and blows are
/// left out: both feet off the ground, or a wrist faster than 4 m/s.
ClipUse UseOf(const Capture& capture, const RetargetBody& body);

}  // namespace holdfast::apps
