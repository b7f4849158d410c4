// SPDX-License-Identifier: MIT
#include "geometry/body/body_frames.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>
#include <vector>

#include "geometry/body/kernels/skinning_arguments.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kTile = kernels::kTileVertices;

// With few blend shapes, skinning dominates, and posing frames one by one is faster.
bool IsWorthwhile(const BodySurface& surface, std::size_t frames) {
  std::size_t moved = 0;
  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) moved += block.vertices.size();
  return frames > 1 && moved > 4 * static_cast<std::size_t>(surface.NumVertices());
}

std::pair<kernels::PoseTileLoop*, kernels::AdjointTileLoop*> LoopsOf([[maybe_unused]] Isa isa) {
#if defined(HOLDFAST_X86_KERNELS)
  if (isa == Isa::kAvx512) return {kernels::PoseTileAvx512, kernels::AdjointTileAvx512};
  if (isa == Isa::kAvx2) return {kernels::PoseTileAvx2, kernels::AdjointTileAvx2};
#endif
  return {kernels::PoseTileGeneric, kernels::AdjointTileGeneric};
}

// States of several frames in the layout of the loops: each scalar of all frames side by side.
class FrameRows {
 public:
  FrameRows(const BodySurface& surface, std::span<const BodyState> states)
      : num_vertices_(surface.NumVertices()),
        width_((static_cast<long>(states.size()) + kernels::kFrameQuantum - 1) /
               kernels::kFrameQuantum * kernels::kFrameQuantum),
        rotation_(Rows(9 * kNumJoints)),
        offset_(Rows(3 * kNumJoints)),
        features_(9 * surface.PoseDirs().size() * static_cast<std::size_t>(width_)),
        next_(surface.PoseDirs().size(), 0) {
    for (std::size_t t = 0; t < states.size(); ++t) {
      for (int j = 0; j < kNumJoints; ++j) {
        SetMatrix(rotation_, j, t, states[t].world_rotation[j]);
        for (int c = 0; c < 3; ++c) offset_[(3 * j + c) * width_ + t] = states[t].skin_offset(c, j);
      }
    }
    for (std::size_t b = 0; b < next_.size(); ++b) {
      const BodySurface::PoseDirBlock& block = surface.PoseDirs()[b];
      bool turns = false;
      for (std::size_t t = 0; t < states.size(); ++t) {
        const Eigen::Matrix3d feature =
            states[t].local_rotation[block.joint] - Eigen::Matrix3d::Identity();
        turns |= !feature.isZero(0.0);
        SetMatrix(features_, b, t, feature);
      }
      blocks_.push_back({block.vertices.data(), static_cast<long>(block.vertices.size()),
                         block.dirs.data(), turns ? features_.data() + 9 * b * width_ : nullptr});
    }
    in_ = {width_,
           blocks_.data(),
           static_cast<int>(blocks_.size()),
           surface.RestVertices().data(),
           surface.AllWeights().data(),
           surface.WeightBegin().data(),
           rotation_.data(),
           offset_.data()};
  }

  std::vector<double> Rows(std::size_t count) const { return std::vector<double>(count * width_); }
  const kernels::SkinningArguments& In() const { return in_; }
  long* Next() { return next_.data(); }

  // Calls tile(begin, end) for all tiles.
  template <typename Tile>
  void ForTiles(const Tile& tile) const {
    for (int begin = 0; begin < num_vertices_; begin += kTile) {
      tile(begin, std::min(begin + kTile, num_vertices_));
    }
  }
  // Copies rows of a tile, 3 per vertex, to columns [begin, end) of one frame, and back.
  void ToFrame(const std::vector<double>& rows, int begin, int end, std::size_t t,
               double* columns) const {
    for (int r = 3 * begin; r < 3 * end; ++r) columns[r] = rows[(r - 3 * begin) * width_ + t];
  }
  void FromFrame(const double* columns, int begin, int end, std::size_t t,
                 std::vector<double>& rows) const {
    for (int r = 3 * begin; r < 3 * end; ++r) rows[(r - 3 * begin) * width_ + t] = columns[r];
  }
  Eigen::Matrix3d Matrix(const std::vector<double>& rows, std::size_t index, std::size_t t) const {
    Eigen::Matrix3d matrix;
    for (int e = 0; e < 9; ++e) matrix(e / 3, e % 3) = rows[(9 * index + e) * width_ + t];
    return matrix;
  }
  Eigen::Vector3d Vector(const std::vector<double>& rows, int index, std::size_t t) const {
    return {rows[3 * index * width_ + t], rows[(3 * index + 1) * width_ + t],
            rows[(3 * index + 2) * width_ + t]};
  }

 private:
  template <typename Real>
  void SetMatrix(std::vector<Real>& rows, std::size_t index, std::size_t t,
                 const Eigen::Matrix3d& matrix) const {
    for (int e = 0; e < 9; ++e) {
      rows[(9 * index + e) * width_ + t] = static_cast<Real>(matrix(e / 3, e % 3));
    }
  }

  int num_vertices_;
  long width_;
  std::vector<double> rotation_, offset_;
  std::vector<float> features_;
  std::vector<long> next_;
  std::vector<kernels::SkinningArguments::Block> blocks_;
  kernels::SkinningArguments in_;
};

// Derivatives passed from skinning and pose blend shapes to the joints: with respect to G_j^R
// without the part through A_j^t, to R_j, and to A_j^t.
struct SkinGradient {
  std::array<Eigen::Matrix3d, kNumJoints> world, local;
  Eigen::Matrix<double, 3, kNumJoints> offset;
};

void AddSkin(const BodySurface& surface, const BodyState& state,
             const Eigen::Ref<const Eigen::Matrix3Xd>& d_vertices, Eigen::Matrix3Xd& d_posed_rest,
             SkinGradient& skin) {
  for (Eigen::Index i = 0; i < d_vertices.cols(); ++i) {
    for (const auto& [joint, w] : surface.Weights(static_cast<int>(i))) {
      const Eigen::Vector3d share = w * d_vertices.col(i);
      skin.offset.col(joint) += share;
      skin.world[joint].noalias() += share * state.posed_rest.col(i).transpose();
      d_posed_rest.col(i).noalias() += state.world_rotation[joint].transpose() * share;
    }
  }
  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
    Eigen::Matrix<double, 9, 1> feature = Eigen::Matrix<double, 9, 1>::Zero();
    for (std::size_t k = 0; k < block.vertices.size(); ++k) {
      feature.noalias() += block.dirs.middleRows<3>(3 * static_cast<Eigen::Index>(k)).transpose() *
                           d_posed_rest.col(block.vertices[k]);
    }
    skin.local[block.joint] += feature.reshaped<Eigen::RowMajor>(3, 3);
  }
}

// Derivative with respect to the axis-angle w of R = exp([w]x): dR = [Jl dw]x R, and <D, [omega]x
// R> is the dot product of omega with the axial vector of D R'.
Eigen::Vector3d ByAxisAngle(const Eigen::Matrix3d& d_rotation, const Eigen::Matrix3d& R,
                            const Eigen::Vector3d& w) {
  const Eigen::Matrix3d turned = d_rotation * R.transpose();
  const Eigen::Vector3d axial(turned(2, 1) - turned(1, 2), turned(0, 2) - turned(2, 0),
                              turned(1, 0) - turned(0, 1));
  return LeftJacobianSO3(w).transpose() * axial;
}

// From `skin` down the tree: everything but rest_vertices.
void JointAdjoint(const BodySurface& surface, const BodyState& state, SkinGradient& skin,
                  const Eigen::Ref<const Eigen::Matrix<double, 3, kNumJoints>>& d_joints,
                  BodyGradient& gradient) {
  gradient.rest_joints.setZero();
  // A_j^t = G_j^t - G_j^R J_j; then, from the leaves to the root, G_j^R = G_parent^R R_j and G_j^t
  // = G_parent^R (J_j - J_parent) + G_parent^t.
  const Eigen::Matrix3Xd& J = surface.RestJoints();
  Eigen::Matrix<double, 3, kNumJoints> origin = d_joints + skin.offset;
  for (int j = kNumJoints - 1; j >= 0; --j) {
    const Eigen::Matrix3d& R = state.local_rotation[j];
    Eigen::Matrix3d& world = skin.world[j];
    world.noalias() -= skin.offset.col(j) * J.col(j).transpose();
    gradient.rest_joints.col(j).noalias() -=
        state.world_rotation[j].transpose() * skin.offset.col(j);
    const int parent = kJointParents[static_cast<std::size_t>(j)];
    if (parent < 0) {
      skin.local[j] += world;
      gradient.trans = origin.col(j);
      gradient.rest_joints.col(j) += origin.col(j);
    } else {
      const Eigen::Matrix3d from_world = state.world_rotation[parent].transpose();
      skin.local[j].noalias() += from_world * world;
      skin.world[parent].noalias() += world * R.transpose();
      skin.world[parent].noalias() += origin.col(j) * (J.col(j) - J.col(parent)).transpose();
      origin.col(parent) += origin.col(j);
      const Eigen::Vector3d along = from_world * origin.col(j);
      gradient.rest_joints.col(j) += along;
      gradient.rest_joints.col(parent) -= along;
    }
    gradient.pose.col(j) = ByAxisAngle(skin.local[j], R, state.pose.col(j));
  }
}

}  // namespace

void ForwardFrames(const BodySurface& surface, std::span<const JointPose> poses,
                   const Eigen::Ref<const Eigen::Matrix3Xd>& trans, std::span<BodyState> states,
                   Isa isa) {
  assert(poses.size() == states.size() && trans.cols() == static_cast<Eigen::Index>(poses.size()));
  const bool together = IsWorthwhile(surface, states.size());
  for (std::size_t t = 0; t < states.size(); ++t) {
    const auto root = trans.col(static_cast<Eigen::Index>(t));
    if (!together) {
      Forward(surface, poses[t], root, states[t]);
      continue;
    }
    ForwardJoints(surface.RestJoints(), poses[t], root, states[t]);
    states[t].posed_rest.resize(3, surface.NumVertices());
    states[t].vertices.resize(3, surface.NumVertices());
  }
  if (!together) return;
  FrameRows frames(surface, states);
  std::vector<double> posed_rest = frames.Rows(3 * kTile), vertices = frames.Rows(3 * kTile);
  std::vector<float> offsets(posed_rest.size());
  kernels::PoseTileLoop* const pose_tile = LoopsOf(isa).first;
  frames.ForTiles([&](int begin, int end) {
    pose_tile(frames.In(), begin, end, frames.Next(), offsets.data(), posed_rest.data(),
              vertices.data());
    for (std::size_t t = 0; t < states.size(); ++t) {
      frames.ToFrame(posed_rest, begin, end, t, states[t].posed_rest.data());
      frames.ToFrame(vertices, begin, end, t, states[t].vertices.data());
    }
  });
}

void VertexAdjointFrames(const BodySurface& surface, std::span<const BodyState> states,
                         const Eigen::Ref<const Eigen::Matrix3Xd>& d_vertices,
                         const Eigen::Ref<const Eigen::Matrix3Xd>& d_joints,
                         std::span<BodyGradient> gradients, Isa isa) {
  const Eigen::Index n = surface.NumVertices();
  assert(states.size() == gradients.size());
  assert(d_vertices.cols() == 0 ||
         d_vertices.cols() == n * static_cast<Eigen::Index>(states.size()));
  const auto by_joints = [&](std::size_t t) {
    return d_joints.middleCols<kNumJoints>(static_cast<Eigen::Index>(kNumJoints * t));
  };
  if (d_vertices.cols() == 0 || !IsWorthwhile(surface, states.size())) {
    const Eigen::Index columns = d_vertices.cols() == 0 ? 0 : n;
    for (std::size_t t = 0; t < states.size(); ++t) {
      VertexAdjoint(surface, states[t],
                    d_vertices.middleCols(columns * static_cast<Eigen::Index>(t), columns),
                    by_joints(t), gradients[t]);
    }
    return;
  }
  FrameRows frames(surface, states);
  std::vector<double> rotation = frames.Rows(9 * kNumJoints), offset = frames.Rows(3 * kNumJoints);
  std::vector<double> features = frames.Rows(9 * surface.PoseDirs().size());
  for (BodyGradient& gradient : gradients) gradient.rest_vertices.resize(3, n);
  std::vector<double> posed_rest = frames.Rows(3 * kTile), d_posed_rest = posed_rest;
  std::vector<double> d_tile = posed_rest;
  kernels::AdjointTileLoop* const adjoint_tile = LoopsOf(isa).second;
  frames.ForTiles([&](int begin, int end) {
    for (std::size_t t = 0; t < states.size(); ++t) {
      frames.FromFrame(states[t].posed_rest.data(), begin, end, t, posed_rest);
      frames.FromFrame(d_vertices.data() + 3 * n * static_cast<Eigen::Index>(t), begin, end, t,
                       d_tile);
    }
    adjoint_tile(frames.In(), begin, end, frames.Next(), posed_rest.data(), d_tile.data(),
                 d_posed_rest.data(), {rotation.data(), offset.data(), features.data()});
    for (std::size_t t = 0; t < states.size(); ++t) {
      frames.ToFrame(d_posed_rest, begin, end, t, gradients[t].rest_vertices.data());
    }
  });
  for (std::size_t t = 0; t < states.size(); ++t) {
    SkinGradient skin;
    for (int j = 0; j < kNumJoints; ++j) {
      skin.world[j] = frames.Matrix(rotation, static_cast<std::size_t>(j), t);
      skin.local[j].setZero();
      skin.offset.col(j) = frames.Vector(offset, j, t);
    }
    for (std::size_t b = 0; b < surface.PoseDirs().size(); ++b) {
      skin.local[surface.PoseDirs()[b].joint] += frames.Matrix(features, b, t);
    }
    JointAdjoint(surface, states[t], skin, by_joints(t), gradients[t]);
  }
}

void VertexAdjoint(const BodySurface& surface, const BodyState& state,
                   const Eigen::Ref<const Eigen::Matrix3Xd>& d_vertices,
                   const Eigen::Ref<const Eigen::Matrix<double, 3, kNumJoints>>& d_joints,
                   BodyGradient& gradient) {
  assert(d_vertices.cols() == 0 || d_vertices.cols() == surface.NumVertices());
  SkinGradient skin;
  skin.world.fill(Eigen::Matrix3d::Zero());
  skin.local.fill(Eigen::Matrix3d::Zero());
  skin.offset.setZero();
  gradient.rest_vertices.setZero(3, surface.NumVertices());
  if (d_vertices.cols() > 0) {
    AddSkin(surface, state, d_vertices, gradient.rest_vertices, skin);
  }
  JointAdjoint(surface, state, skin, d_joints, gradient);
}

Eigen::VectorXd ShapeGradient(const BodySurface& surface, const Eigen::Matrix3Xd& rest_vertices,
                              const Eigen::Matrix<double, 3, kNumJoints>& rest_joints, int count) {
  const BodyModel& model = surface.Model();
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(count);
  for (int k = 0; k < std::min(count, model.NumShape()); ++k) {
    const Eigen::Matrix3Xd moved =
        model.ShapedVertices(Eigen::VectorXd::Unit(k + 1, k)) - model.Template();
    gradient[k] = rest_joints.cwiseProduct(model.RestJoints(moved)).sum();
    for (int i = 0; i < surface.NumVertices(); ++i) {
      gradient[k] += rest_vertices.col(i).dot(moved.col(surface.VertexIds()[i]));
    }
  }
  return gradient;
}

}  // namespace holdfast
