// SPDX-License-Identifier: MIT
#include "meshes/make/body/body_betas.h"

#include <cmath>

#include "meshes/make/body/body_skinning.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

bool Is(int joint, std::string_view part) {
  return kJointNames[joint].find(part) != std::string_view::npos;
}
bool IsFinger(int joint) { return joint >= kLeftHandBegin; }
bool IsHand(int joint) { return IsFinger(joint) || Is(joint, "wrist"); }
bool IsHead(int joint) { return Is(joint, "head") || Is(joint, "jaw") || Is(joint, "eye"); }

/// Unit direction of the bone that starts at a joint.
Vector3d BoneDirection(const RestJoints& joints, int joint) {
  if (IsFinger(joint)) {
    const bool left = joint < kRightHandBegin;
    const int in_hand = joint - (left ? kLeftHandBegin : kRightHandBegin);
    const FingerChain chain = LeftFingerChain(static_cast<Finger>(in_hand / 3));
    Vector3d d = (chain.points[in_hand % 3 + 1] - chain.points[in_hand % 3]).normalized();
    if (!left) d.x() = -d.x();
    return d;
  }
  if (Is(joint, "wrist")) return Vector3d::UnitX();
  if (Is(joint, "foot") || Is(joint, "ankle")) return Vector3d::UnitZ();
  for (const std::string_view limb : {"hip", "knee", "shoulder", "elbow", "collar"}) {
    if (!Is(joint, limb)) continue;
    for (int child = joint + 1; child < kNumJoints; ++child) {
      if (kJointParents[child] == joint) {
        return (joints.col(child) - joints.col(joint)).normalized();
      }
    }
  }
  return Vector3d::UnitY();
}

/// How the bone at `joint` scales with a coefficient, a symmetric matrix acting on p - J.
Matrix3d BoneScale(int beta, int joint, const Vector3d& bone) {
  const Matrix3d along = bone * bone.transpose();
  const Matrix3d across = Matrix3d::Identity() - along;
  const auto diagonal = [](double x, double y, double z) {
    return Matrix3d(Vector3d(x, y, z).asDiagonal());
  };
  const bool spine = Is(joint, "spine") || Is(joint, "pelvis");
  switch (beta) {
    case 0:  // height: everything grows alike
      return 0.036 * Matrix3d::Identity();
    case 1:  // weight
      if (spine) return 0.085 * across;
      if (Is(joint, "hip") || Is(joint, "shoulder")) return 0.080 * across;
      if (Is(joint, "knee") || Is(joint, "elbow") || Is(joint, "neck")) return 0.055 * across;
      if (Is(joint, "collar")) return 0.050 * across;
      if (Is(joint, "ankle")) return 0.020 * across;
      return (IsHand(joint) ? 0.025 : 0.015) * across;
    case 2:  // shoulders and chest
      if (Is(joint, "spine3")) return diagonal(0.050, 0.0, 0.050);
      if (Is(joint, "spine2")) return diagonal(0.020, 0.0, 0.020);
      if (Is(joint, "collar")) return diagonal(0.085, 0.0, 0.030);
      return Matrix3d::Zero();
    case 3:  // long legs, short trunk
      if (Is(joint, "hip") || Is(joint, "knee")) return 0.040 * along;
      return spine ? Matrix3d(-0.030 * along) : Matrix3d::Zero();
    case 4:  // arms
      return Is(joint, "shoulder") || Is(joint, "elbow") ? Matrix3d(0.045 * along)
                                                         : Matrix3d::Zero();
    case 5:  // hands
      return IsHand(joint) ? Matrix3d(0.055 * Matrix3d::Identity()) : Matrix3d::Zero();
    case 6:  // fingers
      if (!IsFinger(joint)) return Matrix3d::Zero();
      return (Is(joint, "thumb1") ? 0.030 : 0.065) * along;
    case 7:  // wide hips, narrow waist
      if (Is(joint, "pelvis")) return diagonal(0.060, 0.0, 0.050);
      if (Is(joint, "hip")) return 0.040 * across;
      if (Is(joint, "spine1")) return diagonal(-0.010, 0.0, -0.010);
      return Is(joint, "spine2") ? diagonal(-0.050, 0.0, -0.045) : Matrix3d(Matrix3d::Zero());
    case 8:  // head
      if (IsHead(joint)) return 0.050 * Matrix3d::Identity();
      return Is(joint, "neck") ? Matrix3d(0.025 * across) : Matrix3d::Zero();
    case 9:  // muscle
      if (Is(joint, "shoulder") || Is(joint, "elbow")) return 0.090 * across;
      if (Is(joint, "hip") || Is(joint, "knee")) return 0.070 * across;
      if (Is(joint, "collar")) return 0.060 * across;
      if (Is(joint, "neck")) return 0.050 * across;
      return Is(joint, "spine3") ? Matrix3d(0.025 * across) : Matrix3d::Zero();
    default:
      return Matrix3d::Zero();
  }
}

}  // namespace

const std::array<std::string_view, kNumBetas> kBetaNames = {"height",
                                                            "weight",
                                                            "shoulders and chest",
                                                            "legs against trunk",
                                                            "arm length",
                                                            "hand size",
                                                            "finger length",
                                                            "hips against waist",
                                                            "head size",
                                                            "muscle of the limbs"};

std::array<Eigen::Matrix3Xd, kNumBetas> ShapeDirections(const BodyMesh& body,
                                                        const Eigen::MatrixXd& weights) {
  constexpr int kSmoothingRounds = 8;
  const RestJoints joints = DefaultRestJoints();
  const Eigen::MatrixXd blend = SmoothedWeights(body, weights, kSmoothingRounds);
  std::array<Eigen::Matrix3Xd, kNumBetas> directions;
  for (int beta = 0; beta < kNumBetas; ++beta) {
    // Displacement of bone j: scale_j (p - J_j) + shift_j, where the shift is the parent's
    // displacement of J_j: bones stay joined.
    std::array<Matrix3d, kNumJoints> scale;
    std::array<Vector3d, kNumJoints> shift;
    for (int j = 0; j < kNumJoints; ++j) {
      scale[j] = BoneScale(beta, j, BoneDirection(joints, j));
      const int parent = kJointParents[j];
      shift[j] =
          parent < 0
              ? Vector3d(Vector3d::Zero())
              : Vector3d(shift[parent] + scale[parent] * (joints.col(j) - joints.col(parent)));
    }
    Eigen::Matrix3Xd& field = directions[beta];
    field.setZero(3, body.mesh.NumVertices());
    for (int i = 0; i < body.NumLeftAndMidline(); ++i) {
      const Vector3d p = body.mesh.vertices.col(i);
      Vector3d move = Vector3d::Zero();
      for (int j = 0; j < kNumJoints; ++j) {
        if (blend(i, j) > 0) move += blend(i, j) * (scale[j] * (p - joints.col(j)) + shift[j]);
      }
      // Weight gathers at the belly.
      if (beta == 1) {
        const Vector3d to_belly =
            (p - Vector3d(0, 0.10, 0.10)).cwiseQuotient(Vector3d(0.10, 0.10, 0.06));
        move.z() += 0.010 * std::exp(-to_belly.squaredNorm());
      }
      if (i < body.num_midline) move.x() = 0;
      field.col(i) = move;
      field.col(body.MirrorVertex(i)) =
          Vector3d(i < body.num_midline ? 0.0 : -move.x(), move.y(), move.z());
    }
  }
  return directions;
}

}  // namespace holdfast
