// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "geometry/clip/clip.h"
#include "solver/evaluation/reach_study.h"

namespace holdfast {

/// Clips that the protocol's motions start from and are compared with.
struct CapturedClips {
  std::vector<std::string> names;  ///< of the files, without their ending
  std::vector<Clip> clips;
};

/// Clips, or all clips (.npz) of folders, by name. Throws Error for a folder without any.
CapturedClips ReadCapturedClips(const std::vector<std::string>& paths);

/// Frame 25 of six of them, of as many people as there are.
std::vector<wandr::ReachStart> StartsFrom(const CapturedClips& captured,
                                          const wandr::Normalizer<double>& normalizer);

/// How a captured clip moves, at 30 fps, by what the protocol's motions are measured by.
struct CapturedMotion {
  StudyMotion motion;  ///< what it says of a goal means nothing
  double fast_share = 0.0;
  bool walks = false;  ///< the pelvis gets a meter or more away from where it began
};
std::vector<CapturedMotion> MeasureCaptured(const CapturedClips& captured,
                                            const wandr::LowestPoint& lowest,
                                            const wandr::BoneOffsets<float>& bones, int threads);

/// FS of captured motion, by the same measures.
struct CapturedSkating {
  int clips = 0;
  double surface = 0.0, joints = 0.0;  ///< means over clips
  int walking_clips = 0;               ///< whose pelvis gets at least a meter away
  double walking_surface = 0.0, walking_joints = 0.0;
};
CapturedSkating SkatingOf(const std::vector<CapturedMotion>& motions);

}  // namespace holdfast
