// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A link of a simulated hand: rigid convex pieces on a ball joint. Lengths are meters.
struct MjcfLink {
  int parent = -1;  ///< an earlier link; -1 for the palm, whose frame is the wrist's
  Eigen::Vector3d joint = Eigen::Vector3d::Zero();           ///< in the parent's frame
  std::vector<TriangleMesh> pieces;                          ///< in its own frame
  Eigen::Quaterniond rest = Eigen::Quaterniond::Identity();  ///< parent_from_link at angle zero
  /// Axes of its springs, in its own frame; stiffness, N m per radian; torque limits, N m, 0 for
  /// none.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d stiffness_Nm = Eigen::Vector3d::Zero();
  Eigen::Vector3d limit_Nm = Eigen::Vector3d::Zero();
};

/// A simulated hand that holds the object: the palm, then the 15 finger joints in file order.
struct MjcfHand {
  Side side = Side::kRight;
  std::vector<MjcfLink> links;
  /// Squeeze: per frame and finger joint, the torque of its springs about their axes, N m, in
  /// addition to the torque toward the clip's pose.
  std::vector<std::array<Eigen::Vector3d, kJointsPerHand>> squeeze_Nm;
  double damping_Nms = 0.0, inertia_kg_m2 = 0.0;  ///< of a joint, about each axis
};

/// What is simulated in addition to the bodies that follow the clip.
struct MjcfPhysics {
  std::vector<TriangleMesh> object_pieces;  ///< convex
  double mass_kg = 0.0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();   ///< the object's center of mass
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about the center of mass
  bool mass_of_pieces = false;  ///< the surface is not closed: mass and inertia are the pieces'
  double step_s = 0.002, friction = 0.8, torsion_m = 0.005;
  std::vector<MjcfHand> hands;
};

struct MjcfOptions {
  std::string generator = "Holdfast";
  std::string model_name = "clip";
  int every = 1;                  ///< key frames: every n-th of the clip
  double density_kg_m3 = 1000.0;  ///< of the object
  /// For a clip with an object; null: the object is its mesh, hands push only as mocap bodies.
  const MjcfPhysics* physics = nullptr;
};

struct MjcfReport {
  int key_frames = 0;
  int hand_pieces = 0;  ///< mocap bodies of all hands
  int simulated_hands = 0;
  double object_mass_kg = 0.0;
  /// The mass is that of the object's convex hull (of its pieces, with physics), as its surface is
  /// open or not oriented outward everywhere.
  bool mass_of_hull = false;
  /// The mesh is the hull, too: MuJoCo rejects surfaces with inconsistent face orientation.
  bool mesh_is_hull = false;
};

/// Folder of the meshes of a scene: "x_assets" for "x.xml".
std::filesystem::path MjcfAssets(const std::filesystem::path& path);

/// Writes a clip's object and hands as a scene for MuJoCo (MJCF), z up, meters, kilograms, and its
/// meshes as `.obj` into MjcfAssets(path). Bodies:
///
///   object        (with an object track and `object` not null) a free joint and the mesh; its mass
///                 is volume times density
///   right_wrist, right_index1, ... left_thumb3
///                 a mocap body for each joint of the body's hands: the convex hull of the skin
///                 that this joint moves most, in the rest pose.
///                 With `physics`, those of a simulated hand do not collide: they show its
///                 pose in the clip
///   right_hand, right_hand_index1, ... (with `physics`)
///                 a hand that holds: a free palm that a weld pulls to the mocap wrist, fingers
///                 on ball joints with position actuators
///   table         fixed, where it is in the first frame
///   floor         a plane at z = 0, part of the world
///
/// A key frame for each frame (`frame_0`, ... by the clip's frame; its time in seconds) has the
/// poses of the object and the simulated hands (qpos), the targets of their actuators (ctrl: the
/// pose plus the offset that gives the squeeze), and the poses of all mocap bodies (mpos, mquat, in
/// the order above). With `physics`, the object collides as its convex pieces and its mesh is only
/// visual. Quaternions are w x y z with continuous signs. `custom` has the numeric frame_rate.
/// docs/formats.md explains the use. Throws Error for a clip with neither hand nor object, for an
/// object without volume, and if a file cannot be written.
MjcfReport WriteMjcf(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
                     const MjcfOptions& options, const std::filesystem::path& path);

}  // namespace holdfast
