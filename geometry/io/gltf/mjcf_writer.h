// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

struct MjcfOptions {
  std::string generator = "Holdfast";
  std::string model_name = "clip";
  int every = 1;                  ///< key frames: each n-th of the clip
  double density_kg_m3 = 1000.0;  ///< of the object
  /// What the object rests on, for a clip with a track of it; may be null. It stands still.
  const TriangleMesh* table = nullptr;
};

struct MjcfReport {
  int key_frames = 0;
  int hand_pieces = 0;  ///< of all hands
  double object_mass_kg = 0.0;
  /// The mass is that of the object's convex hull: its surface is open, or not all outwards.
  bool mass_of_hull = false;
  /// The mesh is the hull, too: MuJoCo takes no surface whose faces disagree about the outside.
  bool mesh_is_hull = false;
};

/// The folder of meshes beside a scene: "x_assets" of "x.xml".
std::filesystem::path MjcfAssets(const std::filesystem::path& path);

/// Writes a clip's object and hands as a scene for MuJoCo (MJCF), z up, metres, kilograms, and its
/// meshes as `.obj` into MjcfAssets(path). Bodies:
///
///   object        (with an object track and `object` not null) a free joint and the mesh; its mass
///                 is volume times density
///   right_wrist, right_index1, ... left_thumb3
///                 a mocap body for each joint of the hands that the body has: the convex hull of
///                 the skin that this joint moves most, of the rest pose
///   table         fixed, where it is in the first frame
///   floor         a plane at z = 0, part of the world
///
/// A key frame for each frame (`frame_0`, ... by the clip's frame; its time in seconds) has the
/// poses of the object (qpos) and of all hand pieces (mpos, mquat, in the order above). Quaternions
/// are w x y z, their signs continuous. `custom` has the numeric frame_rate. docs/formats.md says
/// how to use it. Throws Error for a clip with neither hand nor object, an object without volume,
/// and when a file cannot be written.
MjcfReport WriteMjcf(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
                     const MjcfOptions& options, const std::filesystem::path& path);

}  // namespace holdfast
