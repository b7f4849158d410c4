// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_certificate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "geometry/error.h"
#include "geometry/mesh/half_edges.h"
#include "solver/grasp/wrench_program.h"

namespace holdfast {
namespace {

using Vector6d = WrenchProgram::Vector6d;
using Wrenches = WrenchProgram::Wrenches;

constexpr double kMaxFriction = 2.0;  // above it, no friction is considered sufficient
constexpr double kBalanced = 1e-6;    // relative to the length of the load

void RequireValid(double length_m, const CertificateOptions& options) {
  const auto require = [](bool valid, const char* what) {
    if (!valid) throw Error("grasp certificate", what, "Use the defaults of CertificateOptions");
  };
  require(length_m > 0.0 && std::isfinite(length_m), "the length is not positive");
  require(options.friction >= 0.0, "friction is negative");
  require(options.cone_edges >= 3 && options.cone_edges <= 1000, "a cone needs 3 to 1000 edges");
  require(options.most_squeeze > 0.0 && options.friction_step > 0.0,
          "squeeze force or friction step is not positive");
}

// Wrenches (one column each) of forces with normal component 1 along the edges of the pyramids;
// each is linear in the friction.
struct EdgeWrenches {
  Wrenches without;  // without friction
  Wrenches per_friction;

  EdgeWrenches(std::span<const GraspContact> contacts, const Eigen::Vector3d& mass_center,
               double length_m, const CertificateOptions& options) {
    without.resize(6, options.cone_edges * static_cast<Eigen::Index>(contacts.size()));
    per_friction.resize(6, without.cols());
    Eigen::Index column = 0;
    for (const GraspContact& contact : contacts) {
      const Eigen::Vector3d n = contact.inward;
      const Eigen::Vector3d t = n.unitOrthogonal();
      const Eigen::Vector3d b = n.cross(t);
      const Eigen::Vector3d arm = (contact.point - mass_center) / length_m;
      Vector6d straight;
      straight << n, arm.cross(n);
      without.middleCols(column, options.cone_edges).colwise() = straight;
      for (int e = 0; e < options.cone_edges; ++e) {
        const double angle = 2.0 * std::numbers::pi * e / options.cone_edges;
        const Eigen::Vector3d aside = std::cos(angle) * t + std::sin(angle) * b;
        per_friction.col(column++) << aside, arm.cross(aside);
      }
    }
  }

  Wrenches With(double friction) const { return without + friction * per_friction; }
};

// Four directions that positively span space: if the weight is balanced in these, it is in all.
Eigen::Matrix<double, 3, 4> Tetrahedron() {
  return (Eigen::Matrix<double, 3, 4>() << 1, 1, -1, -1, 1, -1, 1, -1, 1, -1, -1, 1).finished() /
         std::sqrt(3.0);
}

// Minimizes the unbalanced part of loads, by forces with a bounded sum.
class BalanceProgram : public WrenchProgram {
 public:
  explicit BalanceProgram(double most_squeeze)
      : WrenchProgram(0.0, 1.0), most_squeeze_(most_squeeze) {
    SetMostSum(most_squeeze);
  }
  bool Balances(const Vector6d& load) {
    SetLoad(load);
    const auto [reached, squeeze] = Minimize();
    return (reached - load).norm() <= kBalanced && squeeze <= most_squeeze_ * (1.0 + kBalanced);
  }

 private:
  double most_squeeze_;
};

// Friction up to which the multipliers of a program refute that a load is balanced.
double RefutedBy(const Vector6d& multipliers, const Vector6d& load, const EdgeWrenches& edges,
                 const CertificateOptions& options) {
  const double lifted = multipliers.dot(load) / options.most_squeeze;
  const Eigen::RowVectorXd without = multipliers.transpose() * edges.without;
  const Eigen::RowVectorXd per_friction = multipliers.transpose() * edges.per_friction;
  double refuted = kMaxFriction;
  for (Eigen::Index i = 0; i < without.cols(); ++i) {
    if (without(i) + refuted * per_friction(i) > lifted) {
      refuted = (lifted - without(i)) / per_friction(i);
    }
  }
  return refuted;
}

// Least friction, to `friction_step`, that balances the weight in all directions. Each direction
// starts from the last result; steps grow and are bisected above the refuted friction.
std::optional<double> LeastFriction(const EdgeWrenches& edges, const CertificateOptions& options) {
  BalanceProgram program(options.most_squeeze);
  double friction = 0.0;
  const Eigen::Matrix<double, 3, 4> directions = Tetrahedron();
  for (int k = 0; k < directions.cols(); ++k) {
    Vector6d load = Vector6d::Zero();
    load.head<3>() = directions.col(k);
    double refuted = -options.friction_step, jump = 0.5 * options.friction_step;
    std::optional<double> held;
    for (double trial = friction; !held || *held - refuted > options.friction_step;
         trial = held ? 0.5 * (refuted + *held) : std::min(refuted + jump, kMaxFriction)) {
      program.Set(edges.With(trial));
      if (program.Balances(load)) {
        held = trial;
        if (trial == friction) break;
      } else {
        if (trial >= kMaxFriction) return std::nullopt;
        refuted = std::max(trial, RefutedBy(program.Direction(), load, edges, options));
        jump *= 2.0;
      }
    }
    friction = *held;
  }
  return friction;
}

// The 27 vertices of the polytope 2_21 (minuscule weights of E6) and their opposites. The convex
// hull of all 54 contains the ball of radius 1/sqrt(2) and lies in that of radius sqrt(4/3).
Eigen::Matrix<double, 6, 54> DirectionsAround() {
  Eigen::Matrix<double, 6, 54> directions = Eigen::Matrix<double, 6, 54>::Zero();
  const double unit = 1.0 / std::sqrt(3.0);
  directions(5, 0) = 2.0 * unit;
  int column = 1;
  for (int signs = 0; signs < 32; ++signs) {
    if (std::popcount(static_cast<unsigned>(signs)) % 2) continue;
    for (int k = 0; k < 5; ++k) directions(k, column) = signs >> k & 1 ? -0.5 : 0.5;
    directions(5, column++) = 0.5 * unit;
  }
  for (int k = 0; k < 10; ++k) {
    directions(k / 2, column) = k % 2 ? -1.0 : 1.0;
    directions(5, column++) = -unit;
  }
  directions.rightCols<27>() = -directions.leftCols<27>();
  // Each is followed by the nearest of the remaining ones, so that consecutive programs differ
  // least.
  for (int i = 1; i + 1 < directions.cols(); ++i) {
    Eigen::Index next;
    (directions.col(i - 1).transpose() * directions.rightCols(directions.cols() - i))
        .maxCoeff(&next);
    directions.col(i).swap(directions.col(i + next));
  }
  return directions;
}

// Least value of the support function found by descent from a direction; at least 0.
double DescendedSupport(const Wrenches& wrenches, Vector6d direction) {
  double least = std::numeric_limits<double>::infinity();
  for (int step = 0; step < 16 && direction.norm() > 1e-9; ++step) {
    direction.normalize();
    Eigen::Index furthest;
    least = std::min(least, (direction.transpose() * wrenches).maxCoeff(&furthest));
    direction -= 0.3 / (1.0 + step) * wrenches.col(furthest);
  }
  return std::max(0.0, least);
}

// Directions in which the bound of the ball is evaluated, and their additive relations.
struct DirectionsOfBall {
  Eigen::Matrix<double, 6, 54> all = DirectionsAround();
  // Per direction, the pairs of others that add up to it.
  std::array<std::vector<std::pair<int, int>>, 54> sums;

  DirectionsOfBall() {
    for (int a = 0; a < all.cols(); ++a) {
      for (int b = 0; b < a; ++b) {
        for (int i = 0; i < all.cols(); ++i) {
          if ((all.col(a) + all.col(b) - all.col(i)).norm() < 1e-9) sums[i].emplace_back(a, b);
        }
      }
    }
  }
};

// How far the hull of wrenches reaches in given directions, by linear programs over a subset of the
// wrenches; wrenches that the multipliers show to reach farther are added.
class HullReach {
 public:
  explicit HullReach(const Wrenches& wrenches)
      : wrenches_(wrenches), used_(static_cast<std::size_t>(wrenches.cols())) {}

  void Use(Eigen::Index wrench) {
    if (used_[wrench]) return;
    used_[wrench] = true;
    program_.Add(wrenches_.col(wrench));
  }
  struct Reached {
    double forces;  // sum of the forces for the direction: 1 / reach
    double missed;  // distance of their result from the direction
  };
  // Least sum of forces, or the first one found that is at most `enough`.
  Reached Towards(const Vector6d& direction, double enough) {
    constexpr int kMaxAdded = 6;
    constexpr double kFarther = 1.0 + 1e-9;
    program_.SetLoad(direction);
    while (true) {
      const auto [reached, forces] = program_.Minimize();
      const double missed = (reached - direction).norm();
      if (forces > 0.0 && forces <= enough && missed < kBalanced) return {forces, missed};
      Eigen::RowVectorXd beyond = program_.Direction().transpose() * wrenches_;
      int added = 0;
      for (; added < kMaxAdded; ++added) {
        Eigen::Index farthest;
        if (beyond.maxCoeff(&farthest) <= kFarther || used_[farthest]) break;
        Use(farthest);
        beyond(farthest) = 0.0;
      }
      if (added == 0) return {forces, missed};
    }
  }
  Vector6d Direction() const { return program_.Direction(); }

 private:
  static constexpr double kOutOfReach = 1e4;  // cost of the slacks, for unreachable wrenches

  const Wrenches& wrenches_;
  std::vector<bool> used_;
  WrenchProgram program_{1.0, kOutOfReach};
};

// Sets the bounds of the ball.
void BoundBall(const Wrenches& wrenches, GraspCertificate& certificate) {
  const double inradius = 1.0 / std::sqrt(2.0);
  static const DirectionsOfBall directions;
  HullReach hull(wrenches);
  const Eigen::MatrixXd along = directions.all.transpose() * wrenches;
  int first = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < along.rows(); ++i) {
    Eigen::Index furthest;
    const double support = along.row(i).maxCoeff(&furthest);
    if (support <= 0.0) return;
    hull.Use(furthest);
    if (support < least) {
      least = support;
      first = i;
    }
  }
  std::array<HullReach::Reached, 54> reached;
  reached.fill({std::numeric_limits<double>::infinity(), 0.0});
  double lower = least, upper = least, most = 0.0;
  for (int n = 0; n < along.rows() && lower > 0.0 && upper > 0.0; ++n) {
    const int i = (first + n) % static_cast<int>(along.rows());
    // Two directions that add up to this one bound its forces; no program where that suffices.
    for (const auto& [a, b] : directions.sums[i]) {
      const double forces = reached[a].forces + reached[b].forces;
      if (forces < reached[i].forces) reached[i] = {forces, reached[a].missed + reached[b].missed};
    }
    if (!(reached[i].forces <= most)) {
      reached[i] = hull.Towards(directions.all.col(i), most);
      // The multipliers are the normal of the facet that is met in this direction.
      upper = std::min(upper, DescendedSupport(wrenches, hull.Direction()));
      upper = std::min(upper, DescendedSupport(wrenches, -hull.Direction()));
    }
    const auto [forces, missed] = reached[i];
    most = std::max(most, forces);
    lower = forces > 0.0 && missed < 2.0 * kBalanced ? std::min(lower, (inradius - missed) / forces)
                                                     : 0.0;
  }
  certificate.ball_lower = std::min(lower, upper);
  certificate.ball_upper = upper;
}

}  // namespace

GraspCertificate CertifyContacts(std::span<const GraspContact> contacts,
                                 const Eigen::Vector3d& mass_center, double length_m,
                                 const CertificateOptions& options) {
  RequireValid(length_m, options);
  GraspCertificate certificate;
  certificate.friction = options.friction;
  certificate.length_m = length_m;
  certificate.contacts = static_cast<int>(contacts.size());
  if (contacts.empty()) return certificate;

  const EdgeWrenches edges(contacts, mass_center, length_m, options);
  certificate.least_friction = LeastFriction(edges, options);
  BoundBall(edges.With(options.friction), certificate);
  return certificate;
}

bool HoldsGravity(std::span<const GraspContact> contacts, const Eigen::Vector3d& mass_center,
                  double length_m, double friction, const CertificateOptions& options) {
  return HoldsGravity(contacts, std::span(&mass_center, 1), length_m, friction, options);
}

bool HoldsGravity(std::span<const GraspContact> contacts,
                  std::span<const Eigen::Vector3d> mass_centers, double length_m, double friction,
                  const CertificateOptions& options) {
  RequireValid(length_m, options);
  if (contacts.empty() || mass_centers.empty()) return false;
  const Eigen::Vector3d& origin = mass_centers.front();
  BalanceProgram program(options.most_squeeze);
  program.Set(EdgeWrenches(contacts, origin, length_m, options).With(friction));
  return std::ranges::all_of(mass_centers, [&](const Eigen::Vector3d& mass_center) {
    const Eigen::Vector3d arm = (mass_center - origin) / length_m;
    return std::ranges::all_of(Tetrahedron().colwise(), [&](const Eigen::Vector3d& force) {
      Vector6d load;
      load << force, arm.cross(force);
      return program.Balances(load);
    });
  });
}

std::vector<GraspContact> PadContacts(const HandAnatomy& anatomy, HandEvaluation& hand,
                                      const DistanceGrid& object, const FingerPose& fingers,
                                      const Eigen::Isometry3d& wrist_from_object,
                                      double touch_distance_m, int most) {
  struct Touch {
    double distance;
    int part;
    GraspContact contact;
  };
  const Eigen::Matrix3Xd& vertices = hand.At(fingers).Vertices();
  const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
  std::vector<Touch> touching;
  for (int part = 0; part < kNumHandParts; ++part) {
    for (const int i : anatomy.landmarks.Pad(part)) {
      const Eigen::Vector3d x = object_from_wrist * vertices.col(i);
      const double distance = object.Distance(x);
      if (distance >= touch_distance_m) continue;
      Eigen::Vector3d outward;
      object.Distance(x, &outward);
      if (outward.norm() < 1e-6) continue;
      outward.normalize();
      touching.push_back({distance, part, {x - distance * outward, -outward}});
    }
  }
  std::ranges::stable_sort(touching, {}, &Touch::distance);
  for (double apart = 0.006;; apart *= 1.25) {
    std::vector<Touch> kept;
    for (const Touch& touch : touching) {
      const auto near = [&](const Touch& other) {
        return other.part == touch.part &&
               (other.contact.point - touch.contact.point).norm() < apart;
      };
      if (std::ranges::none_of(kept, near)) kept.push_back(touch);
    }
    if (static_cast<int>(kept.size()) > most && apart < 1.0) continue;
    std::vector<GraspContact> contacts;
    for (const Touch& touch : kept) contacts.push_back(touch.contact);
    return contacts;
  }
}

std::string WhyNotSolid(const TriangleMesh& mesh) {
  constexpr double kMaxOpen = 0.05, kThinnest_m = 1e-4;
  const double area = SurfaceArea(mesh);
  if (!(area > 0.0)) return "the mesh has no surface";
  double holes = 0.0;
  for (const std::vector<int>& loop : HalfEdges(mesh).BoundaryLoops()) {
    double length = 0.0;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      length +=
          (mesh.vertices.col(loop[k]) - mesh.vertices.col(loop[(k + 1) % loop.size()])).norm();
    }
    holes += length * length / (4.0 * std::numbers::pi);
  }
  if (holes > kMaxOpen * area) return "the mesh is open: it encloses no solid";
  const Eigen::Vector3d middle = mesh.vertices.rowwise().mean();
  const TriangleMesh centered{mesh.vertices.colwise() - middle, mesh.faces};
  if (2.0 * SignedVolume(centered) < kThinnest_m * area)
    return "the mesh is flat: it has no volume";
  return {};
}

}  // namespace holdfast
