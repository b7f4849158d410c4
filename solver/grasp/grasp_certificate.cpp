// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_certificate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <utility>

#include <glpk.h>

#include "geometry/error.h"
#include "geometry/mesh/mesh_topology.h"

namespace holdfast {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Wrenches = Eigen::Matrix<double, 6, Eigen::Dynamic>;

constexpr double kBalanced = 1e-6;  // of the load's length

void RequireValid(double length_m, const CertificateOptions& options) {
  const auto require = [](bool valid, const char* what) {
    if (!valid) throw Error("grasp certificate", what, "Use the defaults of CertificateOptions");
  };
  require(length_m > 0.0 && std::isfinite(length_m), "the length is not positive");
  require(options.friction >= 0.0 && options.most_friction >= 0.0, "friction is negative");
  require(options.cone_edges >= 3 && options.cone_edges <= 1000, "a cone needs 3 to 1000 edges");
  require(options.twist_lever_m >= 0.0, "the lever is negative");
  require(options.most_squeeze > 0.0 && options.friction_step > 0.0,
          "squeeze and step of friction are not positive");
}

// Wrenches (a column each) of forces with normal component 1 along the edges of the pyramids.
Wrenches EdgeWrenches(std::span<const GraspContact> contacts, const Eigen::Vector3d& mass_center,
                      double length_m, double friction, const CertificateOptions& options) {
  const int edges = friction > 0.0 ? options.cone_edges : 1;
  const double twist = friction * options.twist_lever_m / length_m;
  const int per_contact = edges + (twist > 0.0 ? 2 : 0);
  Wrenches wrenches(6, per_contact * static_cast<Eigen::Index>(contacts.size()));
  Eigen::Index column = 0;
  for (const GraspContact& contact : contacts) {
    const Eigen::Vector3d n = contact.inward;
    const Eigen::Vector3d t = n.unitOrthogonal();
    const Eigen::Vector3d b = n.cross(t);
    const Eigen::Vector3d arm = (contact.point - mass_center) / length_m;
    for (int e = 0; e < edges; ++e) {
      const double angle = 2.0 * std::numbers::pi * e / edges;
      const Eigen::Vector3d force = n + friction * (std::cos(angle) * t + std::sin(angle) * b);
      wrenches.col(column++) << force, arm.cross(force);
    }
    for (const double turn : {-twist, twist}) {
      if (twist > 0.0) wrenches.col(column++) << n, arm.cross(n) + turn * n;
    }
  }
  return wrenches;
}

// GLPK keeps an environment for each thread that uses it.
struct FreeEnvironment {
  ~FreeEnvironment() { glp_free_env(); }
};

// The linear program of how much x >= 0 of each wrench there is: least cost of over and under, both
// >= 0, where W x - over + under = load, where the sum of x may be bounded. Rows: the six of W and
// the sum; columns: x, then over and under of each row.
class WrenchProgram {
 public:
  explicit WrenchProgram(const Wrenches& wrenches)
      : wrenches_(wrenches), count_(static_cast<int>(wrenches.cols())) {
    thread_local const FreeEnvironment at_the_end_of_the_thread;
    (void)at_the_end_of_the_thread;
    glp_term_out(GLP_OFF);
    program_.reset(glp_create_prob());
    glp_add_rows(program_.get(), 7);
    glp_add_cols(program_.get(), count_ + 12);
    const std::array<int, 8> rows = {0, 1, 2, 3, 4, 5, 6, 7};
    for (int i = 0; i < count_; ++i) {
      std::array<double, 8> values{};
      for (int k = 0; k < 6; ++k) values[1 + k] = wrenches(k, i);
      values[7] = 1.0;
      glp_set_mat_col(program_.get(), 1 + i, 7, rows.data(), values.data());
      glp_set_col_bnds(program_.get(), 1 + i, GLP_LO, 0.0, 0.0);
    }
    for (int k = 0; k < 12; ++k) {
      const std::array<int, 2> row = {0, 1 + k / 2};
      const std::array<double, 2> value = {0.0, k % 2 ? 1.0 : -1.0};
      glp_set_mat_col(program_.get(), 1 + count_ + k, 1, row.data(), value.data());
      glp_set_col_bnds(program_.get(), 1 + count_ + k, GLP_LO, 0.0, 0.0);
    }
    glp_std_basis(program_.get());
    glp_set_row_bnds(program_.get(), 7, GLP_FR, 0.0, 0.0);
  }

  void SetLoad(int k, double load) { glp_set_row_bnds(program_.get(), 1 + k, GLP_FX, load, load); }
  void SetMostSum(double most) { glp_set_row_bnds(program_.get(), 7, GLP_UP, 0.0, most); }
  // Of x, and of over and under.
  void SetCosts(double forces, double missing) {
    for (int i = 0; i < count_ + 12; ++i) {
      glp_set_obj_coef(program_.get(), 1 + i, i < count_ ? forces : missing);
    }
  }
  // W x and the sum of x at the optimum, x made feasible exactly: no part negative. Both zero when
  // the solver fails.
  std::pair<Vector6d, double> Minimize() {
    glp_smcp options;
    glp_init_smcp(&options);
    options.msg_lev = GLP_MSG_OFF;
    options.meth = GLP_DUALP;  // where the last basis is still feasible for it, else primal
    std::pair<Vector6d, double> reached{Vector6d::Zero(), 0.0};
    if (glp_simplex(program_.get(), &options) != 0) {
      glp_std_basis(program_.get());
      if (glp_simplex(program_.get(), &options) != 0) return reached;
    }
    for (int i = 0; i < count_; ++i) {
      const double x = std::max(0.0, glp_get_col_prim(program_.get(), 1 + i));
      reached.first += x * wrenches_.col(i);
      reached.second += x;
    }
    return reached;
  }
  // The multipliers of the six rows.
  Vector6d Direction() const {
    Vector6d direction;
    for (int k = 0; k < 6; ++k) direction(k) = glp_get_row_dual(program_.get(), 1 + k);
    return direction;
  }

 private:
  const Wrenches& wrenches_;
  int count_;
  std::unique_ptr<glp_prob, decltype(&glp_delete_prob)> program_{nullptr, glp_delete_prob};
};

bool BalancesGravity(const Wrenches& wrenches, double most_squeeze) {
  if (wrenches.cols() == 0) return false;
  WrenchProgram program(wrenches);
  program.SetCosts(0.0, 1.0);
  program.SetMostSum(most_squeeze);
  const Eigen::Matrix<double, 3, 4> corners =
      (Eigen::Matrix<double, 3, 4>() << 1, 1, -1, -1, 1, -1, 1, -1, 1, -1, -1, 1).finished() /
      std::sqrt(3.0);
  for (int i = 0; i < 4; ++i) {
    Vector6d force = Vector6d::Zero();
    force.head<3>() = corners.col(i);
    for (int k = 0; k < 6; ++k) program.SetLoad(k, force(k));
    const auto [reached, squeeze] = program.Minimize();
    if ((reached - force).norm() > kBalanced || squeeze > most_squeeze * (1.0 + kBalanced)) {
      return false;
    }
  }
  return true;
}

// The 27 vertices of the polytope 2_21 (minuscule weights of E6) and their opposites: the convex
// hull of all 54 contains the ball of radius 1/sqrt(2) and is in that of sqrt(4/3).
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
  // Each is followed by the nearest of those that remain: from one's program to the next is the
  // least way then.
  for (int i = 1; i + 1 < directions.cols(); ++i) {
    Eigen::Index next;
    (directions.col(i - 1).transpose() * directions.rightCols(directions.cols() - i))
        .maxCoeff(&next);
    directions.col(i).swap(directions.col(i + next));
  }
  return directions;
}

// The support function's least value found by descent from a direction; at least 0.
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

// Sets the bounds of the ball.
void BoundBall(const Wrenches& wrenches, GraspCertificate& certificate) {
  constexpr double kMissing = 1e4;  // cost of a wrench that is out of reach
  const double inradius = 1.0 / std::sqrt(2.0);
  WrenchProgram program(wrenches);
  program.SetCosts(1.0, kMissing);
  static const Eigen::Matrix<double, 6, 54> directions = DirectionsAround();
  double lower = std::numeric_limits<double>::infinity(), upper = lower;
  for (int i = 0; i < directions.cols() && upper > 0.0 && lower > 0.0; ++i) {
    for (int k = 0; k < 6; ++k) program.SetLoad(k, directions(k, i));
    // What reaches the direction with least forces lies on the hull when they add up to 1; the
    // multipliers are the normal of the facet there.
    const auto [reached, sum] = program.Minimize();
    const double missed = (reached - directions.col(i)).norm();
    lower = sum > 0.0 && missed < kBalanced ? std::min(lower, (inradius - missed) / sum) : 0.0;
    upper = std::min(upper, DescendedSupport(wrenches, program.Direction()));
    upper = std::min(upper, DescendedSupport(wrenches, -program.Direction()));
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

  const auto holds = [&](double friction) {
    return BalancesGravity(EdgeWrenches(contacts, mass_center, length_m, friction, options),
                           options.most_squeeze);
  };
  double slips = -options.friction_step, held = options.most_friction;
  if (holds(held)) {
    while (held - slips > options.friction_step * (1.0 + 1e-9)) {
      const double between = std::max(0.0, 0.5 * (slips + held));
      if (holds(between)) {
        held = between;
        if (held == 0.0) break;
      } else {
        slips = between;
      }
    }
    certificate.least_friction = held;
  }

  BoundBall(EdgeWrenches(contacts, mass_center, length_m, options.friction, options), certificate);
  return certificate;
}

bool HoldsGravity(std::span<const GraspContact> contacts, const Eigen::Vector3d& mass_center,
                  double length_m, double friction, const CertificateOptions& options) {
  RequireValid(length_m, options);
  return BalancesGravity(EdgeWrenches(contacts, mass_center, length_m, friction, options),
                         options.most_squeeze);
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
  const Eigen::Matrix3Xd& vertices = hand.At(fingers.data(), false).Vertices();
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
  std::stable_sort(touching.begin(), touching.end(),
                   [](const Touch& a, const Touch& b) { return a.distance < b.distance; });
  for (double apart = 0.006;; apart *= 1.25) {
    std::vector<Touch> kept;
    for (const Touch& touch : touching) {
      const auto near = [&](const Touch& other) {
        return other.part == touch.part &&
               (other.contact.point - touch.contact.point).norm() < apart;
      };
      if (std::none_of(kept.begin(), kept.end(), near)) kept.push_back(touch);
    }
    if (static_cast<int>(kept.size()) > most && apart < 1.0) continue;
    std::vector<GraspContact> contacts;
    for (const Touch& touch : kept) contacts.push_back(touch.contact);
    return contacts;
  }
}

std::string WhyNotSolid(const TriangleMesh& mesh) {
  constexpr double kMostOpen = 0.05, kThinnest_m = 1e-4;
  const double area = SurfaceArea(mesh);
  if (!(area > 0.0)) return "the mesh has no surface";
  std::vector<std::pair<int, int>> boundary;
  DisjointSets loops(static_cast<int>(mesh.NumVertices()));
  EdgeTable(mesh.faces, mesh.NumVertices()).ForEach([&](int a, int b, std::span<const int> sides) {
    if (sides.size() != 1) return;
    boundary.emplace_back(a, b);
    loops.Merge(a, b);
  });
  std::map<int, double> around;  // metres, of each loop
  for (const auto& [a, b] : boundary) {
    around[loops.Find(a)] += (mesh.vertices.col(a) - mesh.vertices.col(b)).norm();
  }
  double holes = 0.0;
  for (const auto& [loop, length] : around) holes += length * length / (4.0 * std::numbers::pi);
  if (holes > kMostOpen * area) return "the mesh is open: it encloses no solid";
  const Eigen::Vector3d middle = mesh.vertices.rowwise().mean();
  const TriangleMesh centered{mesh.vertices.colwise() - middle, mesh.faces};
  if (2.0 * SignedVolume(centered) < kThinnest_m * area)
    return "the mesh is flat: it has no volume";
  return {};
}

}  // namespace holdfast
