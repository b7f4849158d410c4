// SPDX-License-Identifier: MIT
#include "solver/score/protocol_score.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <random>
#include <set>
#include <utility>

#include <ceres/first_order_function.h>
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>
#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/parallel.h"
#include "geometry/score/hand_object_score.h"
#include "solver/trial/trial_clip.h"

namespace holdfast {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kShellVoxel_m = 5e-3, kSolidVoxel_m = 2e-3;
constexpr int kObjectPoints = 2000, kHandPoints = 5000;
constexpr double kMaxObject_m = 2.0;

// A hand in a frame, posed in the object's frame.
struct PosedGrasp {
  const HandState& state;
  Eigen::Isometry3d world_from_object;
  const TriangleMesh& open;  // without the wrist's cap
  const Solid& closed;
};

// A value of each grasp that is measured.
using Measures = std::vector<double>;

double Mean(const Measures& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

template <typename Condition>
double Share(const Measures& values, const Condition& holds) {
  return static_cast<double>(std::ranges::count_if(values, holds)) /
         static_cast<double>(values.size());
}

// (hand, frame) of the frames in which hands hold, at most `count`, evenly spread.
std::vector<std::pair<int, int>> GraspsOf(std::span<const HandObjectScore> hands, int count) {
  std::vector<std::pair<int, int>> all, some;
  for (int h = 0; h < static_cast<int>(hands.size()); ++h) {
    for (std::size_t t = 0; t < hands[h].frames.size(); ++t) {
      if (hands[h].Holds(t)) all.emplace_back(h, static_cast<int>(t));
    }
  }
  const int used = std::min(count, static_cast<int>(all.size()));
  for (int i = 0; i < used; ++i) {
    some.push_back(all[(2 * static_cast<std::size_t>(i) + 1) * all.size() / (2 * used)]);
  }
  return some;
}

// Calls measure(grasp) -> std::vector<double> (fixed length) for each of the grasps; returns the
// measures by row. Empty if stopped.
template <typename Measure>
std::vector<Measures> MeasureGrasps(const ClipScene& scene, const ClipScore& score, int threads,
                                    const std::function<bool(int, int)>& progress,
                                    const Measure& measure) {
  const std::vector<std::pair<int, int>> grasps = GraspsOf(score.hands, kProtocolGrasps);
  std::vector<HandModel> models;
  for (const HandObjectScore& hand : score.hands) {
    models.emplace_back(scene.body, scene.betas, hand.side);
  }
  const int count = static_cast<int>(grasps.size());
  std::vector<std::vector<double>> of_grasp(grasps.size());
  std::atomic<bool> stopped{false};
  std::mutex mutex;
  int done = 0;
  ParallelFor(count, threads, [&](int i) {
    if (stopped) return;
    const auto [h, t] = grasps[static_cast<std::size_t>(i)];
    const HandModel& model = models[static_cast<std::size_t>(h)];
    HandState state(model);
    const Eigen::Isometry3d world_from_object = scene.clip.object->Pose(t);
    state.SetBody(scene.clip.pose[t], scene.clip.trans.col(t));
    state.Evaluate(FingersOf(scene.clip.pose[t], model.HandSide()), false);
    const TriangleMesh open{world_from_object.inverse() * state.Vertices(),
                            model.Surface().Faces()};
    of_grasp[static_cast<std::size_t>(i)] =
        measure(PosedGrasp{state, world_from_object, open, Solid(open, true)});
    const std::lock_guard lock(mutex);
    if (progress && !progress(++done, count)) stopped = true;
  });
  std::vector<Measures> rows;
  if (stopped || of_grasp.empty()) return rows;
  rows.resize(of_grasp.front().size());
  for (const std::vector<double>& values : of_grasp) {
    for (std::size_t k = 0; k < values.size(); ++k) rows[k].push_back(values[k]);
  }
  return rows;
}

// Volume (cm3) of the object's voxels whose centers are inside a hand.
double VoxelsInside_cm3(const Eigen::Matrix3Xd& centers, double edge_m, const Solid& hand) {
  const Eigen::AlignedBox3d box(hand.distance.Min(), hand.distance.Max());
  int inside = 0;
  for (Eigen::Index i = 0; i < centers.cols(); ++i) {
    const Eigen::Vector3d center = centers.col(i);
    if (box.contains(center) && hand.distance.Inside(center)) ++inside;
  }
  return 1e6 * inside * edge_m * edge_m * edge_m;
}

// Centers of the cubes, on the grid of multiples of `edge_m`, that are inside.
Eigen::Matrix3Xd SolidVoxels(const SignedDistance& object, double edge_m) {
  const Eigen::Array3i low = (object.Min() / edge_m).array().floor().cast<int>();
  const Eigen::Array3i high = (object.Max() / edge_m).array().ceil().cast<int>();
  std::vector<Eigen::Vector3d> inside;
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int z = low.z(); z <= high.z();) {
        const Eigen::Vector3d center = edge_m * Eigen::Vector3d(x, y, z);
        // No sign changes within the distance.
        const double distance = object.Distance(center);
        const double same = std::max(0.0, object.SideHolds(center, std::abs(distance)));
        const int next = std::min(high.z() + 1, z + 1 + static_cast<int>(same / edge_m * 0.999));
        for (; z < next; ++z) {
          if (distance < 0.0) inside.push_back(edge_m * Eigen::Vector3d(x, y, z));
        }
      }
    }
  }
  Eigen::Matrix3Xd centers(3, static_cast<Eigen::Index>(inside.size()));
  for (std::size_t i = 0; i < inside.size(); ++i) centers.col(i) = inside[i];
  return centers;
}

std::vector<ProtocolContact> ContactsOf(const PosedGrasp& grasp, const SignedDistance& object,
                                        double touch_m) {
  const Eigen::Isometry3d object_from_wrist =
      grasp.world_from_object.inverse() * grasp.state.WorldFromWrist();
  std::vector<ProtocolContact> contacts;
  for (const GripContact& contact :
       ContactsOfHand(grasp.state, grasp.world_from_object, object, touch_m)) {
    contacts.push_back(
        {object_from_wrist * contact.point, object_from_wrist.linear() * contact.into});
  }
  return contacts;
}

// Two unit vectors across a unit normal.
std::pair<Eigen::Vector3d, Eigen::Vector3d> Across(const Eigen::Vector3d& normal) {
  const Eigen::Vector3d first = normal.unitOrthogonal();
  return {first, normal.cross(first)};
}

// The dual of GraspQP's program, strongly convex: x(y) = clamp(-F^T y / ridge, 1, 21), and the
// minimum is where y = F x(y).
class BalanceDual final : public ceres::FirstOrderFunction {
 public:
  explicit BalanceDual(Eigen::MatrixXd wrenches) : wrenches_(std::move(wrenches)) {}
  int NumParameters() const override { return 6; }
  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    const Eigen::Map<const Vector6d> y(parameters);
    const Eigen::ArrayXd pulls = wrenches_.transpose() * y;
    const Eigen::ArrayXd x = (-pulls / kRidge).max(1.0).min(kMaxForce);
    *cost = 0.5 * y.squaredNorm() - (pulls * x + 0.5 * kRidge * x.square()).sum();
    if (gradient != nullptr) Eigen::Map<Vector6d>{gradient} = y - wrenches_ * x.matrix();
    return true;
  }

 private:
  static constexpr double kRidge = 1e-4, kMaxForce = 21.0;
  Eigen::MatrixXd wrenches_;
};

// The trial of DexGraspNet: friction 3, density 500, gravity along six axes for 100 steps of 1/60
// s.
TrialProtocol DexGraspNetsTrial() {
  TrialProtocol trial;
  trial.least_mass_kg = 0.0;
  trial.most_mass_kg = std::numeric_limits<double>::infinity();
  trial.scene.friction = 3.0;
  trial.hold_s = 100.0 / 60.0;
  return trial;
}

// The pulls of GraspQP: 3 N on 0.2 kg along six axes for 0.5 s, without gravity.
TrialProtocol GraspQpsTrial() {
  TrialProtocol trial;
  trial.least_mass_kg = trial.most_mass_kg = 0.2;
  trial.gravity_m_s2 = 15.0;
  trial.scene.friction = 1.0;
  trial.hold_s = 0.5;
  trial.most_mm = 30.0;
  trial.most_deg = 360.0;
  return trial;
}

// The trial of the longest hold, if there is a simulator and one hand holds.
std::optional<HoldTrial> Trial(const ClipScene& scene, TrialProtocol protocol, int threads) {
  if (!HasPhysics()) return std::nullopt;
  protocol.threads = threads;
  const std::optional<ClipTrial> trial = TryClip(scene, protocol);
  return trial ? std::optional(trial->hold) : std::nullopt;
}

void ScoreGrab(const ClipScore& score, MetricValues& values) {
  Measures depth, touches;
  for (const HandObjectScore& hand : score.hands) {
    for (std::size_t t = 0; t < hand.frames.size(); ++t) {
      if (!hand.Holds(t)) continue;
      depth.push_back(0.1 * hand.frames[t].hand.max_penetration_mm);
      touches.push_back(hand.frames[t].hand.min_distance_mm);
    }
  }
  values["grab_depth_cm"] = Mean(depth);
  values["grab_contact_ratio"] = Share(touches, [](double mm) { return mm <= 5.0; });
}

// Area under the share of frames with ADD below a threshold of 1 to 9 cm, 0 to 1.
double AddAuc(std::span<const ObjectPoseError> errors) {
  double area = 0.0, last = 0.0;
  for (int cm = 1; cm <= 9; ++cm) {
    const double share = static_cast<double>(std::ranges::count_if(
                             errors, [&](const auto& e) { return e.add_mm < 10.0 * cm; })) /
                         static_cast<double>(errors.size());
    if (cm > 1) area += 0.5 * (last + share) / 8.0;
    last = share;
  }
  return area;
}

void CompareObjectPath(const ReferenceScore& reference, MetricValues& values) {
  if (reference.object.empty()) return;
  double meters = 0.0, radians = 0.0;
  for (const ObjectPoseError& error : reference.object) {
    meters += 1e-3 * error.translation_mm;
    radians += error.rotation_deg * std::numbers::pi / 180.0;
  }
  meters /= static_cast<double>(reference.object.size());
  radians /= static_cast<double>(reference.object.size());
  values["v2d_sp_success_ratio"] = meters <= 0.1 && radians <= 0.5 ? 1.0 : 0.0;
  values["v2d_mt_success_ratio"] = meters < 0.03 && radians < std::numbers::pi / 6.0 ? 1.0 : 0.0;
  values["v2d_add_auc_ratio"] = AddAuc(reference.object);
}

}  // namespace

Eigen::Matrix3Xd SurfaceVoxels(const TriangleMesh& mesh, double pitch_m) {
  const auto less = [](const Eigen::Vector3i& a, const Eigen::Vector3i& b) {
    return std::ranges::lexicographical_compare(a, b);
  };
  std::set<Eigen::Vector3i, decltype(less)> cells(less);
  for (int f = 0; f < mesh.NumFaces(); ++f) {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, f));
    const Eigen::Vector3d b = mesh.vertices.col(mesh.faces(1, f)) - a;
    const Eigen::Vector3d c = mesh.vertices.col(mesh.faces(2, f)) - a;
    const double longest = std::max({b.norm(), c.norm(), (b - c).norm()});
    const int n = std::max(1, static_cast<int>(std::ceil(2.0 * longest / pitch_m)));
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; i + j <= n; ++j) {
        const Eigen::Vector3d point = a + (i * b + j * c) / n;
        cells.insert((point / pitch_m).array().round().cast<int>().matrix());
      }
    }
  }
  Eigen::Matrix3Xd centers(3, static_cast<Eigen::Index>(cells.size()));
  Eigen::Index column = 0;
  for (const Eigen::Vector3i& cell : cells) centers.col(column++) = pitch_m * cell.cast<double>();
  return centers;
}

Eigen::Matrix3Xd FarthestPoints(const TriangleMesh& mesh, int count) {
  const Eigen::Matrix3Xd points = SampleSurface(mesh, 10 * count);
  Eigen::VectorXd apart =
      Eigen::VectorXd::Constant(points.cols(), std::numeric_limits<double>::infinity());
  Eigen::Matrix3Xd chosen(3, count);
  Eigen::Index next = 0;
  for (int i = 0; i < count; ++i) {
    chosen.col(i) = points.col(next);
    apart =
        apart.cwiseMin((points.colwise() - points.col(next)).colwise().squaredNorm().transpose());
    apart.maxCoeff(&next);
  }
  return chosen;
}

double GraspQpValue(const std::vector<ProtocolContact>& contacts, const Eigen::Vector3d& center) {
  constexpr double kSine = 0.2, kTorqueWeight = 5.0;
  constexpr int kEdges = 4;
  const auto count = static_cast<Eigen::Index>(contacts.size());
  if (count == 0) return std::numeric_limits<double>::infinity();
  Eigen::MatrixXd wrenches(6, kEdges * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const ProtocolContact& contact = contacts[static_cast<std::size_t>(i)];
    const auto [u, v] = Across(contact.into);
    const Eigen::Vector3d axis = std::sqrt(1.0 - kSine * kSine) * contact.into;
    int edge = 0;
    for (const Eigen::Vector3d& side : {u, v, Eigen::Vector3d(-u), Eigen::Vector3d(-v)}) {
      const Eigen::Vector3d force = (axis + kSine * side) / kEdges;
      wrenches.col(kEdges * i + edge++) << force,
          kTorqueWeight * (contact.point - center).cross(force);
    }
  }
  Vector6d y = Vector6d::Zero();
  const ceres::GradientProblem problem(new BalanceDual(std::move(wrenches)));
  ceres::GradientProblemSolver::Options options;
  options.line_search_direction_type = ceres::BFGS;
  options.max_num_iterations = 1000;
  options.function_tolerance = 0.0;
  options.gradient_tolerance = 1e-9;
  options.logging_type = ceres::SILENT;
  ceres::GradientProblemSolver::Summary summary;
  ceres::Solve(options, problem, y.data(), &summary);
  return 0.5 * y.squaredNorm();
}

double SupportedDirections(const std::vector<ProtocolContact>& contacts, double radius_m) {
  constexpr int kDirections = 512, kEdges = 8;
  constexpr double kFriction = 0.1, kMinSupport = 0.01;
  std::vector<Vector6d> wrenches;
  for (const ProtocolContact& contact : contacts) {
    const auto [u, v] = Across(contact.into);
    for (int edge = 0; edge <= kEdges; ++edge) {  // the last is the axis
      const double angle = 2.0 * std::numbers::pi * edge / kEdges;
      const double friction = edge < kEdges ? kFriction : 0.0;
      const Eigen::Vector3d force =
          (contact.into + friction * (std::cos(angle) * u + std::sin(angle) * v)).normalized();
      wrenches.emplace_back() << force, contact.point.cross(force) / radius_m;
    }
  }
  std::mt19937_64 random(0);
  const auto uniform = [&] { return (static_cast<double>(random() >> 11) + 0.5) * 0x1p-53; };
  int supported = 0;
  for (int k = 0; k < kDirections; ++k) {
    Vector6d direction;
    for (double& value : direction) {  // normal draws (Box & Muller 1958)
      const double radius = std::sqrt(-2.0 * std::log(uniform()));
      value = radius * std::cos(2.0 * std::numbers::pi * uniform());
    }
    direction.normalize();
    supported += std::ranges::any_of(
        wrenches, [&](const Vector6d& wrench) { return direction.dot(wrench) > kMinSupport; });
  }
  return static_cast<double>(supported) / kDirections;
}

MetricValues ScoreByProtocol(const ClipScene& scene, const ClipScore& score, ScoreProtocol protocol,
                             int threads, const std::function<bool(int, int)>& progress) {
  MetricValues values;
  for (const MetricDefinition& metric : ProtocolMetrics(protocol)) values[metric.key];
  if (protocol == ScoreProtocol::kNone || GraspsOf(score.hands, 1).empty()) return values;
  const auto measure = [&](const auto& of_grasp) {
    return MeasureGrasps(scene, score, threads, progress, of_grasp);
  };
  const TriangleMesh& object = *scene.object;
  const SignedDistance distance(object);
  const double size_m = (distance.Max() - distance.Min()).maxCoeff();
  if (size_m > kMaxObject_m) {
    throw Error(scene.object_source,
                fmt::format("is {:.3g} m long, too large for the voxels of a grasp", size_m),
                "Give its unit with --object-scale, or score without --protocol");
  }
  if (protocol == ScoreProtocol::kGrab) {
    const Eigen::Matrix3Xd shell = SurfaceVoxels(object, kShellVoxel_m);
    const std::vector<Measures> rows = measure([&](const PosedGrasp& grasp) {
      return std::vector{VoxelsInside_cm3(shell, kShellVoxel_m, grasp.closed)};
    });
    if (rows.empty()) return values;
    values["grab_volume_cm3"] = Mean(rows[0]);
    ScoreGrab(score, values);
  } else if (protocol == ScoreProtocol::kDexGraspNet) {
    const Eigen::Matrix3Xd points = FarthestPoints(object, kObjectPoints);
    const std::vector<Measures> rows = measure([&](const PosedGrasp& grasp) {
      const Eigen::ArrayXd depth = (-grasp.closed.distance.Distances(points)).cwiseMax(0.0);
      return std::vector{depth.sum(), 1e3 * depth.maxCoeff()};
    });
    if (rows.empty()) return values;
    values["dexgraspnet_penetration_sum_m"] = Mean(rows[0]);
    values["dexgraspnet_penetration_max_mm"] = Mean(rows[1]);
    values["dexgraspnet_penetration_ok_ratio"] = Share(rows[0], [](double m) { return m < 1e-3; });
    if (const auto trial = Trial(scene, DexGraspNetsTrial(), threads)) {
      const auto held = std::ranges::count_if(trial->directions, &TrialCourse::touches);
      values["dexgraspnet_directions"] = static_cast<double>(held);
      values["dexgraspnet_simulated_ratio"] = held == kTrialDirections ? 1.0 : 0.0;
      values["dexgraspnet_valid_ratio"] = held == kTrialDirections && rows[0][0] < 1e-3 ? 1.0 : 0.0;
    }
  } else if (protocol == ScoreProtocol::kGraspQp) {
    const Eigen::Vector3d center = SampleSurface(object, kObjectPoints).rowwise().mean();
    const std::vector<Measures> rows = measure([&](const PosedGrasp& grasp) {
      return std::vector{GraspQpValue(ContactsOf(grasp, distance, 5e-3), center)};
    });
    if (rows.empty()) return values;
    if (std::isfinite(Mean(rows[0]))) values["graspqp_closure"] = Mean(rows[0]);
    if (const auto trial = Trial(scene, GraspQpsTrial(), threads)) {
      int axes = 0;
      for (int axis = 0; axis < kTrialDirections; axis += 2) {
        axes += trial->directions[axis].holds && trial->directions[axis + 1].holds;
      }
      values["graspqp_any_axis_ratio"] = axes > 0 ? 1.0 : 0.0;
      values["graspqp_all_axes_ratio"] = axes == kTrialDirections / 2 ? 1.0 : 0.0;
    }
  } else if (protocol == ScoreProtocol::kContactOpt) {
    const Eigen::Matrix3Xd solid = SolidVoxels(distance, kSolidVoxel_m);
    const std::vector<Measures> rows = measure([&](const PosedGrasp& grasp) {
      const Eigen::ArrayXd apart = distance.Distances(SampleSurface(grasp.open, kHandPoints));
      return std::vector{VoxelsInside_cm3(solid, kSolidVoxel_m, grasp.closed),
                         (apart.abs() <= 2e-3).cast<double>().mean()};
    });
    if (rows.empty()) return values;
    values["contactopt_volume_cm3"] = Mean(rows[0]);
    values["contactopt_coverage_ratio"] = Mean(rows[1]);
  } else if (protocol == ScoreProtocol::kV2d) {
    const double radius = std::sqrt(object.vertices.colwise().squaredNorm().maxCoeff());
    const std::vector<Measures> rows = measure([&](const PosedGrasp& grasp) {
      return std::vector{SupportedDirections(ContactsOf(grasp, distance, 1e-2), radius)};
    });
    if (rows.empty()) return values;
    double deepest_cm = 0.0;
    for (const HandObjectScore& hand : score.hands) {
      for (std::size_t t = 0; t < hand.frames.size(); t += 3) {
        deepest_cm = std::max(deepest_cm, 0.1 * hand.frames[t].hand.max_penetration_mm);
      }
    }
    values["v2d_penetration_cm"] = deepest_cm;
    values["v2d_penetration_ok_ratio"] = deepest_cm <= 2.0 ? 1.0 : 0.0;
    values["v2d_force_closure_ratio"] = Mean(rows[0]);
    if (score.reference) CompareObjectPath(*score.reference, values);
  }
  return values;
}

std::vector<MetricDefinition> ProtocolMetrics(ScoreProtocol protocol) {
  using enum MetricDefinition::Worse;
  std::vector<MetricDefinition> list;
  const auto add = [&](const char* key, const char* label, const char* unit, int digits,
                       MetricDefinition::Worse worse, const char* definition) {
    list.push_back({key, label, unit, digits, worse, MetricDefinition::Group::kProtocol, false,
                    true, definition});
  };
  switch (protocol) {
    case ScoreProtocol::kNone:
      break;
    case ScoreProtocol::kGrab:
      add("grab_volume_cm3", "GRAB: volume of the shell", "cm3", 3, kHigher,
          "mean over grasps of the volume of the 5 mm voxels of the object's surface whose centers "
          "are inside the hand, closed at the wrist (Hasson et al. 2019, obman_train)");
      add("grab_depth_cm", "GRAB: depth", "cm", 3, kHigher,
          "mean over grasps of the maximum depth of hand vertices below the object's surface, 0 if "
          "none is inside (obman_train)");
      add("grab_contact_ratio", "GRAB: grasps in contact", "%", 1, kLower,
          "share of grasps with a hand vertex inside the object or within 5 mm (GraspTTA)");
      break;
    case ScoreProtocol::kDexGraspNet:
      add("dexgraspnet_penetration_sum_m", "DexGraspNet: E_pen", "m", 5, kHigher,
          "mean over grasps of the sum of depths, in the hand, of 2,000 farthest points of the "
          "object's surface");
      add("dexgraspnet_penetration_max_mm", "DexGraspNet: depth", "mm", 2, kHigher,
          "mean over grasps of the maximum depth of these points (UniDexGrasp)");
      add("dexgraspnet_penetration_ok_ratio", "DexGraspNet: E_pen below 1 mm", "%", 1, kLower,
          "share of grasps with E_pen below 0.001 m");
      add("dexgraspnet_directions", "DexGraspNet: directions held", "", 0, kLower,
          "directions of gravity, of six along the object's axes, after which the hand still "
          "touches the object: 100 steps of 1/60 s, friction 3, density 500 kg/m3; in MuJoCo");
      add("dexgraspnet_simulated_ratio", "DexGraspNet: held in all six", "%", 1, kLower,
          "1 if the hand touches it after all six, else 0");
      add("dexgraspnet_valid_ratio", "DexGraspNet: valid", "%", 1, kLower,
          "1 if it is held in all six and E_pen of the first grasp is below 0.001 m, else 0");
      break;
    case ScoreProtocol::kGraspQp:
      add("graspqp_closure", "GraspQP: force closure", "", 4, kHigher,
          "mean over grasps of 0.5 |F x|^2 at the x in [1, 21] that minimizes it: 0 if the "
          "contacts within 5 mm, one for each hand part, balance each other; undefined if a grasp "
          "has none");
      add("graspqp_any_axis_ratio", "GraspQP: held along an axis", "%", 1, kLower,
          "1 if the object stays within 3 cm under 3 N along both directions of at least one of "
          "its three axes (0.2 kg, friction 1, 0.5 s each, no gravity; in MuJoCo), else 0");
      add("graspqp_all_axes_ratio", "GraspQP: held along all axes", "%", 1, kLower,
          "1 if it stays along both directions of all three, else 0");
      break;
    case ScoreProtocol::kContactOpt:
      add("contactopt_volume_cm3", "ContactOpt: volume", "cm3", 3, kHigher,
          "mean over grasps of the volume of the solid object's 2 mm voxels whose centers are "
          "inside the hand, closed at the wrist");
      add("contactopt_coverage_ratio", "ContactOpt: coverage", "%", 1, kLower,
          "mean over grasps of the share of 5,000 points of the hand's skin within 2 mm of the "
          "object's surface, on either side");
      break;
    case ScoreProtocol::kV2d:
      add("v2d_penetration_cm", "video_to_data: depth", "cm", 2, kHigher,
          "maximum depth of hand vertices in the object over every third frame");
      add("v2d_penetration_ok_ratio", "video_to_data: depth passes", "%", 0, kLower,
          "1 if this depth is at most 2 cm, else 0");
      add("v2d_force_closure_ratio", "video_to_data: force closure", "%", 1, kLower,
          "mean over grasps of the share of 512 directions of the wrench space in which the "
          "contacts within 1 cm support more than 0.01 (friction 0.1, torques over the object's "
          "radius)");
      add("v2d_sp_success_ratio", "video_to_data: SP-SR", "%", 0, kLower,
          "1 if the object's mean errors to the reference are at most 0.1 m and 0.5 rad, else 0");
      add("v2d_mt_success_ratio", "video_to_data: MT-SR", "%", 0, kLower,
          "1 if they are below 0.03 m and 30 degrees, else 0");
      add("v2d_add_auc_ratio", "video_to_data: ADD-AUC", "%", 1, kLower,
          "area under the curve of the fraction of frames with ADD below a threshold from 1 to 9 "
          "cm, divided by 8 cm");
      break;
  }
  return list;
}

}  // namespace holdfast
