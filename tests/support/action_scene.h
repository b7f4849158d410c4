// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "generator/imos/action_sequence.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/rotation.h"
#include "tests/support/wandr_scene.h"

/// Somebody who does something with an object, composed, not made: what IMoS learns from in tests.
namespace holdfast::imos::testing {

/// Where the right wrist of an action goes, in front of a body that faces -y, meters.
struct ComposedAction {
  std::string action, object;
  Eigen::Vector3d there;
};
inline const std::array<ComposedAction, 3> kComposedActions{{
    {"drink", "mug", {-0.05, -0.25, 1.45}},
    {"pass", "apple", {-0.1, -0.6, 1.15}},
    {"call", "phone", {-0.2, -0.1, 1.5}},
}};

/// Two seconds at 30 fps: the wrist waits, goes there and stays; an object 10 cm from the wrist is
/// carried with it. `style` moves start and end by a few centimeters.
inline Clip ComposedActionClip(int which, int style, const std::string& subject = "s2") {
  const ComposedAction& what = kComposedActions[which % kComposedActions.size()];
  const Eigen::Vector3d sway(0.01 * (style % 3), 0.015 * (style % 4), 0.01 * (style % 5));
  std::vector<ReachKey> keys(4);
  keys[0].wrist = Eigen::Vector3d(-0.25, -0.25, 1.0) + sway;
  keys[1].time_s = 0.5;
  keys[1].wrist = keys[0].wrist;
  keys[2].time_s = 1.5 + 0.05 * (style % 3);
  keys[2].wrist = what.there + sway;
  keys[3].time_s = 2.0;
  keys[3].wrist = keys[2].wrist;
  Clip clip = MakeReachMotion(wandr::testing::DefaultBody(), keys);
  clip.subject = subject;
  clip.action = what.action;
  clip.body_model = BodyModel::Default()->Name();
  clip.betas = Eigen::VectorXd::Zero(10);
  clip.holding_hand.assign(clip.NumFrames(), kHoldsRight);
  ObjectTrack track;
  track.name = what.object;
  track.mesh = what.object;
  track.trans.resize(3, clip.NumFrames());
  track.orient.resize(3, clip.NumFrames());
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(wandr::testing::DefaultBody().rest_joints, clip.pose[t], clip.trans.col(t),
                  state);
    track.trans.col(t) =
        state.joints.col(21) + state.world_rotation[21] * Eigen::Vector3d(-0.1, 0.0, 0.0);
    track.orient.col(t) = LogSO3(state.world_rotation[21]);
  }
  clip.object = track;
  return clip;
}

inline ActionSequence ComposedSequence(int which, int style, const std::string& subject = "s2") {
  ActionSequence sequence = SequenceFromClip(ComposedActionClip(which, style, subject),
                                             wandr::testing::DefaultBody().rest_joints);
  sequence.name = "composed";
  return sequence;
}

/// A folder as `make-actions` writes it: <folder>/<subject>/<object>_<action>_<n>.npz.
inline void WriteComposedSet(const std::filesystem::path& folder, int per_subject,
                             const std::vector<std::string>& subjects = {"s1", "s2", "s10"}) {
  for (const std::string& subject : subjects) {
    std::filesystem::create_directories(folder / subject);
    for (int k = 0; k < per_subject; ++k) {
      const Clip clip = ComposedActionClip(k, k, subject);
      const std::string name =
          clip.object->name + "_" + clip.action + "_" + std::to_string(k) + ".npz";
      WriteClip(clip, folder / subject / name);
    }
  }
}

}  // namespace holdfast::imos::testing
