// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_handle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>

#include <Eigen/Eigenvalues>

#include "geometry/parallel.h"

namespace holdfast {
namespace {

constexpr double kFingerRadius = 0.0075;  // of the thinnest finger considered, meters
constexpr double kMaxOpening = 0.12;      // across; wider openings are not handles
constexpr double kMaxBar = 0.035;         // thickness of a bar, in any direction across it
constexpr double kGridStep = 0.004;       // of the grid searched for openings
constexpr std::size_t kMaxHandles = 5;
constexpr double kShortest = 0.0003;     // minimum step along a ray, meters
constexpr double kFingerPasses = 0.030;  // distance a finger needs its full width on either side
constexpr double kOutOfSight = 0.150;    // its path must stay free this far: no bowl's floor
constexpr double kBesideBar = 0.012;     // free space all around a bar: a finger
// Slots narrower than twice this count as part of the bar: molded handles are hollow at the back.
// This also keeps rays along a thin wall from slipping out of it.
constexpr double kSlot = 0.0035;
constexpr int kWaysThrough = 49;  // tested directions through an opening, over half a sphere
constexpr int kEnclosingRays = 12;
constexpr int kBarRays = 24;

// In a distance grid, walls thinner than a cell appear as near points, not as inside.
constexpr double kThinWall = 0.0006;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Whether a ray from within the grid has left it, so that the object cannot be met any more.
bool HasLeft(const DistanceGrid& object, const Eigen::Vector3d& point) {
  return (point.array() < object.Min().array()).any() ||
         (point.array() > object.Max().array()).any();
}

// Where a ray from a point outside the object and within the grid enters the object, or infinity.
// The ray is known to be free up to `begin`.
double Entry(const DistanceGrid& object, const Eigen::Vector3d& from, const Eigen::Vector3d& way,
             double farthest, double begin = 0.0) {
  for (double s = begin; s < farthest;) {
    const Eigen::Vector3d point = from + s * way;
    if (s > 0.0 && HasLeft(object, point)) return kInfinity;
    const double d = object.Linear(point);
    if (d <= kThinWall) return s;
    s += std::max(d, kShortest);
  }
  return kInfinity;
}

// Where a ray from inside leaves the object, slots counted as inside, or infinity.
double Exit(const DistanceGrid& object, const Eigen::Vector3d& from, const Eigen::Vector3d& way,
            double farthest) {
  for (double s = 0.0; s < farthest + kSlot;) {
    const double d = object.Linear(from + s * way);
    if (d > kSlot) return std::max(0.0, s - kSlot);
    s += std::max(kSlot - d, kShortest);
  }
  return kInfinity;
}

// `clearance`: of the point, which is in the grid; greater than the radius.
bool FingerPasses(const DistanceGrid& object, const Eigen::Vector3d& point, double clearance,
                  const Eigen::Vector3d& way) {
  constexpr double kRadius = kFingerRadius - 0.001;
  for (const double sign : {1.0, -1.0}) {
    for (double s = std::max(clearance - kRadius, 0.001); s < kOutOfSight;) {
      const double least = s < kFingerPasses ? kRadius : 0.3 * kRadius;
      const Eigen::Vector3d at = point + sign * s * way;
      if (HasLeft(object, at)) break;
      const double d = object.Linear(at);
      if (d < least) return false;
      s += std::max(d - least, 0.001);
    }
  }
  return true;
}

// Mean distance to the surrounding object orthogonal to `way`; infinity if a ray escapes or the
// mean is not below `most`.
double Enclosure(const DistanceGrid& object, const Eigen::Vector3d& point, double clearance,
                 const Eigen::Vector3d& way, double most) {
  const Eigen::Vector3d x = way.unitOrthogonal(), y = way.cross(x);
  double sum = 0.0;
  for (int i = 0; i < kEnclosingRays; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kEnclosingRays;
    const double s = Entry(object, point, std::cos(angle) * x + std::sin(angle) * y,
                           0.8 * kMaxOpening, clearance);
    if (s == kInfinity) return kInfinity;
    sum += s / kEnclosingRays;
    if (sum >= most) return kInfinity;
  }
  return sum;
}

// Even directions over half a sphere (golden spiral).
std::array<Eigen::Vector3d, kWaysThrough> HalfSphere() {
  std::array<Eigen::Vector3d, kWaysThrough> directions;
  for (int i = 0; i < kWaysThrough; ++i) {
    const double z = (i + 0.5) / kWaysThrough;
    const double angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    directions[i] = {r * std::cos(angle), r * std::sin(angle), z};
  }
  return directions;
}

// Direction of largest extent of the material around a point.
std::optional<Eigen::Vector3d> BarDirection(const DistanceGrid& object, const Eigen::Vector3d& bar,
                                            double radius) {
  constexpr int kSteps = 6;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  int count = 0;
  for (int x = -kSteps; x <= kSteps; ++x) {
    for (int y = -kSteps; y <= kSteps; ++y) {
      for (int z = -kSteps; z <= kSteps; ++z) {
        const Eigen::Vector3d p = radius / kSteps * Eigen::Vector3d(x, y, z);
        if (p.squaredNorm() > radius * radius) continue;
        // This far from the material, the next steps cannot be inside either.
        const double away = object.Linear(bar + p) - 0.5 * kSlot;
        if (away > 0.0) {
          z += static_cast<int>(0.9 * away * kSteps / radius);
          continue;
        }
        covariance += p * p.transpose();
        mean += p;
        ++count;
      }
    }
  }
  if (count < 8) return std::nullopt;
  mean /= count;
  covariance = covariance / count - mean * mean.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance);
  if (eigen.eigenvalues()(2) < 1.3 * eigen.eigenvalues()(1)) return std::nullopt;
  return eigen.eigenvectors().col(2);
}

// Whether the cross-section around `bar` is small, with room for a finger on every side.
bool IsBar(const DistanceGrid& object, const Eigen::Vector3d& bar, const Eigen::Vector3d& across_1,
           const Eigen::Vector3d& across_2) {
  for (int i = 0; i < 16; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 16;
    const Eigen::Vector3d way = std::cos(angle) * across_1 + std::sin(angle) * across_2;
    const double out = Exit(object, bar, way, 0.6 * kMaxBar);
    if (out == kInfinity) return false;
    const Eigen::Vector3d outside = bar + (out + kSlot) * way;
    if (Entry(object, outside, way, kBesideBar - kSlot) != kInfinity) return false;
    if (object.Linear(bar + (out + 0.008) * way) < kSlot) return false;
  }
  return true;
}

std::optional<Handle> HandleAt(const DistanceGrid& object, const Eigen::Vector3d& opening,
                               const Eigen::Vector3d& way, const Eigen::Vector3d& outward) {
  const double entry = Entry(object, opening, outward, kMaxOpening);
  if (entry == kInfinity) return std::nullopt;
  const Eigen::Vector3d inside = opening + (entry + kShortest) * outward;
  const double thick = Exit(object, inside, outward, kMaxBar);
  if (thick == kInfinity) return std::nullopt;
  Handle handle;
  handle.bar = inside + 0.5 * thick * outward;
  if (!IsBar(object, handle.bar, outward, way)) return std::nullopt;
  const std::optional<Eigen::Vector3d> along = BarDirection(object, handle.bar, 0.018);
  if (!along || std::abs(along->dot(way)) > 0.6 || std::abs(along->dot(outward)) > 0.6) {
    return std::nullopt;
  }
  handle.along = along->z() < 0.0 ? Eigen::Vector3d(-*along) : *along;
  handle.through = (way - way.dot(handle.along) * handle.along).normalized();
  handle.inward = handle.along.cross(handle.through);
  if (handle.inward.dot(outward) > 0.0) handle.inward = -handle.inward;
  if (!IsBar(object, handle.bar, handle.inward, handle.through)) return std::nullopt;

  const double one_side = Exit(object, handle.bar, handle.through, kMaxBar);
  const double other_side = Exit(object, handle.bar, -handle.through, kMaxBar);
  if (one_side == kInfinity || other_side == kInfinity) return std::nullopt;
  handle.bar += 0.5 * (one_side - other_side) * handle.through;
  handle.width = one_side + other_side;
  const double half = Exit(object, handle.bar, handle.inward, kMaxBar);
  const double other_half = Exit(object, handle.bar, -handle.inward, kMaxBar);
  if (half == kInfinity || other_half == kInfinity) return std::nullopt;
  handle.bar += 0.5 * (half - other_half) * handle.inward;
  handle.thickness = half + other_half;
  const Eigen::Vector3d face = handle.bar + (0.5 * handle.thickness + kSlot) * handle.inward;
  handle.room = kSlot + Entry(object, face, handle.inward, kMaxOpening);
  if (handle.room < 2.0 * kFingerRadius || handle.room == kInfinity) return std::nullopt;

  // Bars are curved: a finger may lie slightly farther in, but not at the far side.
  const double deepest = 0.5 * handle.thickness + std::min(handle.room, 0.028);
  const auto finger_fits = [&](double s) {
    for (double in = 0.5 * handle.thickness + kFingerRadius; in < deepest; in += 0.003) {
      if (object.Linear(handle.bar + s * handle.along + in * handle.inward) > kFingerRadius) {
        return true;
      }
    }
    return false;
  };
  const auto reach = [&](double sign) {
    double s = 0.0;
    while (s < kMaxOpening && finger_fits(sign * s)) s += 0.002;
    return sign * std::max(0.0, s - 0.002);
  };
  handle.low = reach(-1.0);
  handle.high = reach(1.0);
  return finger_fits(0.0) ? std::optional(handle) : std::nullopt;
}

// Long bars with room behind them come first; a little room is enough.
double Rank(const Handle& handle) {
  return std::min(handle.Length(), 0.08) + 0.5 * std::min(handle.room, 0.03) -
         0.3 * std::abs(handle.high + handle.low);
}

}  // namespace

std::vector<Handle> FindHandles(const DistanceGrid& object, int threads) {
  const std::array<Eigen::Vector3d, kWaysThrough> directions = HalfSphere();
  const Eigen::Vector3i nodes =
      ((object.Max() - object.Min()) / kGridStep).array().ceil().cast<int>();
  std::vector<std::vector<Handle>> by_slice(nodes.z() + 1);
  ParallelFor(nodes.z() + 1, threads, [&](int k) {
    for (int j = 0; j <= nodes.y(); ++j) {
      for (int i = 0; i <= nodes.x(); ++i) {
        const Eigen::Vector3d point = object.Min() + kGridStep * Eigen::Vector3d(i, j, k);
        if (HasLeft(object, point)) continue;  // the last step may be outside
        const double clearance = object.Linear(point);
        if (clearance < kFingerRadius || clearance > 0.5 * kMaxOpening) continue;
        // Halfway between walls the distance has no slope. Only those points are tested, else every
        // point of a wide opening would be.
        Eigen::Vector3d slope;
        for (int axis = 0; axis < 3; ++axis) {
          const Eigen::Vector3d step = kGridStep * Eigen::Vector3d::Unit(axis);
          slope(axis) =
              (object.Linear(point + step) - object.Linear(point - step)) / (2.0 * kGridStep);
        }
        if (slope.norm() > 0.75) continue;
        double tightest = kInfinity;
        Eigen::Vector3d way = Eigen::Vector3d::Zero();
        for (const Eigen::Vector3d& direction : directions) {
          if (!FingerPasses(object, point, clearance, direction)) {
            continue;
          }
          const double enclosure = Enclosure(object, point, clearance, direction, tightest);
          if (enclosure < tightest) {
            tightest = enclosure;
            way = direction;
          }
        }
        if (tightest == kInfinity) continue;
        const Eigen::Vector3d x = way.unitOrthogonal(), y = way.cross(x);
        for (int ray = 0; ray < kBarRays; ++ray) {
          const double angle = 2.0 * std::numbers::pi * ray / kBarRays;
          const std::optional<Handle> handle =
              HandleAt(object, point, way, std::cos(angle) * x + std::sin(angle) * y);
          if (handle) by_slice[k].push_back(*handle);
        }
      }
    }
  });

  std::vector<Handle> found;
  for (const std::vector<Handle>& slice : by_slice) {
    found.insert(found.end(), slice.begin(), slice.end());
  }
  std::ranges::stable_sort(found, std::greater(), Rank);
  std::vector<Handle> kept;
  for (const Handle& handle : found) {
    if (kept.size() == kMaxHandles) break;
    const bool is_new = std::ranges::none_of(
        kept, [&](const Handle& other) { return (handle.bar - other.bar).norm() < 0.012; });
    if (is_new) kept.push_back(handle);
  }
  return kept;
}

bool PassesThrough(const Handle& handle, const Eigen::Matrix3Xd& chain) {
  // The fingertip must pass the plane of the opening, not only enter it.
  constexpr double kPast = 0.003;
  for (Eigen::Index i = 0; i + 1 < chain.cols(); ++i) {
    const Eigen::Vector3d a = chain.col(i) - handle.bar, b = chain.col(i + 1) - handle.bar;
    const double from = a.dot(handle.through), to = b.dot(handle.through);
    if (from * to >= 0.0) continue;
    const Eigen::Vector3d crossing = a + from / (from - to) * (b - a);
    const double in = crossing.dot(handle.inward), along = crossing.dot(handle.along);
    if (in < 0.5 * handle.thickness || in > 0.5 * handle.thickness + handle.room) continue;
    if (along < handle.low - 0.004 || along > handle.high + 0.004) continue;
    if (i + 2 < chain.cols() || std::abs(to) > kPast) return true;
  }
  return false;
}

}  // namespace holdfast
