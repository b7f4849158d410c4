// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/import/fields.h"

namespace holdfast {

/// Fills what is missing with the nearest that is there, the earlier one of two; returns where. At
/// least one must be there.
template <typename T>
std::vector<std::size_t> FillWithNearest(std::vector<std::optional<T>>& frames) {
  std::vector<std::size_t> with, without;
  for (std::size_t t = 0; t < frames.size(); ++t) (frames[t] ? with : without).push_back(t);
  std::size_t next = 0;  // of `with`, the first after t
  for (const std::size_t t : without) {
    while (next < with.size() && with[next] < t) ++next;
    const bool later = next == 0 || (next < with.size() && with[next] - t < t - with[next - 1]);
    frames[t] = frames[later ? with[next] : with[next - 1]];
  }
  return without;
}

/// An object of a scene that may have several. No pose: it was not tracked in that frame.
struct SceneObject {
  std::string name;
  std::vector<std::optional<Eigen::Isometry3d>> poses;
};

/// Chooses the object of a clip: the one of that name (--prop), else, of those that move, or of all
/// if none does, the nearest to a hand (mean over the frames; `hands` are paths, 3 x T). The choice
/// is noted. Frames without a pose get the nearest one, with a warning. nullopt, with a note, if no
/// object has a pose. Throws Error (`where`) for a name that no object has.
std::optional<SceneObject> ChooseObject(std::vector<SceneObject> objects,
                                        std::span<const Eigen::Matrix3Xd> hands,
                                        const std::string& name, const std::string& where,
                                        std::vector<std::string>& notes);

/// Paths of both wrists of a body in the file's world (3 x T each).
std::vector<Eigen::Matrix3Xd> WristPaths(const Clip& clip, const BodyModel& body);

/// Makes a chosen object that of the clip, and finds its mesh (FindObjectMesh) beside the file
/// `path`.
void PutObject(const SceneObject& object, const std::filesystem::path& path,
               std::span<const std::string> meshes, const ParameterOptions& options,
               ImportedClip& imported);

/// Numbers of quaternions (w, x, y, z), as rotations in axis-angle, three rows for each of the
/// `joints` (3J x T). Throws Error for other shapes and for quaternions far from length 1.
Eigen::MatrixXd ReadQuaternions(const DataValue& value, Eigen::Index joints);

/// Rigid poses in row-major matrices (..., 3, 4) or (..., 4, 4), which become the nearest rotation,
/// or in rows (..., 7) of a quaternion (x, y, z, w) and a position. Throws Error for other shapes
/// and for what is no rotation.
std::vector<Eigen::Isometry3d> ReadRigidPoses(const DataValue& value);

/// A pose from the first three rows of a matrix, with the nearest rotation. Throws Error (`where`)
/// for one that is far from a rotation.
Eigen::Isometry3d PoseOfMatrix(const Eigen::Matrix<double, 3, 4>& matrix, const std::string& where);

/// A pose from a quaternion (w, x, y, z), which is normalized. Throws Error (`where`) for one whose
/// length is far from 1.
Eigen::Isometry3d PoseOfQuaternion(const Eigen::Vector4d& wxyz, const Eigen::Vector3d& place,
                                   const std::string& where);

}  // namespace holdfast
