// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_body.h"
#include "solver/carry/refine.h"
#include "solver/fit/prepared_object.h"

namespace holdfast {

/// A captured clip with its object's trajectory.
struct ObjectCapture {
  std::string name;
  Clip clip;
  ClipBody body;
  std::shared_ptr<const PreparedObject> object;
};

/// Clips of a folder and of those below it (.pt, .npz, .glb, in the order of their paths, every
/// n-th) that have an object, at their files' frame rates, moved by `body` (the embedded one when
/// null). The same object is prepared once, on `threads` threads. Throws Error where there are
/// none, and where an object's mesh is missing.
std::vector<ObjectCapture> FindCaptures(const std::filesystem::path& folder,
                                        const std::shared_ptr<const BodyModel>& body = {},
                                        int every = 1, int threads = 1);

/// One side of what is measured, by RefineCarried's protocol.
struct CaptureNumbers {
  int jump_frames = 0;  ///< into which a finger joint jumps (kFingerJump), both hands
  int deep_frames = 0;  ///< hand or fingers and object in one another by more than 2 mm
  double deepest_mm = 0.0;
  int hand_frames_in_contact = 0;  ///< of CaptureRow::hand_frames
  FingertipCounts tips;            ///< in these
  CaptureNumbers& operator+=(const CaptureNumbers& other);
};

struct CaptureRow {
  std::string name, fault;  ///< fault: why it was not refined
  int frames = 0;
  double seconds = 0.0;
  bool fingers_move = false;  ///< else hands have one posture in all frames
  int replaced = 0;           ///< rotations of finger joints that were replaced
  int hand_frames = 0;        ///< in which the object follows a hand, both hands counted
  CaptureNumbers before, after;
  double wrist_rms_mm = 0.0, wrist_max_mm = 0.0;  ///< wrists' way from the clip's, of all frames
  double object_rms_mm = 0.0;                     ///< the object's
  double core_s = 0.0;                            ///< of refining and measuring, time of its core

  double DeepShare() const;     ///< of frames, after
  double ContactShare() const;  ///< of hand_frames, after; 1 where there are none
};

/// Of all rows that were refined. Rows are places in the list.
struct CaptureSums {
  CaptureRow all;  ///< sums; worst of depths and ways
  int refined = 0;
  int flat = 0;  ///< of them: fingers do not move
  std::optional<std::size_t> worst_depth, worst_contact;
};
CaptureSums SumsOf(const std::vector<CaptureRow>& rows);

/// Each clip refined (RefineCarried with default weights, who holds found in the clip), and
/// measured before and after by the same hands in the same frames. Rows in the order of the clips,
/// the same on any number of threads but for times. `progress` may stop it: WorkStopped is thrown.
std::vector<CaptureRow> StudyCaptures(const std::vector<ObjectCapture>& clips, int threads,
                                      const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
