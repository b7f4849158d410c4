// SPDX-License-Identifier: MIT
#include "geometry/import/scene_objects.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <Eigen/SVD>

#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/world_frame.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// Whether an object is carried or turned, and not furniture.
bool Moves(const SceneObject& object) {
  constexpr double kMoved_m = 0.05;
  constexpr double kTurned = 20 * kDegree;
  const std::optional<Eigen::Isometry3d>* first = nullptr;
  for (const std::optional<Eigen::Isometry3d>& pose : object.poses) {
    if (!pose) continue;
    if (first == nullptr) first = &pose;
    if ((pose->translation() - (*first)->translation()).norm() > kMoved_m ||
        LogSO3(Eigen::Matrix3d((*first)->linear().transpose() * pose->linear())).norm() > kTurned) {
      return true;
    }
  }
  return false;
}

// Mean distance of the object's origin from the nearest hand; infinite without a pose.
double DistanceFromHands(const SceneObject& object, std::span<const Eigen::Matrix3Xd> hands) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t t = 0; t < object.poses.size(); ++t) {
    if (!object.poses[t]) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const Eigen::Matrix3Xd& hand : hands) {
      least = std::min(
          least, (object.poses[t]->translation() - hand.col(static_cast<Eigen::Index>(t))).norm());
    }
    sum += least;
    ++count;
  }
  return count > 0 ? sum / count : std::numeric_limits<double>::infinity();
}

}  // namespace

std::optional<SceneObject> ChooseObject(std::vector<SceneObject> objects,
                                        std::span<const Eigen::Matrix3Xd> hands,
                                        const std::string& name, const std::string& where,
                                        std::vector<std::string>& notes) {
  std::erase_if(objects, [](const SceneObject& object) {
    return std::ranges::none_of(object.poses, [](const auto& pose) { return pose.has_value(); });
  });
  if (objects.empty()) {
    notes.push_back("no object has a pose in these frames: the clip has no object");
    return std::nullopt;
  }
  std::vector<std::string> names;
  for (const SceneObject& object : objects) names.push_back(object.name);
  constexpr std::size_t kMaxNamed = 12;
  std::size_t chosen = 0;
  if (!name.empty()) {
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) {
      throw Error(where, fmt::format("has no object '{}'", name),
                  fmt::format("Give one of {} with --prop", SomeNames(names, kMaxNamed)));
    }
    chosen = static_cast<std::size_t>(found - names.begin());
  } else if (objects.size() > 1) {
    const bool any_moves = std::ranges::any_of(objects, Moves);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (any_moves && !Moves(objects[i])) continue;
      const double distance = DistanceFromHands(objects[i], hands);
      if (!(distance < least)) continue;
      least = distance;
      chosen = i;
    }
    notes.push_back(fmt::format(
        "{} objects ({}): '{}' is used, which is nearest to a hand{} (--prop chooses another)",
        objects.size(), SomeNames(names, kMaxNamed), names[chosen],
        any_moves ? " of those that move" : ""));
  }
  SceneObject& object = objects[chosen];
  if (const std::size_t missing = FillWithNearest(object.poses).size(); missing > 0) {
    notes.push_back(fmt::format(
        "warning: no pose of the object in {} of {} frames: the nearest one is used there", missing,
        object.poses.size()));
  }
  return std::move(object);
}

std::vector<Eigen::Matrix3Xd> WristPaths(const Clip& clip, const BodyModel& body) {
  Eigen::Matrix3Xd rest = body.RestJoints(body.Template());
  rest.colwise() += PelvisOf(clip, body) - rest.col(0);
  std::vector<Eigen::Matrix3Xd> paths(2, Eigen::Matrix3Xd(3, clip.NumFrames()));
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(rest, clip.pose[t], clip.trans.col(t), state);
    for (const Side side : {Side::kLeft, Side::kRight}) {
      paths[side == Side::kLeft ? 0 : 1].col(t) = state.joints.col(WristJoint(side));
    }
  }
  return paths;
}

void PutObject(const SceneObject& object, const std::filesystem::path& path,
               std::span<const std::string> meshes, const ParameterOptions& options,
               ImportedClip& imported) {
  ObjectTrack& track = imported.clip.object.emplace();
  track.name = object.name.empty() ? "object" : object.name;
  track.trans.resize(3, std::ssize(object.poses));
  track.orient.resize(3, track.trans.cols());
  for (Eigen::Index t = 0; t < track.trans.cols(); ++t) {
    track.trans.col(t) = object.poses[t]->translation();
    track.orient.col(t) = LogSO3(object.poses[t]->linear());
  }
  imported.conventions.push_back("object: x = R x + t");
  FindObjectMesh(path, meshes, options, imported);
}

Eigen::MatrixXd ReadQuaternions(const DataValue& value, Eigen::Index joints) {
  const NpyMember member = value.Array();
  const std::vector<double> numbers = member.AsDoubles();
  const Eigen::Index size = 4 * joints;
  if (numbers.empty() || std::ssize(numbers) % size != 0 || member.array.shape.back() != 4) {
    throw Error(value.Where(), fmt::format("has shape {}", member.ShapeText()),
                fmt::format("Give {} quaternions (w, x, y, z) a frame", joints));
  }
  Eigen::MatrixXd turns(3 * joints, std::ssize(numbers) / size);
  for (Eigen::Index i = 0; i < joints * turns.cols(); ++i) {
    const Eigen::Map<const Eigen::Vector4d> wxyz(numbers.data() + 4 * i);
    turns.reshaped(3, joints * turns.cols()).col(i) =
        LogSO3(PoseOfQuaternion(wxyz, Eigen::Vector3d::Zero(), value.Where()).linear());
  }
  return turns;
}

Eigen::Isometry3d PoseOfMatrix(const Eigen::Matrix<double, 3, 4>& matrix,
                               const std::string& where) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix.leftCols<3>(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = svd.matrixU() * svd.matrixV().transpose();
  pose.translation() = matrix.col(3);
  if (!(svd.singularValues()[2] > 0.5 && svd.singularValues()[0] < 2.0) ||
      pose.linear().determinant() < 0.0) {
    throw Error(where, "has no rotation", "Give rotation matrices of determinant 1");
  }
  return pose;
}

Eigen::Isometry3d PoseOfQuaternion(const Eigen::Vector4d& wxyz, const Eigen::Vector3d& place,
                                   const std::string& where) {
  if (!(wxyz.norm() > 0.5 && wxyz.norm() < 2.0)) {
    throw Error(where, "has no rotation", "Give a quaternion of length 1");
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized().toRotationMatrix();
  pose.translation() = place;
  return pose;
}

std::vector<Eigen::Isometry3d> ReadRigidPoses(const DataValue& value) {
  const NpyMember member = value.Array();
  const std::vector<std::size_t>& shape = member.array.shape;
  const std::size_t last = shape.empty() ? 0 : shape.back();
  const std::size_t rows = shape.size() < 2 ? 0 : shape[shape.size() - 2];
  const bool matrices = last == 4 && (rows == 3 || rows == 4);
  if (!matrices && last != 7) {
    throw Error(value.Where(),
                fmt::format("has shape {}, which is not that of rigid poses", member.ShapeText()),
                "Give matrices (..., 3, 4) or (..., 4, 4), or (..., 7): x, y, z, w and a position");
  }
  const std::vector<double> numbers = member.AsDoubles();
  const std::size_t size = matrices ? 4 * rows : 7;
  std::vector<Eigen::Isometry3d> poses;
  for (std::size_t at = 0; at + size <= numbers.size(); at += size) {
    const double* const n = numbers.data() + at;
    const std::string where = fmt::format("{}, pose {}", value.Where(), poses.size());
    if (matrices) {
      poses.push_back(
          PoseOfMatrix(Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(n), where));
      continue;
    }
    poses.push_back(PoseOfQuaternion({n[3], n[0], n[1], n[2]}, {n[4], n[5], n[6]}, where));
  }
  return poses;
}

}  // namespace holdfast
