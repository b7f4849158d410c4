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
  int parent = -1;  ///< an earlier link; -1: the palm, whose frame is the wrist's
  Eigen::Vector3d joint = Eigen::Vector3d::Zero();           ///< in the parent's frame
  std::vector<TriangleMesh> pieces;                          ///< in its own frame
  Eigen::Quaterniond rest = Eigen::Quaterniond::Identity();  ///< parent_from_link at angle zero
  /// Axes that its springs turn about, in its own frame; stiffness, N m a radian; torque limits,
  /// N m, 0 for none.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d stiffness_Nm = Eigen::Vector3d::Zero();
  Eigen::Vector3d limit_Nm = Eigen::Vector3d::Zero();
};

/// A hand that holds the object, simulated: the palm, then the 15 finger joints in file order.
struct MjcfHand {
  Side side = Side::kRight;
  std::vector<MjcfLink> links;
  /// Per frame and finger joint, what its springs exert besides drawing it to the clip's pose,
  /// about its axes, N m: the squeeze.
  std::vector<std::array<Eigen::Vector3d, kJointsPerHand>> squeeze_Nm;
  double damping_Nms = 0.0, inertia_kg_m2 = 0.0;  ///< of a joint, about each axis
};

/// What is simulated besides what moves as the clip says.
struct MjcfPhysics {
  std::vector<TriangleMesh> object_pieces;  ///< convex
  double mass_kg = 0.0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();   ///< of the object's mass
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about it
  bool mass_of_pieces = false;  ///< the surface is not closed: mass and inertia are the pieces'
  double step_s = 0.002, friction = 0.8, torsion_m = 0.005;
  std::vector<MjcfHand> hands;
};

struct MjcfOptions {
  std::string generator = "Holdfast";
  std::string model_name = "clip";
  int every = 1;                  ///< key frames: each n-th of the clip
  double density_kg_m3 = 1000.0;  ///< of the object
  /// What the object rests on, for a clip with a track of it; may be null. It stands still.
  const TriangleMesh* table = nullptr;
  /// Of a clip with an object; null: the object is its mesh, and hands push as mocap bodies alone.
  const MjcfPhysics* physics = nullptr;
};

struct MjcfReport {
  int key_frames = 0;
  int hand_pieces = 0;  ///< mocap bodies of all hands
  int simulated_hands = 0;
  double object_mass_kg = 0.0;
  /// The mass is that of the object's convex hull (its pieces, with physics): its surface is open,
  /// or not all outwards.
  bool mass_of_hull = false;
  /// The mesh is the hull, too: MuJoCo takes no surface whose faces disagree about the outside.
  bool mesh_is_hull = false;
};

/// The folder of meshes beside a scene: "x_assets" of "x.xml".
std::filesystem::path MjcfAssets(const std::filesystem::path& path);

/// Writes a clip's object and hands as a scene for MuJoCo (MJCF), z up, meters, kilograms, and its
/// meshes as `.obj` into MjcfAssets(path). Bodies:
///
///   object        (with an object track and `object` not null) a free joint and the mesh; its mass
///                 is volume times density
///   right_wrist, right_index1, ... left_thumb3
///                 a mocap body for each joint of the hands that the body has: the convex hull of
///                 the skin that this joint moves most, of the rest pose
///                 With `physics`, those of a simulated hand collide with nothing: they show
///                 where the clip has it
///   right_hand, right_hand_index1, ... (with `physics`)
///                 a hand that holds: a free palm that a weld draws after the mocap wrist, fingers
///                 on ball joints with position actuators
///   table         fixed, where it is in the first frame
///   floor         a plane at z = 0, part of the world
///
/// A key frame for each frame (`frame_0`, ... by the clip's frame; its time in seconds) has the
/// poses of the object and the simulated hands (qpos), where their actuators pull (ctrl: the pose,
/// and past it by what the squeeze takes), and the poses of all mocap bodies (mpos, mquat, in the
/// order above). With `physics` the object is its convex pieces and its mesh is only seen.
/// Quaternions are w x y z, their signs continuous. `custom` has the numeric frame_rate.
/// docs/formats.md says how to use it. Throws Error for a clip with neither hand nor object, an
/// object without volume, and when a file cannot be written.
MjcfReport WriteMjcf(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
                     const MjcfOptions& options, const std::filesystem::path& path);

}  // namespace holdfast
