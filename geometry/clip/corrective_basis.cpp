// SPDX-License-Identifier: MIT
#include "geometry/clip/corrective_basis.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>

#include "geometry/parallel.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kMaxSampledFrames = 400;  // size of the eigenproblem: more frames are redundant
constexpr int kFramesPerBlock = 256;
constexpr int kVerticesPerChunk = 256;
constexpr int kGroups = 8;  // partial sums, added in order: independent of the threads

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using RowMatrixF = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// R_j - I (row-major) of joints 1..54, one column per frame.
RowMatrix PoseFeatures(const Clip& clip, std::span<const int> frames) {
  RowMatrix features(9 * (kNumJoints - 1), static_cast<Eigen::Index>(frames.size()));
  for (std::size_t t = 0; t < frames.size(); ++t) {
    for (int j = 1; j < kNumJoints; ++j) {
      const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> difference =
          ExpSO3(clip.pose[frames[t]].col(j)) - Eigen::Matrix3d::Identity();
      features.block<9, 1>(9 * (j - 1), static_cast<Eigen::Index>(t)) =
          difference.reshaped<Eigen::RowMajor>();
    }
  }
  return features;
}

// Vertices that any pose moves, and their displacement v_p - v_s in chunks: a whole clip would not
// fit into memory, and only sums of products over chunks are needed.
class Displacements {
 public:
  explicit Displacements(const BodySurface& surface) : surface_(surface) {
    std::vector<char> is_moved(surface.NumVertices(), 0);
    for (const auto& block : surface.PoseDirs()) {
      for (const int v : block.vertices) is_moved[v] = 1;
    }
    row_.assign(surface.NumVertices(), -1);
    for (int v = 0; v < surface.NumVertices(); ++v) {
      if (!is_moved[v]) continue;
      row_[v] = static_cast<int>(moved_.size());
      moved_.push_back(v);
    }
  }

  const std::vector<int>& Moved() const { return moved_; }
  int NumMoved() const { return static_cast<int>(moved_.size()); }
  int NumChunks() const { return (NumMoved() + kVerticesPerChunk - 1) / kVerticesPerChunk; }
  int ChunkBegin(int chunk) const { return std::min(chunk * kVerticesPerChunk, NumMoved()); }

  // Rows x, y, z of each vertex of the chunk, one column per column of `features`.
  template <typename Features>
  RowMatrix OfChunk(int chunk, const Features& features) const {
    const int begin = ChunkBegin(chunk);
    const int end = ChunkBegin(chunk + 1);
    RowMatrix result = RowMatrix::Zero(3 * (end - begin), features.cols());
    RowMatrix part;
    for (const auto& block : surface_.PoseDirs()) {
      const auto& ids = block.vertices;
      const auto first = std::lower_bound(ids.begin(), ids.end(), moved_[begin]) - ids.begin();
      const auto last = std::upper_bound(ids.begin(), ids.end(), moved_[end - 1]) - ids.begin();
      if (first == last) continue;
      part.noalias() = block.dirs.middleRows(3 * first, 3 * (last - first)) *
                       features.template middleRows<9>(9 * (block.joint - 1));
      for (auto k = first; k < last; ++k) {
        result.middleRows<3>(3 * (row_[ids[k]] - begin)) += part.middleRows<3>(3 * (k - first));
      }
    }
    return result;
  }

 private:
  const BodySurface& surface_;
  std::vector<int> moved_;  // vertex ids, ascending
  std::vector<int> row_;    // index in moved_ by vertex id
};

// Sum over chunks of term(chunk), in an order independent of `threads`.
template <typename Term>
Eigen::MatrixXd SumOverChunks(int num_chunks, Eigen::Index rows, Eigen::Index cols, int threads,
                              const Term& add_term) {
  std::vector<Eigen::MatrixXd> sums(kGroups, Eigen::MatrixXd::Zero(rows, cols));
  ParallelFor(kGroups, threads, [&](int group) {
    const int end = (group + 1) * num_chunks / kGroups;
    for (int chunk = group * num_chunks / kGroups; chunk < end; ++chunk) {
      add_term(chunk, sums[group]);
    }
  });
  for (int group = 1; group < kGroups; ++group) sums[0] += sums[group];
  return sums[0];
}

// Principal directions in the space of sampled frames: D^T D = W diag(s^2) W^T, largest first.
// Returns s and W.
std::pair<Eigen::VectorXd, Eigen::MatrixXd> Decompose(const Eigen::MatrixXd& gram) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
  const Eigen::VectorXd values = solver.eigenvalues().reverse();
  // Smaller values of the Gram matrix are rounding noise.
  const double smallest = 1e-13 * std::max(values(0), 0.0);
  const auto rank = (values.array() > smallest).count();
  return {values.head(rank).cwiseSqrt(), solver.eigenvectors().rowwise().reverse().leftCols(rank)};
}

// The norm of a frame's residual is an upper bound of its worst vertex, and divided by the root of
// the number of vertices a lower bound. Returns the smallest K for which `bound` times the residual
// of every sampled frame is within the tolerance.
Eigen::Index SizeByResidual(const Eigen::VectorXd& singular_values, const Eigen::MatrixXd& frames,
                            double bound, double tolerance_m) {
  Eigen::ArrayXd residual = Eigen::ArrayXd::Zero(frames.rows());
  Eigen::Index size = singular_values.size();
  for (; size > 0; --size) {
    residual += (singular_values(size - 1) * frames.col(size - 1)).array().square();
    if (bound * std::sqrt(residual.maxCoeff()) > tolerance_m) break;
  }
  return size;
}

// Squared error of the worst vertex over all frames, for each number of directions from `least` up.
std::vector<float> WorstSquares(const Displacements& moved, const RowMatrix& features,
                                const RowMatrixF& directions, const RowMatrixF& coefficients,
                                Eigen::Index least, int threads) {
  const Eigen::Index most = directions.cols();
  const auto num_sizes = static_cast<std::size_t>(most - least + 1);
  std::vector<std::vector<float>> worst(moved.NumChunks(), std::vector<float>(num_sizes, 0.0f));
  ParallelFor(moved.NumChunks(), threads, [&](int chunk) {
    RowMatrixF residual;
    for (Eigen::Index t = 0; t < features.cols(); t += kFramesPerBlock) {
      const Eigen::Index n = std::min<Eigen::Index>(kFramesPerBlock, features.cols() - t);
      const RowMatrix exact = moved.OfChunk(chunk, features.middleCols(t, n));
      const auto along = directions.middleRows(3 * moved.ChunkBegin(chunk), exact.rows());
      const auto weights = coefficients.middleCols(t, n);
      residual = exact.cast<float>();
      residual.noalias() -= along.leftCols(least) * weights.topRows(least);
      for (Eigen::Index row = 0; row < exact.rows(); row += 3) {
        auto of_vertex = residual.middleRows<3>(row);
        for (Eigen::Index size = least;; ++size) {
          float& largest = worst[chunk][static_cast<std::size_t>(size - least)];
          const auto squares = of_vertex.row(0).array().square() +
                               of_vertex.row(1).array().square() +
                               of_vertex.row(2).array().square();
          largest = std::max(largest, squares.maxCoeff());
          if (size == most) break;
          for (int c = 0; c < 3; ++c) of_vertex.row(c) -= along(row + c, size) * weights.row(size);
        }
      }
    }
  });
  for (std::size_t chunk = 1; chunk < worst.size(); ++chunk) {
    for (std::size_t k = 0; k < num_sizes; ++k) {
      worst[0][k] = std::max(worst[0][k], worst[chunk][k]);
    }
  }
  return worst[0];
}

}  // namespace

CorrectiveBasis ComputeCorrectiveBasis(const BodySurface& surface, const Clip& clip,
                                       double tolerance_m, int max_directions, int threads) {
  const int num_frames = clip.NumFrames();
  CorrectiveBasis basis;
  basis.rest = surface.RestVertices();
  basis.directions.resize(basis.rest.size(), 0);
  basis.coefficients.resize(0, num_frames);
  const Displacements moved(surface);
  if (num_frames == 0 || moved.NumMoved() == 0) return basis;

  std::vector<int> all(num_frames);
  std::iota(all.begin(), all.end(), 0);
  std::vector<int> sampled = all;
  if (num_frames > kMaxSampledFrames) {
    sampled.resize(kMaxSampledFrames);
    for (int k = 0; k < kMaxSampledFrames; ++k) {
      sampled[k] = static_cast<int>(std::int64_t{k} * (num_frames - 1) / (kMaxSampledFrames - 1));
    }
  }
  const RowMatrix features = PoseFeatures(clip, all);
  const RowMatrix sampled_features =
      sampled.size() == all.size() ? features : PoseFeatures(clip, sampled);
  const auto num_sampled = static_cast<Eigen::Index>(sampled.size());

  Eigen::MatrixXd gram = SumOverChunks(
      moved.NumChunks(), num_sampled, num_sampled, threads, [&](int chunk, Eigen::MatrixXd& sum) {
        const RowMatrix d = moved.OfChunk(chunk, sampled_features);
        sum.selfadjointView<Eigen::Lower>().rankUpdate(d.transpose());
      });
  gram = Eigen::MatrixXd(gram.selfadjointView<Eigen::Lower>());
  const auto [singular_values, frames] = Decompose(gram);

  Eigen::Index most = std::min<Eigen::Index>(std::max(max_directions, 0), singular_values.size());
  // Frames that were not sampled may need further directions.
  if (sampled.size() == all.size()) {
    most = std::min(most, SizeByResidual(singular_values, frames, 1.0, tolerance_m));
  }
  const Eigen::Index least =
      std::min(most, SizeByResidual(singular_values, frames,
                                    1.0 / std::sqrt(3.0 * moved.NumMoved()), tolerance_m));

  // Orthonormal directions of the moved vertices, then their coefficients in every frame.
  const Eigen::MatrixXd combine =
      frames.leftCols(most) * singular_values.head(most).cwiseInverse().asDiagonal();
  RowMatrix unit(3 * moved.NumMoved(), most);
  ParallelFor(moved.NumChunks(), threads, [&](int chunk) {
    const RowMatrix d = moved.OfChunk(chunk, sampled_features);
    unit.middleRows(3 * moved.ChunkBegin(chunk), d.rows()).noalias() = d * combine;
  });
  Eigen::MatrixXd parts = SumOverChunks(
      moved.NumChunks(), most, num_frames, threads, [&](int chunk, Eigen::MatrixXd& sum) {
        for (Eigen::Index t = 0; t < num_frames; t += kFramesPerBlock) {
          const Eigen::Index n = std::min<Eigen::Index>(kFramesPerBlock, num_frames - t);
          const RowMatrix d = moved.OfChunk(chunk, features.middleCols(t, n));
          sum.middleCols(t, n).noalias() +=
              unit.middleRows(3 * moved.ChunkBegin(chunk), d.rows()).transpose() * d;
        }
      });
  for (Eigen::Index k = 0; k < most; ++k) {
    const double scale = parts.row(k).cwiseAbs().maxCoeff();
    parts.row(k) /= scale;
    unit.col(k) *= scale;
  }

  const RowMatrixF directions = unit.cast<float>();
  const RowMatrixF coefficients = parts.cast<float>();
  const std::vector<float> worst =
      WorstSquares(moved, features, directions, coefficients, least, threads);
  const auto is_enough = [&](float square) { return std::sqrt(square) <= tolerance_m; };
  auto chosen = std::find_if(worst.begin(), worst.end(), is_enough);
  if (chosen == worst.end()) --chosen;
  const Eigen::Index size = least + (chosen - worst.begin());
  basis.max_error_m = std::sqrt(*chosen);
  basis.coefficients = coefficients.topRows(size);
  basis.directions.setZero(basis.rest.size(), size);
  for (int row = 0; row < moved.NumMoved(); ++row) {
    basis.directions.middleRows<3>(3 * moved.Moved()[row]) = directions.block(3 * row, 0, 3, size);
  }
  return basis;
}

CorrectiveBasis WithUnitWeights(const CorrectiveBasis& basis) {
  CorrectiveBasis unit = basis;
  Eigen::Index size = 0;
  for (Eigen::Index k = 0; k < basis.Size(); ++k) {
    const float least = basis.coefficients.row(k).minCoeff();
    const float range = basis.coefficients.row(k).maxCoeff() - least;
    unit.rest.reshaped() += static_cast<double>(least) * basis.directions.col(k).cast<double>();
    if (range == 0.0f) continue;
    unit.directions.col(size) = range * basis.directions.col(k);
    unit.coefficients.row(size) =
        ((basis.coefficients.row(k).array() - least) / range).cwiseMin(1.0f);
    ++size;
  }
  unit.directions.conservativeResize(Eigen::NoChange, size);
  unit.coefficients.conservativeResize(size, Eigen::NoChange);
  return unit;
}

}  // namespace holdfast
