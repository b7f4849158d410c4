// SPDX-License-Identifier: MIT
#include "solver/body_ik/reach_clip.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <fmt/format.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/container/npz.h"

namespace holdfast {
namespace {

constexpr int kBefore = 40, kAfter = 41;  // maximum frames around the goal frame that may change
constexpr int kIntoTransition = 6;        // of these, frames before the captured reach begins
constexpr double kGoalError_m = 0.01;     // a reach with a larger error is left as captured
// Acceptance limits of a clip.
constexpr double kFootCorrection_m = 0.20;  // of a planted foot, by foot locking
constexpr double kPelvisSink_m = 0.12;      // for legs to reach
constexpr double kAnkleMissed_m = 0.03;
constexpr double kSkateRatio = 0.15;
constexpr double kLowestSole_m = -0.05;
constexpr double kMaxAcceleration = 150.0;  // m/s^2, of any joint in any frame
constexpr double kP99Acceleration = 34.0;
constexpr double kBeyondLimitsRatio =
    0.01;  // fraction of frames and joints beyond the joint limits

// Window of the k-th reach: within its own captured segment, disjoint from other reaches.
ReachWarp WindowOf(const MatchedReaches& motion, std::size_t k) {
  const ReachEvent& event = motion.reaches[k];
  const int previous = k > 0 ? motion.reaches[k - 1].end : 0;
  const int next = k + 1 < motion.reaches.size() ? motion.reaches[k + 1].begin
                                                 : static_cast<int>(motion.frames.size());
  ReachWarp warp;
  warp.goal = event.goal;
  warp.frame = event.frame;
  warp.wrist = event.wrist;
  warp.begin = std::max({previous, event.begin - kIntoTransition, event.frame - kBefore});
  warp.end = std::min({next, event.end + kIntoTransition, event.frame + kAfter});
  return warp;
}

std::string FaultOf(const ReachClip& clip) {
  const MotionQuality& quality = clip.quality;
  if (clip.feet.max_correction_m > kFootCorrection_m) {
    return fmt::format("a planted foot moved by {:.0f} cm", 100 * clip.feet.max_correction_m);
  }
  if (clip.feet.max_sink_m > kPelvisSink_m) {
    return fmt::format("the pelvis is lowered by {:.0f} cm for the feet to reach their targets",
                       100 * clip.feet.max_sink_m);
  }
  if (clip.feet.max_missed_m > kAnkleMissed_m) {
    return fmt::format("an ankle is {:.0f} cm from its target", 100 * clip.feet.max_missed_m);
  }
  if (quality.skate_ratio > kSkateRatio) {
    return fmt::format("feet slide in {:.0f} % of frames", 100 * quality.skate_ratio);
  }
  if (quality.lowest_sole_m < kLowestSole_m) {
    return fmt::format("feet {:.0f} cm below the ground", -100 * quality.lowest_sole_m);
  }
  if (quality.max_acceleration > kMaxAcceleration) {
    return fmt::format("a joint jumps ({:.0f} m/s^2)", quality.max_acceleration);
  }
  if (quality.p99_acceleration > kP99Acceleration) {
    return fmt::format("jittery ({:.0f} m/s^2 in 1 % of frames and joints)",
                       quality.p99_acceleration);
  }
  if (quality.beyond_limits_ratio > kBeyondLimitsRatio) {
    return fmt::format("{:.1f} % of joint angles beyond captured limits",
                       100 * quality.beyond_limits_ratio);
  }
  return {};
}

}  // namespace

ReachClip MakeReachClip(const MotionLibrary& library, const ReachClipOptions& options,
                        std::uint64_t seed) {
  const Eigen::Matrix3Xd& rest_joints = library.RestJoints();
  MatchedReaches motion = MatchReaches(library, options.synthesis, seed);
  ReachClip clip;
  clip.frames = motion.frames;
  clip.segments = motion.segments;
  clip.transitions = static_cast<int>(motion.segments.size()) - 1;
  const std::vector<FeetTarget> feet =
      LockFeet(rest_joints, library.SolesOfBody(), motion.contacts, clip.frames, {}, &clip.feet);

  for (std::size_t k = 0; k < motion.reaches.size(); ++k) {
    const ReachEvent& event = motion.reaches[k];
    const int wrist = WristJoint(event.wrist);
    const auto wrist_now = [&]() -> Eigen::Vector3d {
      return Place(rest_joints, clip.frames[event.frame]).joints.col(wrist);
    };
    ReachLabel label;
    label.frame = event.frame;
    label.wrist = event.wrist;
    label.source = event.clip;
    const Eigen::Vector3d captured = wrist_now();
    const ReachWarp warp = WindowOf(motion, k);
    const int margin = 3 * options.warp.knot_frames;
    if (options.carry_to_goals && warp.frame - warp.begin >= margin &&
        warp.end - 1 - warp.frame >= margin) {
      const std::vector<BodyFrame> before(clip.frames.begin() + warp.begin,
                                          clip.frames.begin() + warp.end);
      const ReachWarpReport report = WarpReach(rest_joints, feet, warp, options.warp, clip.frames);
      label.warped = report.wrist_error_m < kGoalError_m && report.max_missed_m < kAnkleMissed_m;
      if (label.warped) {
        label.carried_m = (event.goal - captured).norm();
      } else {
        std::copy(before.begin(), before.end(), clip.frames.begin() + warp.begin);
      }
    }
    const Eigen::Vector3d reached = wrist_now();
    label.goal = label.warped ? event.goal : reached;
    label.error_m = (reached - label.goal).norm();
    clip.labels.push_back(label);
  }
  clip.quality = MeasureQuality(rest_joints, library.SolesOfBody(), clip.frames,
                                options.warp.joint_limits, &clip.statistics);
  clip.fault = FaultOf(clip);
  return clip;
}

void WriteGoalClip(Clip clip, std::span<const ReachLabel> labels, const nlohmann::json& provenance,
                   const std::filesystem::path& path) {
  RoundToFloat(clip);
  NpzWriter writer;
  AddArrays(clip, writer);
  std::vector<double> goals;
  std::vector<std::int64_t> frames;
  std::vector<std::uint8_t> wrists;
  for (const ReachLabel& label : labels) {
    goals.insert(goals.end(), label.goal.begin(), label.goal.end());
    frames.push_back(label.frame);
    wrists.push_back(label.wrist == Side::kRight ? kHoldsRight : kHoldsLeft);
  }
  writer.AddFloat64("goal", {labels.size(), 3}, goals);
  writer.AddInt64("goal_frame", {labels.size()}, frames);
  writer.AddUint8("goal_wrist", {labels.size()}, wrists);
  writer.AddText("provenance", JsonText(provenance));
  writer.Write(path);
}

}  // namespace holdfast
