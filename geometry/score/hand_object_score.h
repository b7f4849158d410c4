// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "geometry/score/contact_metrics.h"
#include "geometry/score/contact_track.h"
#include "geometry/score/exact_intersection.h"
#include "geometry/score/rigid_jitter.h"

namespace holdfast {

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
  ExactVolume exact_volume;  ///< if measured

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
