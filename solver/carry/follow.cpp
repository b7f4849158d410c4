// SPDX-License-Identifier: MIT
#include "solver/carry/follow.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/error.h"
#include "geometry/parallel.h"
#include "solver/fit/clip_state.h"
#include "solver/fit/finger_repair.h"
#include "solver/hand/hand_axes.h"

namespace holdfast {
namespace {

constexpr double kGridError_m = 0.001;

// Position of the hand as a whole: root of the middle finger.
Eigen::Matrix3Xd HandPlaces(const Clip& clip, const HandModel& hand) {
  Eigen::Matrix3Xd places(3, clip.NumFrames());
  BodyState joints;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(hand.Surface().RestJoints(), clip.pose[t], clip.trans.col(t), joints);
    places.col(t) = joints.joints.col(HandBegin(hand.HandSide()) + 3 * kMiddle);
  }
  return places;
}

void DropShort(int least, std::uint8_t bit, std::vector<std::uint8_t>& bits) {
  const auto frames = bits.size();
  for (std::size_t t = 0; t < frames; ++t) {
    if ((bits[t] & bit) == 0) continue;
    std::size_t end = t;
    while (end < frames && (bits[end] & bit) != 0) ++end;
    if (static_cast<int>(end - t) < least) {
      for (std::size_t u = t; u < end; ++u) bits[u] &= static_cast<std::uint8_t>(~bit);
    }
    t = end;
  }
}

}  // namespace

std::vector<double> SkinGaps(const Clip& clip, const HandModel& hand, const PreparedObject& object,
                             int threads) {
  std::vector<double> gaps(clip.pose.size(), std::numeric_limits<double>::infinity());
  constexpr int kBlock = 16;  // frames that share a scratch hand
  const int frames = clip.NumFrames();
  ParallelFor((frames + kBlock - 1) / kBlock, threads, [&](int block) {
    HandState state(hand);
    for (int t = kBlock * block; t < std::min(frames, kBlock * (block + 1)); ++t) {
      state.SetBody(clip.pose[t], clip.trans.col(t));
      state.Evaluate(FingersOf(clip.pose[t], hand.HandSide()), false);
      const Eigen::Matrix3Xd skin = clip.object->Pose(t).inverse() * state.Vertices();
      for (Eigen::Index i = 0; i < skin.cols(); ++i) {
        // Far away, the grid's value is a lower bound.
        if (object.fit.distance->Distance(skin.col(i)) - kGridError_m > gaps[t]) continue;
        gaps[t] = std::min(gaps[t], object.solid.distance.Distance(skin.col(i)));
      }
    }
  });
  return gaps;
}

std::vector<std::uint8_t> FindFollows(const Clip& clip, std::span<const HandModel* const> hands,
                                      const PreparedObject& object, const FollowProtocol& protocol,
                                      int threads) {
  if (!clip.object) {
    throw Error("clip", "has no object trajectory that could follow a hand",
                "Fit the object first.");
  }
  const int frames = clip.NumFrames();
  const Eigen::Matrix3Xd& vertices = object.fit.vertices;
  const Eigen::Vector3d middle =
      0.5 * (vertices.rowwise().minCoeff() + vertices.rowwise().maxCoeff());
  Eigen::Matrix3Xd places(3, frames);
  Eigen::VectorXd lowest(frames);
  for (int t = 0; t < frames; ++t) {
    const Eigen::Isometry3d pose = clip.object->Pose(t);
    places.col(t) = pose * middle;
    lowest(t) = (pose * vertices).row(2).minCoeff();
  }
  const auto reach = std::max<Eigen::Index>(1, std::lround(protocol.window_s * clip.frame_rate));
  const Eigen::Matrix3Xd velocity = clip.frame_rate * SlopesOverTime(places, reach);
  std::vector<std::uint8_t> follows(static_cast<std::size_t>(frames), 0);
  for (const HandModel* hand : hands) {
    if (hand->NumVertices() == 0) continue;
    const std::uint8_t bit = HoldingBit(hand->HandSide());
    const std::vector<double> gaps = SkinGaps(clip, *hand, object, threads);
    const Eigen::Matrix3Xd hand_velocity =
        clip.frame_rate * SlopesOverTime(HandPlaces(clip, *hand), reach);
    for (int t = 0; t < frames; ++t) {
      const bool lies = lowest(t) < protocol.lying_m && velocity.col(t).norm() < protocol.lying_m_s;
      if (!lies && gaps[t] <= protocol.gap_m &&
          (velocity.col(t) - hand_velocity.col(t)).norm() <= protocol.speed_m_s) {
        follows[t] |= bit;
      }
    }
    DropShort(static_cast<int>(std::lround(protocol.least_s * clip.frame_rate)), bit, follows);
  }
  return follows;
}

}  // namespace holdfast
