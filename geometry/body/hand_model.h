// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"

namespace holdfast {

/// Finger pose: axis-angle of 15 joints, in file order (index, middle, pinky, ring, thumb),
/// radians.
using FingerPose = Eigen::Matrix<double, kHandDofs, 1>;

/// Reads the fingers from a body pose, or writes them to it.
FingerPose FingersOf(const JointPose& pose, Side side);
void SetFingers(JointPose& pose, Side side, const FingerPose& fingers);

/// One hand of one person: N vertices as a function of 45 finger parameters, with the rest of the
/// body fixed. The same model as BodySurface over BodyModel::HandVertexIds, organized for a
/// solver's inner loop: data that the fingers do not affect is computed once per frame, and
/// vertices are grouped by the finger joints that move them, so that Jacobians have no zero
/// columns. Const and shareable.
class HandModel {
 public:
  HandModel(std::shared_ptr<const BodyModel> model, const Eigen::VectorXd& betas, Side side);

  /// Vertices that only these finger joints (0..14, ascending) can move: none, the three of one
  /// finger, or all fifteen.
  struct Group {
    std::vector<int> joints;
    std::vector<int> vertices;
  };

  Side HandSide() const { return side_; }
  int NumVertices() const { return surface_.NumVertices(); }
  const BodySurface& Surface() const { return surface_; }
  const std::vector<Group>& Groups() const { return groups_; }
  /// Position of a vertex in Groups(): groups_[group].vertices[member].
  struct Place {
    int group, member;
  };
  const Place& PlaceOf(int vertex) const { return places_[static_cast<std::size_t>(vertex)]; }

 private:
  friend class HandState;

  Side side_;
  BodySurface surface_;
  std::vector<Group> groups_;
  std::vector<Place> places_;  // per vertex
  // Pose blend shapes of one finger joint on the vertices of one group.
  std::vector<std::pair<int, BodySurface::PoseDirBlock>> finger_dirs_;
};

/// Scratch and result for one hand; one per thread, reused from frame to frame. No allocation after
/// the first frame.
class HandState {
 public:
  explicit HandState(const HandModel& hand);

  /// Fixes everything but the fingers (their columns in `pose` are ignored).
  void SetBody(const JointPose& pose, const Eigen::Vector3d& trans);

  /// Computes the vertices; with `with_jacobian` also the Jacobians. Requires a prior SetBody.
  void Evaluate(const FingerPose& fingers, bool with_jacobian);

  /// Computes the Jacobians at the fingers of the last Evaluate.
  void EvaluateJacobians();

  const HandModel& Hand() const { return *hand_; }
  FingerPose Fingers() const {
    return FingersOf(body_.pose, hand_->HandSide());
  }                                                               ///< last evaluated
  const Eigen::Matrix3Xd& Vertices() const { return vertices_; }  ///< world, meters (3 x N)
  /// d vertices of group g / d its joints: (3 |vertices| x 3 |joints|), row-major.
  const JacobianMatrix& GroupJacobian(int group) const { return jacobians_[group]; }
  /// row += direction^T d vertex / d fingers (`row` has 45 entries).
  void AddJacobianRow(int vertex, const Eigen::Vector3d& direction, double* row) const;
  /// World pose of the wrist.
  const Eigen::Matrix3d& WristRotation() const { return body_.world_rotation[wrist_]; }
  Eigen::Vector3d WristPosition() const { return body_.joints.col(wrist_); }
  Eigen::Isometry3d WorldFromWrist() const { return body_.WorldFromJoint(wrist_); }
  /// Finger joint positions (3 x 15), world, meters, and world rotations.
  Eigen::Matrix<double, 3, kJointsPerHand> JointPositions() const {
    return body_.joints.middleCols<kJointsPerHand>(first_);
  }
  const Eigen::Matrix3d& JointRotation(int finger_joint) const {
    return body_.world_rotation[first_ + finger_joint];
  }

 private:
  const HandModel* hand_;
  int wrist_;
  int first_;
  BodyState body_;
  Eigen::Matrix3Xd base_;        // v_s + blend shapes of all joints but the fingers
  Eigen::Matrix3Xd posed_rest_;  // v_p
  Eigen::Matrix3Xd vertices_;
  std::vector<JacobianMatrix> jacobians_;
  std::vector<Eigen::Matrix3d> blend_;  // per vertex, sum_k w_k G_k^R
};

/// Returns for each vertex the joint of a hand (the wrist, fifteen finger joints) that moves it
/// most; -1 for vertices of other parts.
std::vector<int> StrongestHandJoints(const BodySurface& surface, Side side);

}  // namespace holdfast
