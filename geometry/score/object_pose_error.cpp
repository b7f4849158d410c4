// SPDX-License-Identifier: MIT
#include "geometry/score/object_pose_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/mesh/triangle_tree.h"
#include "geometry/rotation.h"

namespace holdfast {

ObjectPoseComparer::ObjectPoseComparer(const TriangleMesh& mesh, ObjectSymmetry symmetry)
    : vertices_(mesh.vertices),
      symmetry_(std::move(symmetry)),
      nearest_(mesh.vertices),
      diameter_m_(Diameter(mesh.vertices)) {}

ObjectPoseError ObjectPoseComparer::Compare(
    const Eigen::Isometry3d& world_from_object,
    const Eigen::Isometry3d& reference_world_from_object) const {
  ObjectPoseError error;
  const Eigen::Isometry3d& a = world_from_object;
  const Eigen::Isometry3d& b = reference_world_from_object;
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  error.translation_mm = 1e3 * (a * symmetry_.center - b * symmetry_.center).norm();
  error.rotation_deg = kDegrees * AngleBetween(a.linear(), b.linear());
  error.rotation_modulo_deg = kDegrees * AngleModulo(a.linear(), b.linear(), symmetry_);
  // Distances in the reference's object frame, so that the tree of its vertices can be reused.
  const Eigen::Isometry3d reference_from_object = b.inverse() * a;
  const Eigen::Matrix3Xd moved =
      (reference_from_object.linear() * vertices_).colwise() + reference_from_object.translation();
  error.add_mm = 1e3 * (moved - vertices_).colwise().norm().mean();
  for (const auto& point : moved.colwise()) error.add_s_mm += nearest_.Nearest(point).distance;
  error.add_s_mm *= 1e3 / static_cast<double>(vertices_.cols());
  return error;
}

namespace {

constexpr double kPi = std::numbers::pi;
// A rotation is a symmetry if no surface sample leaves the surface by more than this fraction of
// the diameter: small enough to detect a mug's handle, large enough to ignore the thread of a bulb
// and the dents of a can.
constexpr double kTolerance = 0.015;
constexpr int kSurfaceSamples = 1500;
// Moments of inertia this close, relative to the largest, may belong to a symmetric object.
constexpr double kEqualMoments = 0.12;
constexpr Eigen::Index kCoarseSamples = 48;
constexpr Eigen::Index kFineSamples = 120;
constexpr std::array<int, 5> kFolds = {2, 3, 4, 5, 6};
constexpr std::size_t kLargestGroup = 60;  // icosahedral group
constexpr double kSameRotation = 6.0 * kPi / 180.0;
constexpr double kSameAxis = 10.0 * kPi / 180.0;
constexpr std::size_t kTries = 14;         // refinements per fold
constexpr double kGoldenAngle = 2.399963;  // its multiples are not fractions of a turn

Eigen::Matrix3d Turn(const Eigen::Vector3d& axis, double angle) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

// Axis of a symmetry, by 1 / fold of a turn.
using Found = std::pair<Eigen::Vector3d, int>;

class SymmetrySearch {
 public:
  explicit SymmetrySearch(const TriangleMesh& mesh) : tree_(mesh), moments_(MeasureMoments(mesh)) {
    tolerance_ = kTolerance * Diameter(mesh.vertices);
    const Eigen::Matrix3Xd points = SampleSurface(mesh, kSurfaceSamples);
    // Ordered such that any prefix is an evenly spread sample: most candidates fail on few points.
    samples_.resize(3, points.cols());
    const Eigen::Index n = points.cols();
    Eigen::Index step = static_cast<Eigen::Index>(0.618 * static_cast<double>(n)) | 1;
    while (std::gcd(step, n) != 1) step += 2;
    for (Eigen::Index i = 0, from = 0; i < n; ++i, from = (from + step) % n) {
      samples_.col(i) = points.col(from) - moments_.center;
    }
  }

  ObjectSymmetry Find() {
    ObjectSymmetry result;
    result.center = moments_.center;
    if (IsSphere(result)) return result;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments_.covariance);
    const Eigen::Vector3d moment = solver.eigenvalues();  // ascending
    const auto inertia_axis = [&](int k) -> Eigen::Vector3d {
      return solver.eigenvectors().col(k);
    };
    const bool low_pair = moment[1] - moment[0] < kEqualMoments * moment[2];
    const bool high_pair = moment[2] - moment[1] < kEqualMoments * moment[2];
    // Distinct moments allow half turns about their axes. Two equal ones allow any turn about the
    // third axis and half turns across it; three equal ones allow any rotation.
    std::vector<Found> found;
    if (low_pair && high_pair) {
      const std::vector<Eigen::Vector3d> directions = HalfSphere(500);
      for (const int fold : kFolds) Search(directions, fold, found);
    } else if (low_pair || high_pair) {
      const Eigen::Vector3d single = inertia_axis(low_pair ? 2 : 0);
      for (const int fold : kFolds) Search({single}, fold, found);
      std::vector<Eigen::Vector3d> across;
      for (int degrees = 0; degrees < 180; degrees += 3) {
        across.emplace_back(Turn(single, degrees * kPi / 180.0) * single.unitOrthogonal());
      }
      Search(across, 2, found);
    } else {
      Search({inertia_axis(0), inertia_axis(1), inertia_axis(2)}, 2, found);
    }
    if (!FindRoundAxis(found, result)) CloseGroup(found, result);
    result.deviation_mm = 1e3 * Deviation(result);
    return result;
  }

 private:
  // Largest distance by which `rotation` moves the first `count` samples off the surface. Stops
  // early, with the value so far, above `limit`.
  double Leaves(const Eigen::Matrix3d& rotation, double limit,
                Eigen::Index count = std::numeric_limits<Eigen::Index>::max()) const {
    double farthest = 0.0;
    for (Eigen::Index i = 0; i < std::min(count, samples_.cols()) && farthest <= limit; ++i) {
      const Eigen::Vector3d p = moments_.center + rotation * samples_.col(i);
      farthest = std::max(farthest, std::sqrt(tree_.Closest(p).squared_distance));
    }
    return farthest;
  }

  double MeanSquare(const Eigen::Matrix3d& rotation, Eigen::Index count) const {
    double sum = 0.0;
    const Eigen::Index n = std::min(count, samples_.cols());
    for (Eigen::Index i = 0; i < n; ++i) {
      sum += tree_.Closest(moments_.center + rotation * samples_.col(i)).squared_distance;
    }
    return sum / static_cast<double>(n);
  }

  // Adjusts the axis to minimize the deviation from the surface after a turn by `angle`.
  Eigen::Vector3d Refine(Eigen::Vector3d axis, double angle) const {
    double best = MeanSquare(Turn(axis, angle), kFineSamples);
    for (double step = 3.0 * kPi / 180.0; step > 0.05 * kPi / 180.0;) {
      const Eigen::Vector3d u = step * axis.unitOrthogonal();
      const Eigen::Vector3d v = axis.cross(u);
      bool moved = false;
      for (const Eigen::Vector3d& by : {u, v, Eigen::Vector3d(-u), Eigen::Vector3d(-v)}) {
        const Eigen::Vector3d to = (axis + by).normalized();
        const double value = MeanSquare(Turn(to, angle), kFineSamples);
        if (value >= best) continue;
        best = value;
        axis = to;
        moved = true;
        break;
      }
      if (!moved) step *= 0.5;
    }
    return axis;
  }

  bool IsSphere(ObjectSymmetry& result) const {
    const Eigen::VectorXd radius = samples_.colwise().norm().transpose();
    if (radius.maxCoeff() - radius.minCoeff() > 2.0 * tolerance_) return false;
    result.sphere = true;
    for (const Eigen::Vector3d& axis : HalfSphere(12)) {
      result.deviation_mm =
          std::max(result.deviation_mm,
                   1e3 * Leaves(Turn(axis, 1.0), std::numeric_limits<double>::infinity()));
    }
    if (result.deviation_mm <= 1e3 * tolerance_) return true;
    result = ObjectSymmetry();
    result.center = moments_.center;
    return false;
  }

  // Adds the symmetries by 1 / fold of a turn about axes near the candidates.
  void Search(const std::vector<Eigen::Vector3d>& candidates, int fold,
              std::vector<Found>& found) const {
    const double angle = 2.0 * kPi / fold;
    std::vector<std::pair<double, int>> order;  // by deviation from the surface after the turn
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const double squared = MeanSquare(Turn(candidates[i], angle), kCoarseSamples);
      // Before refinement, allow for the displacement due to an axis a few degrees off.
      const double forgiven = tolerance_ + 0.1 * std::sqrt(moments_.covariance.trace());
      if (squared < forgiven * forgiven) order.emplace_back(squared, static_cast<int>(i));
    }
    std::sort(order.begin(), order.end());
    std::vector<Eigen::Vector3d> tried;
    for (const auto& [squared, i] : order) {
      const Eigen::Vector3d& start = candidates[static_cast<std::size_t>(i)];
      const auto is_near = [&](const Eigen::Vector3d& axis) {
        return std::abs(axis.dot(start)) > std::cos(kSameAxis);
      };
      if (tried.size() >= kTries) return;
      if (std::any_of(tried.begin(), tried.end(), is_near)) continue;
      tried.push_back(start);
      const Eigen::Vector3d axis = Refine(start, angle);
      const bool known = std::any_of(found.begin(), found.end(), [&](const Found& f) {
        return f.second == fold && std::abs(f.first.dot(axis)) > std::cos(kSameRotation);
      });
      if (!known && Leaves(Turn(axis, angle), tolerance_) <= tolerance_) {
        found.emplace_back(axis, fold);
      }
    }
  }

  // An axis with symmetries by 1/3, 1/4 and 1/5 of a turn has 1/60 of a turn: treated as round.
  bool FindRoundAxis(const std::vector<Found>& found, ObjectSymmetry& result) const {
    for (const auto& [five, found_fold] : found) {
      if (found_fold != 5) continue;
      const auto has_fold = [&, &axis = five](int fold) {
        return Leaves(Turn(axis, 2.0 * kPi / fold), tolerance_) <= tolerance_;
      };
      if (!has_fold(3) || !has_fold(4)) continue;
      result.axis = five;
      const Eigen::Matrix3d flip = Turn(five.unitOrthogonal(), kPi);
      if (Leaves(flip, tolerance_) <= tolerance_) result.rotations.push_back(flip);
      return true;
    }
    return false;
  }

  // Adds all products of the found symmetries that are themselves symmetries.
  void CloseGroup(const std::vector<Found>& found, ObjectSymmetry& result) const {
    std::vector<Eigen::Matrix3d>& group = result.rotations;
    for (std::size_t i = 0; i < group.size() && group.size() < kLargestGroup; ++i) {
      for (const auto& [axis, fold] : found) {
        const Eigen::Matrix3d product = NearestRotation(group[i] * Turn(axis, 2.0 * kPi / fold));
        const bool is_new = std::none_of(group.begin(), group.end(), [&](const Eigen::Matrix3d& k) {
          return AngleBetween(product, k) < kSameRotation;
        });
        if (is_new && Leaves(product, 1.5 * tolerance_) <= 1.5 * tolerance_) {
          group.push_back(product);
        }
      }
    }
  }

  double Deviation(const ObjectSymmetry& symmetry) const {
    double farthest = 0.0;
    constexpr double kNoLimit = std::numeric_limits<double>::infinity();
    for (const Eigen::Matrix3d& rotation : symmetry.rotations) {
      if (!symmetry.axis) {
        farthest = std::max(farthest, Leaves(rotation, kNoLimit));
        continue;
      }
      for (int k = 1; k <= 12; ++k) {
        farthest =
            std::max(farthest, Leaves(rotation * Turn(*symmetry.axis, kGoldenAngle * k), kNoLimit));
      }
    }
    return farthest;
  }

  // Directions spread evenly over a hemisphere.
  static std::vector<Eigen::Vector3d> HalfSphere(int count) {
    std::vector<Eigen::Vector3d> directions;
    for (int k = 0; k < count; ++k) {
      const double z = (k + 0.5) / count;
      const double r = std::sqrt(1.0 - z * z);
      directions.emplace_back(r * std::cos(kGoldenAngle * k), r * std::sin(kGoldenAngle * k), z);
    }
    return directions;
  }

  TriangleTree tree_;
  SurfaceMoments moments_;
  double tolerance_ = 0.0;
  Eigen::Matrix3Xd samples_;  // relative to the center
};

}  // namespace

ObjectSymmetry DetectSymmetry(const TriangleMesh& mesh) { return SymmetrySearch(mesh).Find(); }

std::string Describe(const ObjectSymmetry& symmetry) {
  if (symmetry.sphere) return "any rotation";
  if (symmetry.axis) {
    // Hide rounding errors and the arbitrary sign of the axis.
    Eigen::Vector3d axis = *symmetry.axis;
    Eigen::Index largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    if (axis[largest] < 0.0) axis = -axis;
    for (double& x : axis) x = std::abs(x) < 5e-3 ? 0.0 : x;
    return fmt::format("any turn about ({:.2g}, {:.2g}, {:.2g}){}", axis.x(), axis.y(), axis.z(),
                       symmetry.rotations.size() > 1 ? ", ends alike" : "");
  }
  if (symmetry.rotations.size() > 1) return fmt::format("{} rotations", symmetry.rotations.size());
  return "none";
}

double AngleModulo(const Eigen::Matrix3d& R_a, const Eigen::Matrix3d& R_b,
                   const ObjectSymmetry& symmetry) {
  if (symmetry.sphere) return 0.0;
  double least = kPi;
  for (const Eigen::Matrix3d& S : symmetry.rotations) {
    if (symmetry.axis) {
      const Eigen::Vector3d a = R_a * *symmetry.axis;
      const Eigen::Vector3d b = R_b * S * *symmetry.axis;
      least = std::min(least, std::atan2(a.cross(b).norm(), a.dot(b)));
    } else {
      least = std::min(least, AngleBetween(R_a, R_b * S));
    }
  }
  return least;
}

SurfaceMoments MeasureMoments(const TriangleMesh& mesh) {
  SurfaceMoments moments;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  if (mesh.NumVertices() == 0) throw Error("mesh", "has no vertices", "Give a surface");
  const Eigen::Vector3d origin = mesh.vertices.col(0);
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    Eigen::Matrix3d p;
    for (int k = 0; k < 3; ++k) p.col(k) = mesh.vertices.col(mesh.faces(k, f)) - origin;
    const double area = 0.5 * (p.col(1) - p.col(0)).cross(p.col(2) - p.col(0)).norm();
    const Eigen::Vector3d sum = p.rowwise().sum();
    moments.area_m2 += area;
    first += area / 3.0 * sum;
    second += area / 12.0 * (p * p.transpose() + sum * sum.transpose());
  }
  if (!(moments.area_m2 > 0.0)) throw Error("mesh", "has no area", "Give a surface");
  const Eigen::Vector3d mean = first / moments.area_m2;
  moments.center = origin + mean;
  moments.covariance = second / moments.area_m2 - mean * mean.transpose();
  return moments;
}

double Diameter(const Eigen::Matrix3Xd& vertices) {
  const Eigen::Index n = vertices.cols();
  if (n < 2) return 0.0;
  // Farthest from the middle first: the distance of a pair is at most the sum of its radii, so most
  // pairs of an elongated object are never tested.
  const Eigen::Vector3d middle =
      0.5 * (vertices.rowwise().minCoeff() + vertices.rowwise().maxCoeff());
  const Eigen::VectorXd radius = (vertices.colwise() - middle).colwise().norm().transpose();
  std::vector<int> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return radius[a] > radius[b] || (radius[a] == radius[b] && a < b);
  });
  double squared = 0.0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Eigen::Vector3d a = vertices.col(order[i]);
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      const double reach = radius[order[i]] + radius[order[j]];
      if (reach * reach <= squared) break;
      squared = std::max(squared, (vertices.col(order[j]) - a).squaredNorm());
    }
  }
  return std::sqrt(squared);
}

}  // namespace holdfast
