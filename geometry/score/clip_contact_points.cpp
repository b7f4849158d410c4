// SPDX-License-Identifier: MIT
#include "geometry/score/clip_contact_points.h"

#include <algorithm>

#include "geometry/body/end_site.h"
#include "geometry/body/hand_model.h"
#include "geometry/parallel.h"
#include "geometry/score/hand_object_score.h"

namespace holdfast {
namespace {

// Fingers in the order of a hand's joints, as places in kHandParts.
constexpr std::array<int, 5> kPartOfFinger = {2, 3, 5, 4, 1};

// What stays the same in all frames.
struct Hand {
  Hand(std::shared_ptr<const BodyModel> body, const Eigen::VectorXd& betas, Side side)
      : model(std::move(body), betas, side) {
    const int first = HandBegin(side);
    for (int v = 0; v < model.NumVertices(); ++v) {
      const auto weights = model.Surface().Weights(v);
      const int joint = std::max_element(weights.begin(), weights.end(), [](auto& a, auto& b) {
                          return a.second < b.second;
                        })->first;
      const bool is_finger = joint >= first && joint < first + kJointsPerHand;
      part.push_back(is_finger ? kPartOfFinger[(joint - first) / 3] : 0);
    }
    for (int finger = 0; finger < 5; ++finger) {
      tip[kPartOfFinger[finger] - 1] = EndSite(model.Surface(), first + 3 * finger + 2);
    }
  }

  HandModel model;
  std::vector<int> part;               // per vertex
  std::array<Eigen::Vector3d, 5> tip;  // thumb to pinky, from the last joint, T-pose
};

HandPose PoseOf(const HandState& state, const Hand& hand) {
  HandPose pose;
  pose.wrist = state.WorldFromWrist();
  for (int finger = 0; finger < 5; ++finger) {
    const int joint = 3 * finger + 2;
    const int tip = kPartOfFinger[finger] - 1;
    const Eigen::Matrix3d& rotation = state.JointRotation(joint);
    pose.tips[tip] =
        RigidTransform(rotation, state.JointPositions().col(joint) + rotation * hand.tip[tip]);
  }
  return pose;
}

}  // namespace

ClipContactPoints FindContactPoints(const Clip& clip, std::shared_ptr<const BodyModel> body,
                                    const Eigen::VectorXd& betas, const SignedDistance& object,
                                    double threshold_m, int threads) {
  ClipContactPoints result;
  result.object = ObjectPoses(clip);
  result.frame_rate = clip.frame_rate;
  result.object_name = clip.object->name;
  result.threshold_m = threshold_m;
  std::vector<Hand> hands;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    if (!body->HasHand(side)) continue;
    hands.emplace_back(body, betas, side);
    result.hands.push_back(side);
  }
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  result.hand_poses.resize(frames);
  std::vector<std::vector<ContactPoint>> points(frames);
  ParallelFor(clip.NumFrames(), threads, [&](int t) {
    const Eigen::Isometry3d object_from_world = result.object[t].inverse();
    for (const Hand& hand : hands) {
      const Side side = hand.model.HandSide();
      HandState state(hand.model);
      state.SetBody(clip.pose[t], clip.trans.col(t));
      state.Evaluate(FingersOf(clip.pose[t], side), false);
      result.hand_poses[t].push_back(PoseOf(state, hand));
      const Eigen::Matrix3Xd vertices = object_from_world * state.Vertices();
      for (int v = 0; v < hand.model.NumVertices(); ++v) {
        const SignedDistance::Result nearest = object.Query(vertices.col(v));
        if (nearest.distance >= threshold_m) continue;
        points[t].push_back({t, side, hand.part[v], hand.model.Surface().VertexIds()[v],
                             -nearest.distance, nearest.closest, nearest.gradient});
      }
    }
  });
  for (const auto& of_frame : points) {
    result.points.insert(result.points.end(), of_frame.begin(), of_frame.end());
  }
  return result;
}

}  // namespace holdfast
