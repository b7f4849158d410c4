// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "generator/matching/capture_quality.h"
#include "generator/matching/motion_library.h"
#include "geometry/body/body_model.h"
#include "geometry/parallel.h"

namespace holdfast {

// manifest.json of a folder of synthetic clips: a head (schema, seed, options and finally a
// summary) and `clips`, with one line per attempted clip.

/// Lines by their "index".
using ManifestLines = std::map<int, nlohmann::json>;

/// Writes the whole manifest with one clip per line.
void WriteManifest(const std::filesystem::path& path, const nlohmann::json& head,
                   const ManifestLines& lines);

/// Returns the clips of an earlier run of `command` with the same `head`; only the hours may
/// differ. Returns none if there was no run, or if `replace` is set and the earlier run differs.
/// `made_from` ("captures") is named in the Error thrown if the manifest is of a different run.
ManifestLines LinesBefore(const std::filesystem::path& path, const nlohmann::json& head,
                          std::string_view command, std::string_view made_from, bool replace);

/// Removes clips that were written but whose "file" is no longer in `folder`.
void DropLost(ManifestLines& lines, const std::filesystem::path& folder);

/// One captured motion of a set.
struct Capture {
  std::string file;      ///< relative to the folder of the set
  std::string name;      ///< name of the imported clip (see CaptureName)
  std::string subject;   ///< the captured person
  std::string category;  ///< "walk", "turn", "reach" ...; empty if the set does not state it
  double mark_s = -1.0;  ///< time at which the wrist is at its reach target, seconds; -1 if unknown
  Side wrist = Side::kRight;
  bool held_out = false;  ///< its subject is held out of training
  std::string fault;      ///< why the capture is not used; empty if it is used
  Clip clip;              ///< retargeted to the body, 30 Hz; empty if the import failed
  MotionQuality quality;
  MotionStatistics statistics;
};

/// A folder of captured motion, prepared for motion generation. Captures without a fault are used
/// for walking, and for reaches at their marks. In a pick-up without a mark, the mark is the frame
/// in which the right wrist is lowest. Leaps, catches and blows are not used as reaches: all soles
/// are more than 8 cm off the ground, or a wrist is faster than 3.2 m/s (1 m/s at the mark).
struct CaptureSet {
  std::string name;               ///< name of the folder
  std::string body_model;         ///< name of the body that all clips are on
  std::vector<Capture> captures;  ///< in the order of the index, or sorted by file
  MotionLibrary library;          ///< the captures available for training
  JointLimits joint_limits = {};  ///< LimitsOf the training captures
  MotionStatistics train = {}, held_out = {};
  double train_minutes = 0.0, held_out_minutes = 0.0;  ///< of captures without a fault
  int dropped = 0;                                     ///< number of captures with a fault
  int reach_sources = 0;                               ///< number of reaches available for training
};

/// Returns a capture's file path with '_' for '/', without .bvh, .amc, .npz (and .gz).
std::string CaptureName(const std::string& file);

/// Imports and measures a folder of captured motion on up to `threads` threads (stage "captured
/// clips"). The files are those listed in `index.csv` if it exists: a header line with `file`,
/// `subject`, `category`, and for reaches `hand`, `key_frame`, `fps`. Other columns are ignored,
/// except that a note "same take as CMU 08_02" gives the subject where it is unknown. Without an
/// index, the files are all `.bvh`, `.amc` (also `.gz`) and `.npz` below the folder, and each
/// parent folder's name is the subject.
///
/// `held_out` names the held-out subjects (or clips, where the subject of a take is not stated). If
/// it is empty, the subjects with the least motion are held out, up to a tenth of all motion.
///
/// Imported clips are stored in `cache` below train/, held_out/ and dropped/, so that a training
/// run on one folder cannot read clips of another split. A cached clip that is newer than its
/// source file is reused. Returns nullopt if `progress` cancels. Throws Error (with file, line and
/// column) for an invalid index, missing files, an empty folder, an unwritable `cache`, a
/// `held_out` name without a capture, or if no training capture shows walking.
std::optional<CaptureSet> ImportCaptures(const std::filesystem::path& folder,
                                         const std::filesystem::path& cache, const BodyModel& body,
                                         const std::vector<std::string>& held_out, int threads,
                                         const StagedProgress& progress = {});

}  // namespace holdfast
