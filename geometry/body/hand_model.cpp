// SPDX-License-Identifier: MIT
#include "geometry/body/hand_model.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "geometry/body/body_kinematics.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace holdfast {
namespace {

// Linear blend skinning of one pose, for the vertices of a hand that its fingers have moved.
struct SkinnedPose {
  const std::pair<int, double>* weights;  // (joint, weight), of all vertices
  const int* weight_begin;
  const Eigen::Matrix3d* rotation;  // per joint
  const double* offset;             // 3 per joint
  const double* posed_rest;         // 3 per vertex
  Eigen::Matrix3d* blend;           // per vertex
  double* vertices;                 // 3 per vertex
};

void SkinVertices(const SkinnedPose& pose, std::span<const int> ids) {
  for (const int i : ids) {
    Eigen::Matrix3d blend = Eigen::Matrix3d::Zero();
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    for (int k = pose.weight_begin[i]; k < pose.weight_begin[i + 1]; ++k) {
      const auto& [joint, w] = pose.weights[k];
      blend += w * pose.rotation[joint];
      offset += w * Eigen::Map<const Eigen::Vector3d>(pose.offset + 3 * joint);
    }
    pose.blend[i] = blend;
    Eigen::Map<Eigen::Vector3d>(pose.vertices + 3 * i).noalias() =
        blend * Eigen::Map<const Eigen::Vector3d>(pose.posed_rest + 3 * i) + offset;
  }
}

#if defined(__x86_64__)
#define HOLDFAST_AVX2 [[gnu::target("avx2")]]

HOLDFAST_AVX2 inline __m256d Load3(const double* p) {
  return _mm256_insertf128_pd(_mm256_castpd128_pd256(_mm_loadu_pd(p)), _mm_load_sd(p + 2), 1);
}
HOLDFAST_AVX2 inline void Store3(double* p, const __m256d& v) {
  _mm_storeu_pd(p, _mm256_castpd256_pd128(v));
  _mm_store_sd(p + 2, _mm256_extractf128_pd(v, 1));
}

// SkinVertices with four-wide registers: same sums in the same order, so bitwise identical.
HOLDFAST_AVX2 void SkinVerticesAvx(const SkinnedPose& pose, std::span<const int> ids) {
  for (const int i : ids) {
    __m256d x = _mm256_setzero_pd(), y = x, z = x, offset = x;
    for (int k = pose.weight_begin[i]; k < pose.weight_begin[i + 1]; ++k) {
      const int joint = pose.weights[k].first;
      const __m256d w = _mm256_set1_pd(pose.weights[k].second);
      const double* const R = pose.rotation[joint].data();
      x += w * _mm256_loadu_pd(R);
      y += w * _mm256_loadu_pd(R + 3);
      z += w * Load3(R + 6);
      offset += w * Load3(pose.offset + 3 * joint);
    }
    double* const blend = pose.blend[i].data();
    _mm256_storeu_pd(blend, x);  // in this order: each store overlaps the next by one
    _mm256_storeu_pd(blend + 3, y);
    Store3(blend + 6, z);
    const double* const p = pose.posed_rest + 3 * i;
    x *= _mm256_set1_pd(p[0]);
    y *= _mm256_set1_pd(p[1]);
    z *= _mm256_set1_pd(p[2]);
    // In Eigen's order: two rows at once, then one.
    Store3(pose.vertices + 3 * i, _mm256_blend_pd((x + y) + z, x + (y + z), 0b100) + offset);
  }
}

#undef HOLDFAST_AVX2
#endif

using JointSet = std::uint32_t;  // bit k: finger joint k

JointSet WithAncestors(int finger_joint) {
  // Fingers are chains of three joints: the ancestors of a joint are those before it in its finger.
  JointSet set = 0;
  for (int k = finger_joint; k >= finger_joint - finger_joint % 3; --k) set |= JointSet{1} << k;
  return set;
}

}  // namespace

FingerPose FingersOf(const JointPose& pose, Side side) {
  return pose.middleCols<kJointsPerHand>(HandBegin(side)).reshaped();
}

void SetFingers(JointPose& pose, Side side, const FingerPose& fingers) {
  pose.middleCols<kJointsPerHand>(HandBegin(side)) = fingers.reshaped(3, kJointsPerHand);
}

HandModel::HandModel(std::shared_ptr<const BodyModel> model, const Eigen::VectorXd& betas,
                     Side side)
    : side_(side), surface_(model, betas, model->HandVertexIds(side)) {
  const int first = HandBegin(side);
  const auto finger_joint = [&](int joint) {
    const int k = joint - first;
    return k >= 0 && k < kJointsPerHand ? k : -1;
  };

  std::vector<JointSet> moved_by(NumVertices(), 0);
  for (int i = 0; i < NumVertices(); ++i) {
    for (const auto& [joint, w] : surface_.Weights(i)) {
      if (finger_joint(joint) >= 0) moved_by[i] |= WithAncestors(finger_joint(joint));
    }
  }
  for (const BodySurface::PoseDirBlock& block : surface_.PoseDirs()) {
    const int k = finger_joint(block.joint);
    if (k < 0) continue;
    for (const int i : block.vertices) moved_by[i] |= JointSet{1} << k;
  }

  // A few large groups suit matrix products better than many exact ones: none, one finger, or all.
  const auto round_up = [](JointSet set) {
    if (set == 0) return set;
    for (int finger = 0; finger < 5; ++finger) {
      const JointSet whole = JointSet{7} << (3 * finger);
      if ((set & ~whole) == 0) return whole;
    }
    return (JointSet{1} << kJointsPerHand) - 1;
  };
  std::map<JointSet, int> group_of_set;
  places_.resize(static_cast<std::size_t>(NumVertices()));
  for (int i = 0; i < NumVertices(); ++i) {
    const JointSet set = round_up(moved_by[i]);
    const auto [it, is_new] = group_of_set.try_emplace(set, static_cast<int>(groups_.size()));
    if (is_new) {
      groups_.emplace_back();
      for (int k = 0; k < kJointsPerHand; ++k) {
        if (set >> k & 1) groups_.back().joints.push_back(k);
      }
    }
    places_[static_cast<std::size_t>(i)] = {it->second,
                                            static_cast<int>(groups_[it->second].vertices.size())};
    groups_[it->second].vertices.push_back(i);
  }

  for (const BodySurface::PoseDirBlock& block : surface_.PoseDirs()) {
    if (finger_joint(block.joint) < 0) continue;
    for (int g = 0; g < static_cast<int>(groups_.size()); ++g) {
      BodySurface::PoseDirBlock part{block.joint, {}, {}};
      std::vector<int> rows;
      for (int m = 0; m < static_cast<int>(block.vertices.size()); ++m) {
        if (PlaceOf(block.vertices[m]).group != g) continue;
        part.vertices.push_back(block.vertices[m]);
        rows.insert(rows.end(), {3 * m, 3 * m + 1, 3 * m + 2});
      }
      if (rows.empty()) continue;
      part.dirs = block.dirs(rows, Eigen::all);
      finger_dirs_.emplace_back(g, std::move(part));
    }
  }
}

HandState::HandState(const HandModel& hand)
    : hand_(&hand),
      wrist_(WristJoint(hand.HandSide())),
      first_(HandBegin(hand.HandSide())),
      jacobians_(hand.Groups().size()),
      blend_(hand.NumVertices()) {
  for (std::size_t g = 0; g < jacobians_.size(); ++g) {
    const HandModel::Group& group = hand.Groups()[g];
    jacobians_[g].setZero(3 * static_cast<Eigen::Index>(group.vertices.size()),
                          3 * static_cast<Eigen::Index>(group.joints.size()));
  }
  vertices_.setZero(3, hand.NumVertices());
}

void HandState::SetBody(const JointPose& pose, const Eigen::Vector3d& trans) {
  ForwardJoints(hand_->surface_.RestJoints(), pose, trans, body_);
  // NaN differs from any pose: the next Evaluate recomputes all fingers.
  body_.pose.middleCols<kJointsPerHand>(first_).setConstant(std::nan(""));
  base_ = hand_->surface_.RestVertices();
  for (const BodySurface::PoseDirBlock& block : hand_->surface_.PoseDirs()) {
    if (IsFinger(block.joint, hand_->HandSide())) continue;
    block.AddTo(base_, body_.local_rotation[block.joint]);
  }
}

// Only recomputes vertices affected by fingers that have moved since the last call.
void HandState::Evaluate(const FingerPose& fingers, bool with_jacobian) {
  const BodySurface& surface = hand_->surface_;
  const Eigen::Matrix3Xd& rest_joints = surface.RestJoints();
  std::array<bool, kJointsPerHand> moved;  // whether any joint of the same finger moved
  for (int k = 0; k < kJointsPerHand; ++k) {
    const int finger = k - k % 3;
    moved[k] = k == finger
                   ? fingers.segment<9>(3 * k) != body_.pose.middleCols<3>(first_ + k).reshaped()
                   : moved[finger];
  }
  for (int k = 0; k < kJointsPerHand; ++k) {
    if (!moved[k]) continue;
    const int j = first_ + k;
    const int parent = kJointParents[j];
    body_.pose.col(j) = fingers.segment<3>(3 * k);
    body_.local_rotation[j] = ExpSO3(fingers.segment<3>(3 * k));
    body_.world_rotation[j].noalias() = body_.world_rotation[parent] * body_.local_rotation[j];
    body_.joints.col(j) = body_.joints.col(parent);
    body_.joints.col(j).noalias() +=
        body_.world_rotation[parent] * (rest_joints.col(j) - rest_joints.col(parent));
    body_.skin_offset.col(j) = body_.joints.col(j);
    body_.skin_offset.col(j).noalias() -= body_.world_rotation[j] * rest_joints.col(j);
  }
  const bool all = std::ranges::find(moved, false) == moved.end();
  if (all) posed_rest_ = base_;
  std::vector<bool> moves(hand_->groups_.size());
  for (std::size_t g = 0; g < moves.size(); ++g) {
    const HandModel::Group& group = hand_->groups_[g];
    moves[g] = all || std::ranges::any_of(group.joints, [&](int k) { return moved[k]; });
    if (!moves[g] || all) continue;
    for (const int i : group.vertices) posed_rest_.col(i) = base_.col(i);
  }
  for (const auto& [group, block] : hand_->finger_dirs_) {
    if (moves[group]) block.AddTo(posed_rest_, body_.local_rotation[block.joint]);
  }
  const SkinnedPose pose{surface.AllWeights().data(),
                         surface.WeightBegin().data(),
                         body_.world_rotation.data(),
                         body_.skin_offset.data(),
                         posed_rest_.data(),
                         blend_.data(),
                         vertices_.data()};
  auto* skin = SkinVertices;
#if defined(__x86_64__)
  static const bool avx = BestIsa() >= Isa::kAvx2;
  if (avx) skin = SkinVerticesAvx;
#endif
  for (std::size_t g = 0; g < moves.size(); ++g) {
    if (moves[g]) skin(pose, hand_->groups_[g].vertices);
  }
  if (with_jacobian) EvaluateJacobians();
}

void HandState::EvaluateJacobians() {
  const BodySurface& surface = hand_->surface_;
  std::array<Eigen::Matrix3d, kJointsPerHand> left_jacobian, axes;
  for (int k = 0; k < kJointsPerHand; ++k) {
    left_jacobian[k] = LeftJacobianSO3(body_.pose.col(first_ + k));
    axes[k].noalias() = body_.world_rotation[kJointParents[first_ + k]] * left_jacobian[k];
  }

  for (std::size_t g = 0; g < jacobians_.size(); ++g) {
    const HandModel::Group& group = hand_->groups_[g];
    if (group.joints.empty()) continue;
    std::array<int, kJointsPerHand> column;
    column.fill(-1);
    for (std::size_t k = 0; k < group.joints.size(); ++k) {
      column[group.joints[k]] = static_cast<int>(3 * k);
    }
    JacobianMatrix& J = jacobians_[g];
    J.setZero();
    for (std::size_t m = 0; m < group.vertices.size(); ++m) {
      const int i = group.vertices[m];
      // As in VertexJacobian: each joint moves what is skinned to it and its descendants.
      std::array<Eigen::Vector3d, kJointsPerHand> carried;
      std::array<double, kJointsPerHand> carried_weight{};
      for (const auto& [joint, w] : surface.Weights(i)) {
        const int k = joint - first_;
        if (k < 0 || k >= kJointsPerHand) continue;
        const Eigen::Vector3d x =
            w * (body_.world_rotation[joint] * posed_rest_.col(i) + body_.skin_offset.col(joint));
        for (int a = k; a >= k - k % 3; --a) {
          carried[a] = carried_weight[a] == 0.0 ? x : Eigen::Vector3d(carried[a] + x);
          carried_weight[a] += w;
        }
      }
      for (const int a : group.joints) {
        if (carried_weight[a] == 0.0) continue;
        const Eigen::Vector3d arm = carried[a] - carried_weight[a] * body_.joints.col(first_ + a);
        auto block = J.block<3, 3>(3 * static_cast<Eigen::Index>(m), column[a]);
        for (int c = 0; c < 3; ++c) block.col(c) = axes[a].col(c).cross(arm);
      }
    }
  }

  for (const auto& [group, block] : hand_->finger_dirs_) {
    const int k = block.joint - first_;
    const Eigen::Matrix<double, 9, 3> J_rotation =
        RotationJacobian(left_jacobian[k], body_.local_rotation[block.joint]);
    const std::vector<int>& joints = hand_->groups_[group].joints;
    const auto column =
        static_cast<Eigen::Index>(3 * (std::ranges::lower_bound(joints, k) - joints.begin()));
    for (std::size_t r = 0; r < block.vertices.size(); ++r) {
      const int vertex = block.vertices[r];
      const Eigen::Matrix3d moved =
          block.dirs.middleRows<3>(3 * static_cast<Eigen::Index>(r)) * J_rotation;
      jacobians_[group].block<3, 3>(3 * hand_->PlaceOf(vertex).member, column).noalias() +=
          blend_[vertex] * moved;
    }
  }
}

void HandState::AddJacobianRow(int vertex, const Eigen::Vector3d& direction, double* row) const {
  const HandModel::Place& place = hand_->PlaceOf(vertex);
  const std::vector<int>& joints = hand_->Groups()[static_cast<std::size_t>(place.group)].joints;
  const JacobianMatrix& J = GroupJacobian(place.group);
  const Eigen::Index first = 3 * static_cast<Eigen::Index>(place.member);
  for (std::size_t k = 0; k < joints.size(); ++k) {
    Eigen::Map<Eigen::RowVector3d>(row + 3 * joints[k]) +=
        direction.transpose() * J.block<3, 3>(first, 3 * static_cast<Eigen::Index>(k));
  }
}

std::vector<int> StrongestHandJoints(const BodySurface& surface, Side side) {
  std::vector<int> strongest(static_cast<std::size_t>(surface.NumVertices()), -1);
  const std::vector<int>& hand = surface.Model().HandVertexIds(side);
  for (int v = 0; v < surface.NumVertices(); ++v) {
    if (!std::ranges::binary_search(hand, surface.VertexIds()[static_cast<std::size_t>(v)])) {
      continue;
    }
    int joint = WristJoint(side);
    double most = 0.0;
    for (const auto& [j, weight] : surface.Weights(v)) {
      if ((IsFinger(j, side) || j == WristJoint(side)) && weight > most) {
        joint = j;
        most = weight;
      }
    }
    strongest[static_cast<std::size_t>(v)] = joint;
  }
  return strongest;
}

}  // namespace holdfast
