// SPDX-License-Identifier: MIT
#include "geometry/mesh/distance_grid.h"

#include <algorithm>
#include <array>
#include <cmath>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "geometry/error.h"

namespace holdfast {
namespace {

/// Catmull-Rom weights of four nodes at t in [0, 1] between the middle two.
Eigen::Vector4d Weights(double t) {
  const double t2 = t * t;
  const double t3 = t2 * t;
  return {-0.5 * t + t2 - 0.5 * t3, 1.0 - 2.5 * t2 + 1.5 * t3, 0.5 * t + 2.0 * t2 - 1.5 * t3,
          -0.5 * t2 + 0.5 * t3};
}

Eigen::Vector4d WeightDerivatives(double t) {
  const double t2 = t * t;
  return {-0.5 + 2.0 * t - 1.5 * t2, -5.0 * t + 4.5 * t2, 0.5 + 4.0 * t - 4.5 * t2, -t + 1.5 * t2};
}

#if defined(__x86_64__)
// Interpolate() with four-wide registers: the same sums in the same order, so bitwise identical.
#define HOLDFAST_AVX [[gnu::target("avx2")]]

// Row sums of the four products with `weight`, in Eigen's order: (0 + 2) + (1 + 3).
HOLDFAST_AVX inline __m256d Dots(const __m256d& weight, const __m256d (&row)[4]) {
  const __m256d a = weight * row[0], b = weight * row[1], c = weight * row[2], d = weight * row[3];
  const __m256d ac = _mm256_permute2f128_pd(a, c, 0x20) + _mm256_permute2f128_pd(a, c, 0x31);
  const __m256d bd = _mm256_permute2f128_pd(b, d, 0x20) + _mm256_permute2f128_pd(b, d, 0x31);
  return _mm256_hadd_pd(ac, bd);
}

HOLDFAST_AVX inline double Sum(const __m256d& p) { return 0.0 + p[0] + p[1] + p[2] + p[3]; }

HOLDFAST_AVX inline void Transpose(__m256d (&m)[4]) {
  const __m256d a = _mm256_unpacklo_pd(m[0], m[1]), b = _mm256_unpackhi_pd(m[0], m[1]);
  const __m256d c = _mm256_unpacklo_pd(m[2], m[3]), d = _mm256_unpackhi_pd(m[2], m[3]);
  m[0] = _mm256_permute2f128_pd(a, c, 0x20);
  m[1] = _mm256_permute2f128_pd(b, d, 0x20);
  m[2] = _mm256_permute2f128_pd(a, c, 0x31);
  m[3] = _mm256_permute2f128_pd(b, d, 0x31);
}

// `point` is in cells; the gradient is per cell.
template <bool kGradient>
HOLDFAST_AVX double InterpolateAvx(const double* values, std::ptrdiff_t stride_y,
                                   std::ptrdiff_t stride_z, const Eigen::Vector3i& cells,
                                   const Eigen::Vector3d& point, double* gradient) {
  const __m256d local = _mm256_setr_pd(point[0], point[1], point[2], 0.0);
  const __m128i most =
      _mm_sub_epi32(_mm_setr_epi32(cells[0], cells[1], cells[2], 1), _mm_set1_epi32(1));
  const __m128i cell =
      _mm_min_epi32(_mm_max_epi32(_mm256_cvttpd_epi32(local), _mm_setzero_si128()), most);
  const __m256d t = local - _mm256_cvtepi32_pd(cell), t2 = t * t, t3 = t2 * t;
  __m256d w[4] = {-0.5 * t + t2 - 0.5 * t3, 1.0 - 2.5 * t2 + 1.5 * t3,
                  0.5 * t + 2.0 * t2 - 1.5 * t3, -0.5 * t2 + 0.5 * t3};
  Transpose(w);  // one register per axis
  __m256d s[4];
  if constexpr (kGradient) {
    s[0] = -0.5 + 2.0 * t - 1.5 * t2;
    s[1] = -5.0 * t + 4.5 * t2;
    s[2] = 0.5 + 4.0 * t - 4.5 * t2;
    s[3] = -t + 1.5 * t2;
    Transpose(s);
  }
  const double* corner = values + _mm_extract_epi32(cell, 2) * stride_z +
                         _mm_extract_epi32(cell, 1) * stride_y + _mm_extract_epi32(cell, 0);
  // One lane for each of the four planes along z.
  __m256d plane = _mm256_setzero_pd(), plane_dx = plane, plane_dy = plane;
  for (int j = 0; j < 4; ++j) {
    const double* row = corner + j * stride_y;
    const __m256d rows[4] = {_mm256_loadu_pd(row), _mm256_loadu_pd(row + stride_z),
                             _mm256_loadu_pd(row + 2 * stride_z),
                             _mm256_loadu_pd(row + 3 * stride_z)};
    const __m256d weight = _mm256_set1_pd(w[1][j]);
    const __m256d along_x = Dots(w[0], rows);
    plane += weight * along_x;
    if constexpr (kGradient) {
      plane_dx += weight * Dots(s[0], rows);
      plane_dy += _mm256_set1_pd(s[1][j]) * along_x;
    }
  }
  if constexpr (kGradient) {
    gradient[0] = Sum(w[2] * plane_dx);
    gradient[1] = Sum(w[2] * plane_dy);
    gradient[2] = Sum(s[2] * plane);
  }
  return Sum(w[2] * plane);
}

#undef HOLDFAST_AVX
#endif

}  // namespace

DistanceGrid::DistanceGrid(const SignedDistance& surface, const DistanceGridOptions& options) {
  if (!(options.cell_m > 0.0) || !(options.padding_m > 0.0) || options.max_nodes < 64) {
    throw Error("distance grid", "the cell and the padding must be positive, and nodes 64 or more",
                "Use the defaults: 2 mm cells, 20 mm padding");
  }
  const Eigen::Vector3d low = surface.Min().array() - options.padding_m;
  const Eigen::Vector3d high = surface.Max().array() + options.padding_m;
  cell_ = options.cell_m;
  const auto num_nodes = [&] {
    return (((high - low) / cell_).array().ceil().max(1.0) + 3.0).prod();
  };
  while (num_nodes() > static_cast<double>(options.max_nodes)) cell_ *= 1.05;
  inverse_cell_ = 1.0 / cell_;
  cells_ = ((high - low) / cell_).array().ceil().max(1.0).cast<int>();
  avx_ = options.isa >= Isa::kAvx2;
  min_ = low;
  max_ = low + cell_ * cells_.cast<double>();

  const Eigen::Vector3i nodes = cells_.array() + 3;
  stride_y_ = nodes.x();
  stride_z_ = stride_y_ * nodes.y();
  values_.resize(static_cast<std::size_t>(stride_z_) * nodes.z());
  Sample(surface, options);
}

// Samples every second node first. Of the nodes between, those near the surface are sampled; the
// others are interpolated along x, then y, then z, when both neighbors along that axis are known.
void DistanceGrid::Sample(const SignedDistance& surface, const DistanceGridOptions& options) {
  const Eigen::Vector3i nodes = cells_.array() + 3;
  const double near = std::max(options.exact_within_m, 5.0 * cell_);
  const std::array<std::ptrdiff_t, 3> stride = {1, stride_y_, stride_z_};
  std::vector<std::ptrdiff_t> exact;
  Eigen::Matrix3Xd points(3, 0);
  for (int axis = -1; axis < 3; ++axis) {
    exact.clear();
    // Nodes between samples: step 1 along finished axes, 2 along others; odd indices along `axis`.
    const Eigen::Vector3i step(axis < 1 ? 2 : 1, axis < 2 ? 2 : 1, 2);
    for (int k = axis == 2 ? 1 : 0; k < nodes.z(); k += step.z()) {
      for (int j = axis == 1 ? 1 : 0; j < nodes.y(); j += step.y()) {
        // Back and forth along x: each node is next to the previous one, whose face is the hint.
        const int first = axis == 0 ? 1 : 0;
        const int count = (nodes.x() - first + step.x() - 1) / step.x();
        for (int n = 0; n < count; ++n) {
          const int i = first + step.x() * (j / step.y() % 2 == 0 ? n : count - 1 - n);
          const std::ptrdiff_t at = i + j * stride_y_ + k * stride_z_;
          if (axis >= 0 && InterpolateNode(at, stride[axis], Eigen::Vector3i(i, j, k)[axis],
                                           nodes[axis], near)) {
            continue;
          }
          exact.push_back(at);
        }
      }
    }
    points.resize(3, static_cast<Eigen::Index>(exact.size()));
    for (std::size_t n = 0; n < exact.size(); ++n) {
      const std::ptrdiff_t k = exact[n] / stride_z_, j = exact[n] % stride_z_ / stride_y_;
      const Eigen::Vector3d index(static_cast<double>(exact[n] % stride_y_), static_cast<double>(j),
                                  static_cast<double>(k));
      points.col(static_cast<Eigen::Index>(n)) = min_ + cell_ * (index.array() - 1.0).matrix();
    }
    const Eigen::VectorXd distances = surface.Distances(points, options.threads);
    for (std::size_t n = 0; n < exact.size(); ++n) {
      values_[exact[n]] = distances(static_cast<Eigen::Index>(n));
    }
  }
}

// Interpolates a node from its neighbors along one axis. Returns false unless all are farther than
// `near`, and for the last node, which has only one neighbor.
bool DistanceGrid::InterpolateNode(std::ptrdiff_t at, std::ptrdiff_t stride, int index, int nodes,
                                   double near) {
  if (index + 1 >= nodes) return false;
  const double before = values_[at - stride], after = values_[at + stride];
  if (std::min(std::abs(before), std::abs(after)) < near + cell_ || before * after < 0.0) {
    return false;
  }
  values_[at] =
      index < 3 || index + 3 >= nodes
          ? 0.5 * (before + after)
          : 0.0625 * (9.0 * (before + after) - values_[at - 3 * stride] - values_[at + 3 * stride]);
  return true;
}

double DistanceGrid::Interpolate(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const {
  const Eigen::Vector3d local = (point - min_) * inverse_cell_;
#if defined(__x86_64__)
  if (avx_) {
    if (gradient == nullptr) {
      return InterpolateAvx<false>(values_.data(), stride_y_, stride_z_, cells_, local, nullptr);
    }
    const double value =
        InterpolateAvx<true>(values_.data(), stride_y_, stride_z_, cells_, local, gradient->data());
    *gradient *= inverse_cell_;
    return value;
  }
#endif
  int cell[3];
  Eigen::Vector4d weight[3];
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = std::clamp(static_cast<int>(local[axis]), 0, cells_[axis] - 1);
    weight[axis] = Weights(local[axis] - cell[axis]);
  }
  const double* corner = values_.data() + cell[2] * stride_z_ + cell[1] * stride_y_ + cell[0];
  if (gradient == nullptr) {
    double value = 0.0;
    for (int k = 0; k < 4; ++k) {
      double plane = 0.0;
      for (int j = 0; j < 4; ++j) {
        const Eigen::Map<const Eigen::Vector4d> row(corner + k * stride_z_ + j * stride_y_);
        plane += weight[1][j] * weight[0].dot(row);
      }
      value += weight[2][k] * plane;
    }
    return value;
  }
  Eigen::Vector4d slope[3];
  for (int axis = 0; axis < 3; ++axis) slope[axis] = WeightDerivatives(local[axis] - cell[axis]);
  double value = 0.0;
  gradient->setZero();
  for (int k = 0; k < 4; ++k) {
    double plane = 0.0;
    double plane_dx = 0.0;
    double plane_dy = 0.0;
    for (int j = 0; j < 4; ++j) {
      const Eigen::Map<const Eigen::Vector4d> row(corner + k * stride_z_ + j * stride_y_);
      const double along_x = weight[0].dot(row);
      plane += weight[1][j] * along_x;
      plane_dx += weight[1][j] * slope[0].dot(row);
      plane_dy += slope[1][j] * along_x;
    }
    value += weight[2][k] * plane;
    (*gradient)[0] += weight[2][k] * plane_dx;
    (*gradient)[1] += weight[2][k] * plane_dy;
    (*gradient)[2] += slope[2][k] * plane;
  }
  *gradient *= inverse_cell_;
  return value;
}

double DistanceGrid::Distance(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const {
  const Eigen::Vector3d nearest = point.cwiseMax(min_).cwiseMin(max_);
  const double at_box = Interpolate(nearest, gradient);
  return nearest == point ? at_box : Outside(point - nearest, at_box, gradient);
}

double DistanceGrid::Outside(const Eigen::Vector3d& outside, double at_box,
                             Eigen::Vector3d* gradient) {
  const double distance = std::sqrt(at_box * at_box + outside.squaredNorm());
  if (gradient != nullptr) {
    // The nearest point of the box moves only along axes on which it was not clamped.
    for (int axis = 0; axis < 3; ++axis) {
      (*gradient)[axis] =
          (outside[axis] != 0.0 ? outside[axis] : at_box * (*gradient)[axis]) / distance;
    }
  }
  return distance;
}

}  // namespace holdfast
