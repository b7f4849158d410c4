// SPDX-License-Identifier: MIT
#include "geometry/score/hand_object_score.h"

#include <algorithm>
#include <atomic>
#include <mutex>

#include "geometry/error.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "geometry/score/object_shape.h"

namespace holdfast {
namespace {

// The hand's mesh in the object's coordinate frame.
TriangleMesh HandInObject(const Clip& clip, const HandModel& hand, int t) {
  HandState state(hand);
  state.SetBody(clip.pose[t], clip.trans.col(t));
  state.Evaluate(FingersOf(clip.pose[t], hand.HandSide()), false);
  const Eigen::Matrix3d object_from_world = ExpSO3(clip.object->orient.col(t)).transpose();
  return {object_from_world * (state.Vertices().colwise() - clip.object->trans.col(t)),
          hand.Surface().Faces()};
}

// Vertices of the object inside the hand; those outside the hand's box are not asked for.
void MeasureObjectInHand(const Eigen::Matrix3Xd& vertices, const SignedDistance& hand,
                         HandObjectFrame& frame) {
  std::vector<Eigen::Index> near;
  for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
    const auto v = vertices.col(i).array();
    if ((v > hand.Min().array()).all() && (v < hand.Max().array()).all()) near.push_back(i);
  }
  for (const double d : hand.Distances(vertices(Eigen::all, near))) {
    if (d >= 0.0) continue;
    ++frame.object_vertices_inside;
    frame.object_max_penetration_mm = std::max(frame.object_max_penetration_mm, -1e3 * d);
    frame.object_mean_penetration_mm -= 1e3 * d;
  }
  if (frame.object_vertices_inside > 0) {
    frame.object_mean_penetration_mm /= frame.object_vertices_inside;
  }
}

HandObjectFrame MeasureFrame(const TriangleMesh& hand, const Solid& object,
                             const ExactIntersection* exact, const HandObjectProtocol& protocol,
                             Touch& touch) {
  const auto n = static_cast<std::size_t>(hand.NumVertices());
  std::vector<SignedDistance::Result> queries(n);
  Eigen::VectorXd distances(hand.NumVertices());
  for (std::size_t i = 0; i < n; ++i) {
    queries[i] = object.distance.Query(hand.vertices.col(static_cast<Eigen::Index>(i)));
    distances[static_cast<Eigen::Index>(i)] = queries[i].distance;
  }
  HandObjectFrame frame;
  frame.hand = ContactFromDistances(distances, protocol.contact);
  touch = FindTouch(hand.vertices, queries, 1e-3 * protocol.contact.contact_threshold_mm);
  const Solid closed_hand(hand, /*close_holes=*/true);
  MeasureObjectInHand(object.mesh.vertices, closed_hand.distance, frame);
  if (protocol.measure_voxels) {
    frame.hand.intersection_volume_cm3 =
        1e6 *
        IntersectionVolume(object.distance, closed_hand.distance, 1e-3 * protocol.contact.voxel_mm);
  }
  if (protocol.measure_exact) frame.exact_volume = exact->With(closed_hand);
  return frame;
}

void RequireObject(const Clip& clip) {
  if (!clip.object) throw Error("clip", "has no object to measure contact with", "Fit one first");
}

}  // namespace

HandObjectScore MeasureHandObject(const Clip& clip, const HandModel& hand, const Solid& object,
                                  const ExactIntersection* exact,
                                  const HandObjectProtocol& protocol,
                                  std::span<const std::uint8_t> holds,
                                  const std::function<bool(int, int)>& progress) {
  RequireObject(clip);
  const int frames = clip.NumFrames();
  HandObjectScore score;
  score.side = hand.HandSide();
  score.holds.assign(holds.begin(), holds.end());
  score.frames.resize(static_cast<std::size_t>(frames));
  std::vector<Touch> touches(static_cast<std::size_t>(frames));
  std::atomic<bool> stopped{false};
  std::mutex progress_mutex;
  int done = 0;
  ParallelFor(frames, protocol.contact.threads, [&](int t) {
    if (stopped) return;
    score.frames[t] =
        MeasureFrame(HandInObject(clip, hand, t), object, exact, protocol, touches[t]);
    if (progress) {
      const std::lock_guard lock(progress_mutex);
      if (!progress(++done, frames)) stopped = true;
    }
  });
  score.track = TrackContact(touches, holds);
  score.jitter = MeasureCarryJitter(WristPoses(clip, hand.Surface().RestJoints(), hand.HandSide()),
                                    ObjectPoses(clip), MeasureMoments(object.mesh).center,
                                    clip.frame_rate, holds);
  return score;
}

std::vector<HandObjectScore> MeasureHands(const Clip& clip, std::span<const HandModel* const> hands,
                                          std::span<const std::uint8_t> holding,
                                          const Solid& object, const ContactProtocol& protocol,
                                          const std::function<bool(int, int)>& progress) {
  std::vector<HandObjectScore> scores;
  bool stopped = false;
  for (const HandModel* hand : hands) {
    scores.push_back(MeasureHandObject(
        clip, *hand, object, nullptr, {.contact = protocol, .measure_exact = false},
        HoldFlags(holding, hand->HandSide()), [&](int done, int total) {
          stopped = progress && !progress(done, total);
          return !stopped;
        }));
    if (stopped) break;
  }
  return scores;
}

double HandObjectScore::FramesHeld() const {
  const auto count =
      holds.empty() ? static_cast<std::ptrdiff_t>(frames.size())
                    : std::ranges::count_if(holds, [](std::uint8_t held) { return held != 0; });
  return static_cast<double>(count);
}

std::vector<std::uint8_t> HoldFlags(std::span<const std::uint8_t> holding_hand, Side side) {
  const std::uint8_t bit = side == Side::kRight ? kHoldsRight : kHoldsLeft;
  std::vector<std::uint8_t> flags;
  for (const std::uint8_t hands : holding_hand) flags.push_back((hands & bit) != 0 ? 1 : 0);
  return flags;
}

double MeanDistance(const Clip& clip, const HandModel& hand, const SignedDistance& object,
                    int stride) {
  RequireObject(clip);
  double sum = 0.0;
  int count = 0;
  for (int t = 0; t < clip.NumFrames(); t += stride, ++count) {
    sum += object.Distances(HandInObject(clip, hand, t).vertices).minCoeff();
  }
  return sum / count;
}

std::vector<Eigen::Isometry3d> ObjectPoses(const Clip& clip) {
  RequireObject(clip);
  std::vector<Eigen::Isometry3d> poses;
  for (int t = 0; t < clip.NumFrames(); ++t) poses.push_back(clip.object->Pose(t));
  return poses;
}

std::vector<Eigen::Isometry3d> WristPoses(const Clip& clip, const Eigen::Matrix3Xd& rest_joints,
                                          Side side) {
  std::vector<Eigen::Isometry3d> poses;
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(rest_joints, clip.pose[t], clip.trans.col(t), state);
    poses.push_back(state.WorldFromJoint(WristJoint(side)));
  }
  return poses;
}

}  // namespace holdfast
