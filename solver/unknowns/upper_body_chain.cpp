// SPDX-License-Identifier: MIT
#include "solver/unknowns/upper_body_chain.h"

#include <cmath>

#include "generator/body/limb_ik.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kHeadJoint = 15;

// Joint and first column of every rotation; the arm's joints are those of the reaching side.
struct Layout {
  int joint, column;
};
std::array<Layout, 9> LayoutOf(const UpperBodyChain& chain) {
  return {{{0, UpperBodyDofs::kPelvisTurn},
           {3, UpperBodyDofs::kSpine},
           {6, UpperBodyDofs::kSpine + 3},
           {9, UpperBodyDofs::kSpine + 6},
           {chain.CollarJoint(), UpperBodyDofs::kCollar},
           {chain.ShoulderJoint(), UpperBodyDofs::kShoulder},
           {chain.ElbowJoint(), UpperBodyDofs::kElbow},
           {12, UpperBodyDofs::kNeck},
           {kHeadJoint, UpperBodyDofs::kHead}}};
}

Vector3d TurnOf(const UpperBodyChain& chain, const Layout& turn, const UpperBodyChange& change) {
  return turn.column == UpperBodyDofs::kElbow
             ? Vector3d(change(UpperBodyDofs::kElbow) * chain.ElbowHinge())
             : Vector3d(change.segment<3>(turn.column));
}

// Whether `ancestor` is `joint` itself or on its path to the root.
bool Moves(int joint, int ancestor) {
  for (int j = joint; j >= 0; j = kJointParents[j]) {
    if (j == ancestor) return true;
  }
  return false;
}

}  // namespace

UpperBodyChange UpperBodySigma(const Vector3d& pelvis_move, double pelvis_turn, double head_turn) {
  UpperBodyChange sigma;
  sigma.segment<3>(UpperBodyDofs::kPelvisMove) = pelvis_move;
  sigma.segment<3>(UpperBodyDofs::kPelvisTurn).setConstant(pelvis_turn);
  sigma.segment<9>(UpperBodyDofs::kSpine).setConstant(6.0 * kDegree);
  sigma.segment<3>(UpperBodyDofs::kCollar).setConstant(6.0 * kDegree);
  sigma.segment<3>(UpperBodyDofs::kShoulder).setConstant(25.0 * kDegree);
  sigma(UpperBodyDofs::kElbow) = 30.0 * kDegree;
  sigma.segment<3>(UpperBodyDofs::kNeck).setConstant(head_turn);
  sigma.segment<3>(UpperBodyDofs::kHead).setConstant(head_turn);
  return sigma;
}

UpperBodyChain::UpperBodyChain(const Eigen::Matrix3Xd& rest_joints, Side wrist)
    : rest_joints_(rest_joints),
      wrist_(wrist),
      collar_(wrist == Side::kRight ? 14 : 13),
      hinge_(Arm(wrist).hinge) {}

BodyFrame UpperBodyChain::Changed(const BodyFrame& frame, const UpperBodyChange& change) const {
  BodyFrame changed = frame;
  changed.pelvis += change.segment<3>(UpperBodyDofs::kPelvisMove);
  for (const Layout& turn : LayoutOf(*this)) {
    changed.local[turn.joint] =
        (frame.local[turn.joint] * Quaterniond(ExpSO3(TurnOf(*this, turn, change)))).normalized();
  }
  return changed;
}

double UpperBodyChain::ElbowFlexion(const BodyFrame& frame) const {
  const Quaterniond& q = frame.local[ElbowJoint()];
  return std::remainder(2.0 * std::atan2(q.vec().dot(hinge_), q.w()), 2.0 * M_PI);
}

void UpperBodyState::Evaluate(const UpperBodyChain& chain, const BodyFrame& captured,
                              const UpperBodyChange& change) {
  placed_ = Place(chain.RestJoints(), chain.Changed(captured, change));
  const std::array<Layout, 9> layout = LayoutOf(chain);
  for (std::size_t k = 0; k < layout.size(); ++k) {
    Turn& turn = turns_[k];
    turn.joint = layout[k].joint;
    turn.column = layout[k].column;
    turn.size = turn.column == UpperBodyDofs::kElbow ? 1 : 3;
    // exp(x + dx) = exp(x) exp(Jr(x) dx), and Jr(x) = Jl(-x).
    const Vector3d x = TurnOf(chain, layout[k], change);
    turn.J_omega_change = placed_.rotation[turn.joint] * LeftJacobianSO3(-x);
    if (turn.size == 1) turn.J_omega_change.col(0) = turn.J_omega_change * chain.ElbowHinge();
  }
}

J_point_change UpperBodyState::PointJacobian(int joint) const {
  J_point_change J = J_point_change::Zero();
  J.middleCols<3>(UpperBodyDofs::kPelvisMove).setIdentity();
  const Vector3d point = placed_.joints.col(joint);
  for (const Turn& turn : turns_) {
    if (joint == turn.joint || !Moves(joint, turn.joint)) continue;
    const Eigen::Matrix3d arm = -Skew<double>(point - placed_.joints.col(turn.joint));
    J.middleCols(turn.column, turn.size) = arm * turn.J_omega_change.leftCols(turn.size);
  }
  return J;
}

J_point_change UpperBodyState::DirectionJacobian(int joint, const Vector3d& world) const {
  J_point_change J = J_point_change::Zero();
  const Eigen::Matrix3d swing = -Skew<double>(world);
  for (const Turn& turn : turns_) {
    if (!Moves(joint, turn.joint)) continue;
    J.middleCols(turn.column, turn.size) = swing * turn.J_omega_change.leftCols(turn.size);
  }
  return J;
}

}  // namespace holdfast
