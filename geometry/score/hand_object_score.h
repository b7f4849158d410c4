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

/// How a hand is measured against an object.
struct HandObjectProtocol {
  ContactProtocol contact;     ///< threshold, voxel size, threads
  bool measure_voxels = true;  ///< the shared volume by voxels
  bool measure_exact = true;   ///< and exactly
};

/// One hand and the object in one frame.
struct HandObjectFrame {
  ContactMetrics hand;  ///< of the hand's vertices against the object; volume by voxels
  /// The other way round: vertices of the object inside the hand (closed at the wrist). A blade
  /// through a palm may have no hand vertex inside it.
  double object_max_penetration_mm = 0.0;
  double object_mean_penetration_mm = 0.0;  ///< of the vertices inside; 0 if none
  int object_vertices_inside = 0;
  ExactVolume exact_volume;  ///< if measured

  /// The deeper of both ways.
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

/// Measures every frame. `holds` (empty: all, else T long) tells the frames in which this hand
/// holds: contact over time and jitter are of those. `exact` is the object's preparation for exact
/// volumes, made once for all hands and clips; null where `protocol` does not ask for them. Frames
/// are shared among `protocol.contact.threads`; the result does not depend on it. `progress`
/// (frames done, frames) may be empty, is called one at a time, and stops the measurement by
/// returning false. Throws Error for a clip without an object.
HandObjectScore MeasureHandObject(const Clip& clip, const HandModel& hand, const Solid& object,
                                  const ExactIntersection* exact,
                                  const HandObjectProtocol& protocol,
                                  std::span<const std::uint8_t> holds = {},
                                  const std::function<bool(int, int)>& progress = {});

/// Every hand of a clip against the object, by voxels and without exact volumes. `holding` has bits
/// as in Clip::holding_hand (empty: all hold always). Stopped by `progress`, it is incomplete.
std::vector<HandObjectScore> MeasureHands(const Clip& clip, std::span<const HandModel* const> hands,
                                          std::span<const std::uint8_t> holding,
                                          const Solid& object, const ContactProtocol& protocol,
                                          const std::function<bool(int, int)>& progress = {});

/// Whether this hand holds in each frame, of bits as in Clip::holding_hand; empty of none.
std::vector<std::uint8_t> HoldFlags(std::span<const std::uint8_t> holding_hand, Side side);

/// Mean over frames of the least distance from the hand's vertices to the object, meters, negative
/// inside: tells which of two hands is nearer. Every `stride`-th frame is looked at.
double MeanDistance(const Clip& clip, const HandModel& hand, const SignedDistance& object,
                    int stride = 1);

/// Poses of the object, x_world = pose * x_object, and of a wrist along a clip.
std::vector<Eigen::Isometry3d> ObjectPoses(const Clip& clip);
std::vector<Eigen::Isometry3d> WristPoses(const Clip& clip, const Eigen::Matrix3Xd& rest_joints,
                                          Side side);

}  // namespace holdfast
