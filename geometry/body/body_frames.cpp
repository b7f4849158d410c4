// SPDX-License-Identifier: MIT
#include "geometry/body/body_frames.h"

#include <algorithm>
#include <cassert>
#include <vector>

#include "geometry/body/kernels/skinning_arguments.h"

namespace holdfast {
namespace {

constexpr int kTile = kernels::kTileVertices;

// With few blend shapes, skinning dominates, and posing frames one by one is faster.
bool IsWorthwhile(const BodySurface& surface, std::size_t frames) {
  std::size_t moved = 0;
  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) moved += block.vertices.size();
  return frames > 1 && moved > 4 * static_cast<std::size_t>(surface.NumVertices());
}

struct TileLoops {
  kernels::PoseTileLoop* pose = kernels::PoseTileGeneric;
  kernels::AdjointTileLoop* adjoint = kernels::AdjointTileGeneric;
};

TileLoops LoopsOf([[maybe_unused]] Isa isa) {
#if defined(HOLDFAST_X86_KERNELS)
  if (isa == Isa::kAvx512) return {kernels::PoseTileAvx512, kernels::AdjointTileAvx512};
  if (isa == Isa::kAvx2) return {kernels::PoseTileAvx2, kernels::AdjointTileAvx2};
#endif
  return {};
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
  const TileLoops loops = LoopsOf(isa);
  frames.ForTiles([&](int begin, int end) {
    loops.pose(frames.In(), begin, end, frames.Next(), offsets.data(), posed_rest.data(),
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
  const TileLoops loops = LoopsOf(isa);
  frames.ForTiles([&](int begin, int end) {
    for (std::size_t t = 0; t < states.size(); ++t) {
      frames.FromFrame(states[t].posed_rest.data(), begin, end, t, posed_rest);
      frames.FromFrame(d_vertices.data() + 3 * n * static_cast<Eigen::Index>(t), begin, end, t,
                       d_tile);
    }
    loops.adjoint(frames.In(), begin, end, frames.Next(), posed_rest.data(), d_tile.data(),
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

}  // namespace holdfast
