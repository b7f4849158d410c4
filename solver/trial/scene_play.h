// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Geometry>

namespace holdfast {

/// Course of the object when frames of a scene (WriteRobotScene) are played in MuJoCo.
struct ScenePlay {
  std::vector<Eigen::Isometry3d> world_from_object;  ///< at key frames `first` to `last`
  bool stable = true;  ///< false: MuJoCo diverged, and the course ends early
};

/// Starts at key frame `first` and moves the actuators' targets and the mocap bodies from key frame
/// to key frame, linearly, under the scene's gravity. Throws Error without MuJoCo, and with its
/// message if it rejects the scene.
ScenePlay PlayScene(const std::filesystem::path& scene, int first, int last);

}  // namespace holdfast
