// SPDX-License-Identifier: MIT
#include "meshes/make/body/joint_regressor.h"

#include <algorithm>
#include <vector>

#include <Eigen/Dense>

#include "geometry/error.h"
#include "meshes/make/body/body_skinning.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;

/// Whether vertex i may speak for a joint: it moves with the joint or its parent. Keeps the
/// neighbouring finger and the other leg out.
std::vector<int> Candidates(const Eigen::MatrixXd& weights, int joint) {
  std::vector<int> ids;
  for (int i = 0; i < weights.rows(); ++i) {
    double share = weights(i, joint);
    if (kJointParents[joint] >= 0) share += weights(i, kJointParents[joint]);
    if (weights.col(joint).maxCoeff() == 0 || share > 0.3) ids.push_back(i);
  }
  return ids;
}

/// The smallest relative change of a bell around the joint that sums to 1 and hits the joint:
/// w_i = g_i (a + b . (v_i - J)), four linear equations for a and b.
bool SolveRing(const BodyMesh& body, const std::vector<int>& ids, const Vector3d& joint,
               double radius, Eigen::VectorXd& row) {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  const auto bell = [&](const Vector3d& v) {
    const double t = (v - joint).squaredNorm() / (radius * radius);
    return t < 1 ? (1 - t) * (1 - t) : 0.0;
  };
  const auto moments = [&](const Vector3d& v) {
    return Vector4d(1, (v - joint).x() / radius, (v - joint).y() / radius,
                    (v - joint).z() / radius);
  };
  for (const int i : ids) {
    const Vector3d v = body.mesh.vertices.col(i);
    const Vector4d m = moments(v);
    normal += bell(v) * m * m.transpose();
  }
  const Eigen::FullPivLU<Eigen::Matrix4d> lu(normal);
  if (!lu.isInvertible()) return false;
  const Vector4d coefficients = lu.solve(Vector4d(1, 0, 0, 0));
  row.setZero(body.mesh.NumVertices());
  for (const int i : ids) {
    const Vector3d v = body.mesh.vertices.col(i);
    row[i] = bell(v) * coefficients.dot(moments(v));
    if (row[i] < 0) return false;
  }
  return true;
}

}  // namespace

Eigen::MatrixXd JointRegressor(const BodyMesh& body, const Eigen::MatrixXd& weights) {
  const RestJoints joints = DefaultRestJoints();
  Eigen::MatrixXd regressor = Eigen::MatrixXd::Zero(kNumJoints, body.mesh.NumVertices());
  for (int j = 0; j < kNumJoints; ++j) {
    if (MirrorJoint(j) < j) continue;
    const Vector3d joint = joints.col(j);
    const std::vector<int> ids = Candidates(weights, j);
    double nearest = 1;
    for (const int i : ids) nearest = std::min(nearest, (body.mesh.vertices.col(i) - joint).norm());
    Eigen::VectorXd row;
    bool found = false;
    for (double radius = 1.25 * nearest; radius < 0.4 && !found; radius *= 1.1) {
      found = SolveRing(body, ids, joint, radius, row);
    }
    if (!found) {
      throw Error(kJointNames[j], "no ring of vertices around the joint has it inside",
                  "Move the joint into the body.");
    }
    for (int i = 0; i < body.mesh.NumVertices(); ++i) {
      regressor(j, i) = row[i];
      if (MirrorJoint(j) != j) regressor(MirrorJoint(j), body.MirrorVertex(i)) = row[i];
    }
  }
  return regressor;
}

}  // namespace holdfast
