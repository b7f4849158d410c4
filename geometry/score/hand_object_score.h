// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/score/contact_metrics.h"
#include "geometry/score/exact_intersection.h"
#include "geometry/score/rigid_jitter.h"

namespace holdfast {

/// Contact of a hand with an object in one frame, in the object's coordinate frame.
struct Touch {
  std::vector<int> vertices;  ///< touching hand vertices, ascending
  Eigen::Matrix3Xd at;        ///< positions of those vertices, meters (3 x n)
  Eigen::Matrix3Xd on;        ///< the nearest point of the object to each, meters (3 x n)
};

/// Returns the touching vertices: those with signed distance below `threshold_m`, including those
/// inside. `queries` holds the object's signed-distance result for each column of
/// `hand_vertices_in_object`.
Touch FindTouch(const Eigen::Matrix3Xd& hand_vertices_in_object,
                std::span<const SignedDistance::Result> queries, double threshold_m);

/// Change of contact from one frame to the next.
struct ContactStep {
  /// |A and B| / |A or B| of the vertices touching before (A) and now (B); none if both are empty.
  std::optional<double> iou;
  /// Mean slip of the vertices that touch in both frames; none if there are no such vertices.
  std::optional<double> slip_mm;
};

/// Contact over a clip. The slip of a vertex is the smaller of two displacements in the object's
/// frame: that of the vertex, and that of the nearest surface point. Neither pressing in (the
/// surface point stays) nor a change of the nearest side of a thin wall (the vertex stays) counts
/// as slip. A hand that carries the object rigidly has none; sliding along a plane counts in full.
struct ContactTrack {
  std::vector<ContactStep> steps;   ///< one per frame (T); the first is empty
  std::optional<double> mean_iou;   ///< mean over the steps that have one
  std::optional<double> mean_slip;  ///< mm per frame, mean over the steps that have one
  std::optional<double> max_slip;   ///< mm per frame, of any vertex in any step
  /// A vertex's drift is the largest displacement, mm, from where its contact began, during an
  /// uninterrupted contact; the maximum over its contacts. Over the vertices that touch in two
  /// consecutive frames.
  std::optional<double> mean_drift;
  std::optional<double> max_drift;
  std::vector<std::optional<double>> drift_mm;  ///< per frame, mean over the touching vertices
};

/// `counts` flags the frames to include (empty: all). A step needs both of its frames, and contact
/// restarts after an excluded frame. Throws Error if the lengths differ.
ContactTrack TrackContact(std::span<const Touch> frames, std::span<const std::uint8_t> counts = {});

/// Parameters for measuring a hand against an object.
struct HandObjectProtocol {
  ContactProtocol contact;     ///< threshold, voxel size, threads
  bool measure_voxels = true;  ///< measure the intersection volume by voxels
  bool measure_exact = true;   ///< measure the exact intersection volume
};

/// One hand and the object in one frame.
struct HandObjectFrame {
  ContactMetrics hand;  ///< the hand's vertices against the object; volume by voxels
  /// The reverse direction: vertices of the object inside the hand (closed at the wrist). A blade
  /// through a palm may contain no hand vertex.
  double object_max_penetration_mm = 0.0;
  double object_mean_penetration_mm = 0.0;  ///< of the vertices inside; 0 if none
  int object_vertices_inside = 0;
  /// Whether a vertex of a finger, and of its last phalanx, is closer than the contact threshold or
  /// inside: index, middle, pinky, ring, thumb (file order).
  std::array<bool, kJointsPerHand / 3> finger_touches{}, fingertip_touches{};
  double thumb_bend_deg = 0.0;  ///< between the thumb's first and last bone
  ExactVolume exact_volume;     ///< if measured

  /// The larger of both directions.
  double DeepestPenetration_mm() const {
    return std::max(hand.max_penetration_mm, object_max_penetration_mm);
  }
};

/// One hand and the object over a clip.
struct HandObjectScore {
  Side side = Side::kRight;
  std::vector<HandObjectFrame> frames;  ///< T
  std::vector<std::uint8_t> holds;      ///< T, whether this hand holds; empty: in every frame
  ContactTrack track;
  CarryJitter jitter;

  bool Holds(std::size_t frame) const { return holds.empty() || holds[frame] != 0; }
  double FramesHeld() const;
};

/// Measures every frame. `holds` (T long, or empty for all) flags the frames in which this hand
/// holds the object; contact over time and jitter are over those frames. `exact` is the object
/// prepared for exact volumes, created once for all hands and clips; null if `protocol` does not
/// request them. Frames are distributed over `protocol.contact.threads`; the result does not depend
/// on it. `progress` (frames done, frames) may be empty, is never called concurrently, and stops
/// the measurement by returning false. Throws Error for a clip without an object.
HandObjectScore MeasureHandObject(const Clip& clip, const HandModel& hand, const Solid& object,
                                  const ExactIntersection* exact,
                                  const HandObjectProtocol& protocol,
                                  std::span<const std::uint8_t> holds = {},
                                  const std::function<bool(int, int)>& progress = {});

/// Measures every hand of a clip, by voxels and without exact volumes. `holding` has bits as in
/// Clip::holding_hand (empty: all hands always hold). Incomplete if stopped by `progress`.
std::vector<HandObjectScore> MeasureHands(const Clip& clip, std::span<const HandModel* const> hands,
                                          std::span<const std::uint8_t> holding,
                                          const Solid& object, const ContactProtocol& protocol,
                                          const std::function<bool(int, int)>& progress = {});

/// Whether this hand holds in each frame, by bits as in Clip::holding_hand; empty if none.
std::vector<std::uint8_t> HoldFlags(std::span<const std::uint8_t> holding_hand, Side side);

/// Mean over frames of the minimum signed distance from the hand's vertices to the object, meters,
/// negative inside. Decides which of two hands is nearer. Only samples every `stride`-th frame.
double MeanDistance(const Clip& clip, const HandModel& hand, const SignedDistance& object,
                    int stride = 1);

/// Poses along a clip: of the object, x_world = pose * x_object, and of a wrist.
std::vector<Eigen::Isometry3d> ObjectPoses(const Clip& clip);
std::vector<Eigen::Isometry3d> WristPoses(const Clip& clip, const Eigen::Matrix3Xd& rest_joints,
                                          Side side);

}  // namespace holdfast
