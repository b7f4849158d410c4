// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "generator/matching/capture_quality.h"
#include "generator/matching/foot_lock.h"
#include "generator/matching/matched_reaches.h"
#include "generator/matching/motion_library.h"
#include "geometry/clip/clip.h"
#include "solver/body_ik/reach_warp.h"

namespace holdfast {

/// One goal of a synthetic clip.
struct ReachLabel {
  Eigen::Vector3d goal = Eigen::Vector3d::Zero();  ///< of the wrist joint, world, meters
  int frame = 0;                                   ///< at which the wrist is there
  Side wrist = Side::kRight;
  bool warped = false;   ///< warped to the goal; otherwise the goal is the captured wrist position
  double carried_m = 0;  ///< distance of the warp
  double error_m = 0;    ///< of the wrist at the frame
  int source = 0;        ///< library clip of the reach
};

struct ReachClipOptions {
  MatchedReachOptions synthesis;
  ReachWarpOptions warp;
  bool carry_to_goals = true;  ///< false: reaches stay as captured, goals are the wrist positions
};

/// A synthetic motion with its annotations and measures.
struct ReachClip {
  std::vector<BodyFrame> frames;
  std::vector<MotionSegment> segments;
  std::vector<ReachLabel> labels;
  MotionQuality quality;
  MotionStatistics statistics;
  FootLockReport feet;
  int transitions = 0;
  std::string fault;  ///< reason for rejection; empty if accepted
};

/// Synthesizes a motion, locks its feet, warps reaches to their goals and measures it.
/// Deterministic for library, options and seed.
ReachClip MakeReachClip(const MotionLibrary& library, const ReachClipOptions& options,
                        std::uint64_t seed);

/// Writes a clip with its goals as training data for networks (wandr::ReadCorpus): arrays goal (K x
/// 3, world, meters), goal_frame (K), goal_wrist (K; 1 right, 2 left) and a text provenance. Values
/// are rounded to float. Throws Error for a file that cannot be written.
void WriteGoalClip(Clip clip, std::span<const ReachLabel> labels, const nlohmann::json& provenance,
                   const std::filesystem::path& path);

}  // namespace holdfast
