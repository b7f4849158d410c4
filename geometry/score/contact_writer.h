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

/// Parts of a hand, as ContactPoint::part counts them.
inline constexpr std::array<std::string_view, 6> kHandParts = {"palm",   "thumb", "index",
                                                               "middle", "ring",  "pinky"};

/// One hand vertex that touches the object in one frame.
struct ContactPoint {
  int frame = 0;
  Side side = Side::kRight;
  int part = 0;               ///< of kHandParts: the one whose joint the vertex follows most
  int vertex = 0;             ///< in the body model's numbering
  double depth_m = 0;         ///< into the object; negative: the gap that is left
  Eigen::Vector3d in_object;  ///< the point of the object's surface nearest to the vertex, meters
  Eigen::Vector3d normal_in_object;  ///< unit, out of the object
};

/// Poses of one hand in one frame, x_world = pose * x.
struct HandPose {
  Eigen::Isometry3d wrist;
  /// At the tips of thumb to pinky, turned as the last phalanx is.
  std::array<Eigen::Isometry3d, 5> tips;
};

/// What hands do to an object in a clip, as a controller would have it.
struct ClipContactPoints {
  double frame_rate = 30;
  std::string object_name;
  double threshold_m = 0;
  std::vector<Side> hands;                ///< those that the body model has, right before left
  std::vector<ContactPoint> points;       ///< by frame, then hand, then vertex
  std::vector<Eigen::Isometry3d> object;  ///< per frame, x_world = pose * x_object
  std::vector<std::vector<HandPose>> hand_poses;  ///< per frame, in the order of `hands`
};

/// Finds the vertices of all hands that are inside the object or nearer to it than `threshold_m`
/// (ContactProtocol's, in meters), in every frame. `object` is the full mesh in its own frame.
/// Frames are shared among `threads`; the result does not depend on it. Throws Error for a clip
/// without an object.
ClipContactPoints FindContactPoints(const Clip& clip, std::shared_ptr<const BodyModel> body,
                                    const Eigen::VectorXd& betas, const SignedDistance& object,
                                    double threshold_m, int threads = 1);

/// Writes contact points and poses as named arrays (`.npz`), atomically. docs/formats.md has the
/// fields.
void WriteContactsNpz(const ClipContactPoints& contacts, const std::filesystem::path& path);

/// The same as two tables (`.csv`): contact points, and the poses of object, wrists and fingertips.
void WriteContactsCsv(const ClipContactPoints& contacts, const std::filesystem::path& path,
                      const std::filesystem::path& poses_path);

}  // namespace holdfast
