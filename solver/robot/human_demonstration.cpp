// SPDX-License-Identifier: MIT
#include "solver/robot/human_demonstration.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/error.h"
#include "solver/fit/clip_state.h"

namespace holdfast {
namespace {

constexpr double kFar_m = 0.05;
constexpr double kGrasping_m = 0.02, kStill_m = 2.5e-4;  // of an unchanged grasp
constexpr double kSameContact_m = 2e-3;
constexpr double kNearScale_m = 0.0015;  // decay length of the weights within a contact

// Contacts of one frame: for each part, the mean of its touching pad, projected onto the surface.
std::vector<PartContact> ContactsOf(const HumanFrame& frame, const HandLandmarks& landmarks,
                                    const SignedDistance& object) {
  std::vector<PartContact> contacts;
  for (int part = 0; part < kNumHandParts; ++part) {
    Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
    double sum = 0.0;
    for (const int v : landmarks.Pad(part)) {
      if (frame.distance(v) > kDemonstratedTouch_m) continue;
      const SignedDistance::Result hit = object.Query(frame.vertices.col(v));
      const double weight = std::exp(-std::max(hit.distance, 0.0) / kNearScale_m);
      point += weight * hit.closest;
      normal += weight * hit.gradient;
      sum += weight;
    }
    if (!(sum > 0.0) || normal.norm() < 0.3 * sum) continue;  // around an edge: no unique direction
    const SignedDistance::Result on = object.Query(point / sum);
    PartContact contact{part, on.closest, normal.normalized(), 1.0};
    if (on.gradient.dot(contact.normal) > 0.7) contact.normal = on.gradient.normalized();
    contacts.push_back(contact);
  }
  return contacts;
}

}  // namespace

HumanDemonstration ReadDemonstration(const ClipScene& scene, const HandModel& hand,
                                     const HandLandmarks& landmarks, const HandAxes& axes,
                                     const SignedDistance& object) {
  const Clip& clip = scene.clip;
  HumanDemonstration out;
  out.side = hand.HandSide();
  out.frame_rate = clip.frame_rate;
  HandState state(hand);
  bool touched = false;
  // Nearest face of each vertex: start of its next search.
  std::vector<int> faces(static_cast<std::size_t>(hand.Surface().RestVertices().cols()), -1);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    state.SetBody(clip.pose[t], clip.trans.col(t));
    state.Evaluate(FingersOf(clip.pose[t], out.side), false);
    HumanFrame frame;
    frame.world_from_object = clip.object->Pose(t);
    const Eigen::Isometry3d object_from_world = frame.world_from_object.inverse();
    frame.vertices = object_from_world * state.Vertices();
    frame.object_from_wrist = object_from_world * state.WorldFromWrist();
    const auto joints = state.JointPositions();
    frame.joints = object_from_world * Eigen::Matrix3Xd(joints);
    for (int f = 0; f < kNumFingers; ++f) {
      const Eigen::Vector3d last = axes.RestTips().col(f) - axes.RestJoints().col(3 * f + 2);
      frame.tips.col(f) =
          object_from_world * (joints.col(3 * f + 2) + state.JointRotation(3 * f + 2) * last);
    }
    frame.distance.resize(frame.vertices.cols());
    const Eigen::Vector3d low = object.Min().array() - kFar_m, high = object.Max().array() + kFar_m;
    for (Eigen::Index v = 0; v < frame.vertices.cols(); ++v) {
      const Eigen::Vector3d x = frame.vertices.col(v);
      frame.distance(v) = kFar_m;
      if ((x.array() <= low.array()).any() || (x.array() >= high.array()).any()) continue;
      const SignedDistance::Result hit = object.Query(x, faces[v]);
      frame.distance(v) = hit.distance;
      faces[v] = hit.face;
    }
    frame.holds = clip.holding_hand.empty() || (clip.holding_hand[t] & HoldingBit(out.side)) != 0;
    if (frame.holds) frame.contacts = ContactsOf(frame, landmarks, object);
    frame.holds = frame.holds && !frame.contacts.empty();
    touched = touched || frame.holds;
    out.frames.push_back(std::move(frame));
  }
  if (!touched) {
    throw Error(scene.source,
                std::string("its ") + std::string(SideName(out.side)) +
                    " hand never touches the object while it holds it",
                "Fit the object first (holdfast fit, refine), or give the other hand");
  }
  return out;
}

int AnchorFrame(const HumanDemonstration& demonstration) {
  std::size_t most = 0;
  for (const HumanFrame& frame : demonstration.frames) most = std::max(most, frame.contacts.size());
  std::vector<int> frames;
  for (std::size_t t = 0; t < demonstration.frames.size(); ++t) {
    if (demonstration.frames[t].contacts.size() == most) frames.push_back(static_cast<int>(t));
  }
  return frames[frames.size() / 2];
}

bool SameGrasp(const HumanFrame& a, const HumanFrame& b) {
  // Contacts of a file can move more than the skin.
  if (!a.holds || !b.holds ||
      !std::ranges::equal(a.contacts, b.contacts, [](const PartContact& x, const PartContact& y) {
        return x.part == y.part && (x.point - y.point).norm() <= kSameContact_m;
      })) {
    return false;
  }
  for (Eigen::Index v = 0; v < a.vertices.cols(); ++v) {
    if (a.distance(v) > kGrasping_m) continue;
    if ((a.vertices.col(v) - b.vertices.col(v)).squaredNorm() > kStill_m * kStill_m) return false;
  }
  return true;
}

Side HoldingSide(const ClipScene& scene, const SignedDistance& object) {
  const Clip& clip = scene.clip;
  std::array<int, 2> frames{};
  for (const std::uint8_t bits : clip.holding_hand) {
    frames[0] += (bits & kHoldsRight) != 0;
    frames[1] += (bits & kHoldsLeft) != 0;
  }
  if (!clip.holding_hand.empty()) return frames[1] > frames[0] ? Side::kLeft : Side::kRight;
  if (const auto lone = scene.body->LoneHand()) return *lone;
  std::array<double, 2> sums{};
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const HandModel hand(scene.body, scene.betas, side);
    HandState state(hand);
    const int step = std::max(1, clip.NumFrames() / 16);
    for (int t = 0; t < clip.NumFrames(); t += step) {
      state.SetBody(clip.pose[t], clip.trans.col(t));
      state.Evaluate(FingersOf(clip.pose[t], side), false);
      const Eigen::Matrix3Xd x = clip.object->Pose(t).inverse() * state.Vertices();
      sums[side == Side::kLeft] += std::max(object.Distances(x).minCoeff(), 0.0);
    }
  }
  return sums[1] < sums[0] ? Side::kLeft : Side::kRight;
}

}  // namespace holdfast
