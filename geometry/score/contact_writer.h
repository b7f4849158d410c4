// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/signed_distance.h"

namespace holdfast {

/// Parts of a hand, indexed by ContactPoint::part.
inline constexpr std::array<std::string_view, 6> kHandParts = {"palm",   "thumb", "index",
                                                               "middle", "ring",  "pinky"};

/// One hand vertex that touches the object in one frame.
struct ContactPoint {
  int frame = 0;
  Side side = Side::kRight;
  int part = 0;               ///< index in kHandParts, by the joint of largest skinning weight
  int vertex = 0;             ///< in the body model's numbering
  double depth_m = 0;         ///< penetration depth; negative: the remaining gap
  Eigen::Vector3d in_object;  ///< nearest point of the object's surface, meters
  Eigen::Vector3d normal_in_object;  ///< unit, outwards
};

/// Poses of one hand in one frame, x_world = pose * x.
struct HandPose {
  Eigen::Isometry3d wrist;
  /// At the tips of thumb to pinky, oriented like the last phalanx.
  std::array<Eigen::Isometry3d, 5> tips;
};

/// Hand-object contacts of a clip, as needed by a controller.
struct ClipContactPoints {
  double frame_rate = 30;
  std::string object_name;
  double threshold_m = 0;
  std::vector<Side> hands;                ///< the hands of the body model, right before left
  std::vector<ContactPoint> points;       ///< by frame, then hand, then vertex
  std::vector<Eigen::Isometry3d> object;  ///< per frame, x_world = pose * x_object
  std::vector<std::vector<HandPose>> hand_poses;  ///< per frame, in the order of `hands`
};

/// Finds the vertices of all hands that are inside the object or nearer to it than `threshold_m`
/// (ContactProtocol's, in meters), in every frame. `object` is the full mesh in its own frame.
/// Frames are distributed over `threads`; the result does not depend on it. Throws Error for a clip
/// without an object.
ClipContactPoints FindContactPoints(const Clip& clip, std::shared_ptr<const BodyModel> body,
                                    const Eigen::VectorXd& betas, const SignedDistance& object,
                                    double threshold_m, int threads = 1);

/// Writes contact points and poses as named arrays (`.npz`), atomically. For the fields see
/// docs/formats.md.
void WriteContactsNpz(const ClipContactPoints& contacts, const std::filesystem::path& path);

/// Writes two tables (`.csv`): contact points, and the poses of object, wrists and fingertips.
void WriteContactsCsv(const ClipContactPoints& contacts, const std::filesystem::path& path,
                      const std::filesystem::path& poses_path);

}  // namespace holdfast
