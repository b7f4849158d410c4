// SPDX-License-Identifier: MIT
#include "geometry/score/hand_object_score.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "geometry/error.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "geometry/score/clearance_memory.h"
#include "geometry/score/clipped_volume.h"
#include "geometry/score/object_pose_error.h"

namespace holdfast {
namespace {

// Mean and maximum of the values added; none if no value was added.
struct Spread {
  double sum = 0.0;
  double max = 0.0;
  int count = 0;

  void Add(double value) {
    sum += value;
    max = count == 0 ? value : std::max(max, value);
    ++count;
  }
  std::optional<double> Mean() const {
    return count > 0 ? std::optional(sum / count) : std::nullopt;
  }
  std::optional<double> Max() const { return count > 0 ? std::optional(max) : std::nullopt; }
};

// Of a touching vertex: its position, and the nearest point of the object.
using Place = std::pair<Eigen::Vector3d, Eigen::Vector3d>;

double Travel_mm(const Place& from, const Place& to) {
  return 1e3 * std::min((to.first - from.first).norm(), (to.second - from.second).norm());
}

struct Contact {
  Place began, last;
  int last_frame = -1;
};

}  // namespace

Touch FindTouch(const Eigen::Matrix3Xd& hand_vertices_in_object,
                std::span<const SignedDistance::Result> queries, double threshold_m) {
  Touch touch;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (queries[i].distance < threshold_m) touch.vertices.push_back(static_cast<int>(i));
  }
  const auto n = static_cast<Eigen::Index>(touch.vertices.size());
  touch.at.resize(3, n);
  touch.on.resize(3, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const int vertex = touch.vertices[k];
    touch.at.col(k) = hand_vertices_in_object.col(vertex);
    touch.on.col(k) = queries[vertex].closest;
  }
  return touch;
}

ContactTrack TrackContact(std::span<const Touch> frames, std::span<const std::uint8_t> counts) {
  if (!counts.empty() && counts.size() != frames.size()) {
    throw Error("contact", "has a different number of frames than there are frame flags",
                "Give one flag per frame, or none");
  }
  ContactTrack track;
  track.steps.resize(frames.size());
  track.drift_mm.resize(frames.size());
  std::map<int, Contact> contacts;  // by vertex
  std::map<int, double> drift;      // by vertex, maximum over its contacts
  Spread iou, slip_means, slip_all;
  for (int t = 0; t < static_cast<int>(frames.size()); ++t) {
    if (!counts.empty() && !counts[t]) continue;
    const Touch& touch = frames[t];
    const bool has_step = t > 0 && (counts.empty() || counts[t - 1]);
    int kept = 0;
    Spread slip, drift_now;
    for (std::size_t k = 0; k < touch.vertices.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      const Place place{touch.at.col(column), touch.on.col(column)};
      Contact& contact = contacts[touch.vertices[k]];
      if (has_step && contact.last_frame == t - 1) {
        ++kept;
        const double travel = Travel_mm(contact.last, place);
        slip.Add(travel);
        slip_all.Add(travel);
        const double from_begin = Travel_mm(contact.began, place);
        drift_now.Add(from_begin);
        double& most = drift.try_emplace(touch.vertices[k], 0.0).first->second;
        most = std::max(most, from_begin);
      } else {
        contact.began = place;
        drift_now.Add(0.0);
      }
      contact.last = place;
      contact.last_frame = t;
    }
    track.drift_mm[t] = drift_now.Mean();
    if (!has_step) continue;
    ContactStep& step = track.steps[t];
    const std::size_t either = touch.vertices.size() + frames[t - 1].vertices.size() - kept;
    if (either > 0) {
      step.iou = static_cast<double>(kept) / static_cast<double>(either);
      iou.Add(*step.iou);
    }
    step.slip_mm = slip.Mean();
    if (step.slip_mm) slip_means.Add(*step.slip_mm);
  }
  track.mean_iou = iou.Mean();
  track.mean_slip = slip_means.Mean();
  track.max_slip = slip_all.Max();
  Spread drifts;
  for (const auto& [vertex, most] : drift) drifts.Add(most);
  track.mean_drift = drifts.Mean();
  track.max_drift = drifts.Max();
  return track;
}

namespace {

// The hand's vertices in the object's coordinate frame.
Eigen::Matrix3Xd HandInObject(const Clip& clip, HandState& state, int t) {
  state.SetBody(clip.pose[t], clip.trans.col(t));
  state.Evaluate(FingersOf(clip.pose[t], state.Hand().HandSide()), false);
  const Eigen::Matrix3d object_from_world = ExpSO3(clip.object->orient.col(t)).transpose();
  return object_from_world * (state.Vertices().colwise() - clip.object->trans.col(t));
}

// Maximum depth of a point in a hand below its skin.
constexpr double kThickest_m = 0.025;

// Data shared by all frames.
struct Measured {
  const Clip& clip;
  const HandModel& hand;
  const Solid& object;
  const ExactIntersection* exact;
  const HandObjectProtocol& protocol;
  HoleFill fill;
  BallTree object_vertices;
  std::vector<int> joint_of_vertex;         // StrongestHandJoints of the hand's vertices
  Eigen::Vector3d thumb_first, thumb_last;  // bones in the rest pose, unit
};

// The thumb's bones in the rest pose: from its root to its second joint, and from its last joint to
// the vertex farthest along it.
void FindThumb(const HandModel& hand, Measured& all) {
  const BodySurface& surface = hand.Surface();
  const int root = HandBegin(hand.HandSide()) + kJointsPerHand - 3;
  const Eigen::Vector3d last = surface.RestJoints().col(root + 2);
  const Eigen::Vector3d along = last - surface.RestJoints().col(root + 1);
  all.thumb_first =
      (surface.RestJoints().col(root + 1) - surface.RestJoints().col(root)).normalized();
  all.thumb_last = along.normalized();
  double farthest = 0.0;
  for (int i = 0; i < hand.NumVertices(); ++i) {
    if (all.joint_of_vertex[static_cast<std::size_t>(i)] != root + 2) continue;
    const Eigen::Vector3d apart = surface.RestVertices().col(i) - last;
    if (apart.dot(along) <= farthest) continue;
    farthest = apart.dot(along);
    all.thumb_last = apart.normalized();
  }
}

// Measures frame after frame; one per thread. State kept between frames only affects speed.
class FrameMeasurer {
 public:
  explicit FrameMeasurer(const Measured& all)
      : all_(all),
        state_(all.hand),
        closed_({all.fill.Vertices(all.hand.Surface().RestVertices()), all.fill.Faces()}),
        queries_(static_cast<std::size_t>(closed_.mesh.NumVertices())),
        from_object_(all.object, queries_.size()),
        from_hand_(closed_, all.object_vertices.NumBalls() +
                                static_cast<std::size_t>(all.object.mesh.NumVertices())) {}

  HandObjectFrame Measure(int t, Touch& touch) {
    const int n = all_.hand.NumVertices();
    const ContactProtocol& protocol = all_.protocol.contact;
    const double threshold_m = 1e-3 * protocol.contact_threshold_mm;
    closed_.mesh.vertices = all_.fill.Vertices(HandInObject(all_.clip, state_, t));
    const Eigen::VectorXd distances = FindNearest(threshold_m);
    HandObjectFrame frame;
    frame.hand = ContactFromDistances(distances.head(n), protocol);
    MeasureFingers(distances, threshold_m, t, frame);
    const std::span<const SignedDistance::Result> of_hand(queries_.data(), n);
    touch = FindTouch(closed_.mesh.vertices.leftCols(n), of_hand, threshold_m);
    const SignedDistance& object = all_.object.distance;
    const auto low = closed_.mesh.vertices.rowwise().minCoeff();
    const auto high = closed_.mesh.vertices.rowwise().maxCoeff();
    if ((low.array() > object.Max().array()).any() || (high.array() < object.Min().array()).any()) {
      if (all_.protocol.measure_exact && !(all_.object.IsClosed() && closed_.IsClosed())) {
        frame.exact_volume.status = VolumeStatus::kOpenSurface;
      }
      return frame;
    }
    MoveSurface();
    const std::vector<int> inside = MeasureObjectInHand(frame);
    MeasureVolumes(distances, inside, frame);
    return frame;
  }

 private:
  // Distances of the closed hand's vertices from the object. A distance that is neither below the
  // threshold nor the minimum may be a lower bound.
  Eigen::VectorXd FindNearest(double threshold_m) {
    const Eigen::AlignedBox3d box(all_.object.distance.Min(), all_.object.distance.Max());
    Eigen::VectorXd distances(closed_.mesh.NumVertices());
    double least = std::numeric_limits<double>::infinity();
    const auto measure = [&](int i) {
      const Eigen::Vector3d point = closed_.mesh.vertices.col(i);
      SignedDistance::Result& query = queries_[static_cast<std::size_t>(i)];
      const double outside = std::max(all_.object.IsClosed() ? box.exteriorDistance(point) : 0.0,
                                      from_object_.OutsideBy(i, point));
      if (outside > threshold_m && outside > least) {
        query.distance = outside;
      } else {
        query = from_object_.Query(i, point);
        if (i < all_.hand.NumVertices() && query.distance < least) {
          least = query.distance;
          nearest_ = i;
        }
      }
      distances[i] = query.distance;
    };
    measure(nearest_);  // last frame's nearest: most other queries are then skipped
    for (int i = 0; i < distances.size(); ++i) measure(i);
    return distances;
  }

  void MeasureFingers(const Eigen::VectorXd& distances, double threshold_m, int t,
                      HandObjectFrame& frame) const {
    const Side side = all_.hand.HandSide();
    const int first = HandBegin(side);
    for (int i = 0; i < all_.hand.NumVertices(); ++i) {
      const int k = all_.joint_of_vertex[static_cast<std::size_t>(i)] - first;
      if (distances[i] >= threshold_m || k < 0 || k >= kJointsPerHand) continue;
      const auto finger = static_cast<std::size_t>(k / 3);
      frame.finger_touches[finger] = true;
      if (k % 3 == 2) frame.fingertip_touches[finger] = true;
    }
    const FingerPose fingers = FingersOf(all_.clip.pose[t], side);
    const Eigen::Vector3d last =
        ExpSO3(fingers.segment<3>(kHandDofs - 6)) * ExpSO3(fingers.tail<3>()) * all_.thumb_last;
    frame.thumb_bend_deg = std::acos(std::clamp(all_.thumb_first.dot(last), -1.0, 1.0)) / kDegree;
  }

  void MoveSurface() {
    const Eigen::Matrix3Xd& vertices = closed_.mesh.vertices;
    const double farthest = std::sqrt((vertices - surface_).colwise().squaredNorm().maxCoeff());
    from_hand_.SurfaceMoved(farthest);
    surface_ = vertices;
    closed_.distance.Move(vertices);
  }

  // Returns the object's vertices that are inside the hand.
  std::vector<int> MeasureObjectInHand(HandObjectFrame& frame) {
    std::vector<int> inside;
    const Eigen::AlignedBox3d box(closed_.distance.Min(), closed_.distance.Max());
    // A ball has no point inside if the surface is farther away than its radius. Where fingers
    // overlap, the sign may be wrong; no point of a hand is deeper than kThickest_m.
    const auto reaches = [&](const Eigen::Vector3d& center, double radius, std::size_t ball) {
      if (box.squaredExteriorDistance(center) > radius * radius) return false;
      if (!closed_.IsClosed() || from_hand_.AtMost(ball, center) <= radius) return true;
      if (from_hand_.OutsideBy(ball, center) > radius) return false;
      const double distance = from_hand_.Query(ball, center).distance;
      const bool outside = from_hand_.OutsideBy(ball, center) > 0.0;
      return distance <= (outside ? radius : std::max(radius, kThickest_m));
    };
    all_.object_vertices.ForPoints(reaches, [&](int vertex) {
      const Eigen::Vector3d point = all_.object.mesh.vertices.col(vertex);
      const std::size_t place = all_.object_vertices.NumBalls() + static_cast<std::size_t>(vertex);
      if (from_hand_.OutsideBy(place, point) > 0.0) return;
      const double distance = from_hand_.Query(place, point).distance;
      if (distance >= 0.0) return;
      inside.push_back(vertex);
      frame.object_max_penetration_mm = std::max(frame.object_max_penetration_mm, -1e3 * distance);
      frame.object_mean_penetration_mm -= 1e3 * distance;
    });
    frame.object_vertices_inside = static_cast<int>(inside.size());
    if (!inside.empty()) frame.object_mean_penetration_mm /= frame.object_vertices_inside;
    return inside;
  }

  void MeasureVolumes(const Eigen::VectorXd& distances, std::span<const int> object_inside,
                      HandObjectFrame& frame) const {
    const bool closed = all_.object.IsClosed() && closed_.IsClosed();
    SolidOverlap overlap;
    if (closed) overlap = FindOverlap(all_.object, closed_, distances, object_inside);
    if (all_.protocol.measure_exact) frame.exact_volume = all_.exact->With(closed_, overlap);
    if (!all_.protocol.measure_voxels) return;
    const double voxel_m = 1e-3 * all_.protocol.contact.voxel_mm;
    frame.hand.intersection_volume_cm3 =
        1e6 * (closed ? IntersectionVolume(all_.object, closed_, overlap, voxel_m)
                      : IntersectionVolume(all_.object.distance, closed_.distance, voxel_m));
  }

  const Measured& all_;
  HandState state_;
  Solid closed_;
  Eigen::Matrix3Xd surface_ = closed_.mesh.vertices;  // as last passed to closed_.distance
  std::vector<SignedDistance::Result> queries_;
  // Distances of the hand's vertices from the object; and from the hand, of the balls of the
  // object's vertices, followed by these vertices.
  ClearanceMemory from_object_, from_hand_;
  int nearest_ = 0;  // hand vertex in the last frame
};

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
  Measured all{clip,
               hand,
               object,
               exact,
               protocol,
               HoleFill({hand.Surface().RestVertices(), hand.Surface().Faces()}),
               BallTree(object.mesh.vertices),
               StrongestHandJoints(hand.Surface(), hand.HandSide()),
               {},
               {}};
  FindThumb(hand, all);
  std::atomic<bool> stopped{false};
  std::mutex mutex;
  std::vector<std::unique_ptr<FrameMeasurer>> idle;
  int done = 0;
  ParallelFor(frames, protocol.contact.threads, [&](int t) {
    if (stopped) return;
    std::unique_ptr<FrameMeasurer> measurer;
    {
      const std::lock_guard lock(mutex);
      if (!idle.empty()) {
        measurer = std::move(idle.back());
        idle.pop_back();
      }
    }
    if (!measurer) measurer = std::make_unique<FrameMeasurer>(all);
    score.frames[t] = measurer->Measure(t, touches[t]);
    const std::lock_guard lock(mutex);
    idle.push_back(std::move(measurer));
    if (progress && !progress(++done, frames)) stopped = true;
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
  std::vector<std::uint8_t> flags;
  for (const std::uint8_t bits : holding_hand) flags.push_back((bits & HoldingBit(side)) != 0);
  return flags;
}

double MeanDistance(const Clip& clip, const HandModel& hand, const SignedDistance& object,
                    int stride) {
  RequireObject(clip);
  HandState state(hand);
  double sum = 0.0;
  int count = 0;
  for (int t = 0; t < clip.NumFrames(); t += stride, ++count) {
    sum += object.Distances(HandInObject(clip, state, t)).minCoeff();
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
