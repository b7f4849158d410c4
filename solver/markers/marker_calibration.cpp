// SPDX-License-Identifier: MIT
#include "solver/markers/marker_calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include <ceres/normal_prior.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include "generator/body/limb_ik.h"
#include "geometry/mesh/nearest.h"
#include "geometry/rotation.h"
#include "solver/markers/marker_world.h"
#include "solver/terms/body/marker_terms.h"
#include "solver/terms/body/posture_terms.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast {
namespace {

constexpr double kUpright = 0.15;  // radians, of a pelvis without markers
constexpr double kWide_m = 0.15;   // robust scale while searching for a pose

enum class ArmStart { kForward, kHanging, kBent, kSideways };

void SetArms(ArmStart start, JointPose& pose) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const bool right = side == Side::kRight;
    const double sign = right ? 1.0 : -1.0;
    const int shoulder = right ? kRightShoulder : kLeftShoulder;
    Eigen::Vector3d turn = Eigen::Vector3d::Zero(), elbow = Eigen::Vector3d::Zero();
    if (start == ArmStart::kForward) turn.y() = sign * 90.0 * kDegree;
    if (start == ArmStart::kHanging || start == ArmStart::kBent) turn.z() = sign * 75.0 * kDegree;
    if (start == ArmStart::kBent) elbow = Arm(side).hinge * 80.0 * kDegree;
    pose.col(shoulder) = turn;
    pose.col(shoulder + 2) = elbow;
  }
}

// Unknowns of the calibration, and problems over subsets of them.
class Calibrator {
 public:
  explicit Calibrator(const MarkedPerson& person) : person_(person) {
    betas_.setZero(person.body.NumShape());
    places_ = person.usual;
    for (const MarkerSite& site : person.sites) place_sigma_.push_back(site.sigma_m);
  }

  Eigen::VectorXd& Betas() { return betas_; }
  Eigen::VectorXd& Places() { return places_; }
  int Iterations() const { return iterations_; }

  // Solves root and pose with fixed shape and places; if not `known`, places are uncertain.
  double SolvePose(SeenMarkers seen, bool root_free, bool known, double robust_m,
                   Eigen::VectorXd& root, Eigen::VectorXd& q) {
    for (int k = 0; k < seen.Count(); ++k) {
      const double place = known ? 0.0 : place_sigma_[seen.marker[k]];
      seen.sigma_m[k] = std::hypot(kMarkerResidual_m, place);
    }
    ceres::Problem problem;
    AddFrame(problem, std::move(seen), robust_m, root, q);
    problem.SetParameterBlockConstant(betas_.data());
    for (int m = 0; m < person_.body.NumMarkers(); ++m) {
      double* const place = places_.data() + 3 * m;
      if (problem.HasParameterBlock(place)) problem.SetParameterBlockConstant(place);
    }
    if (root_free) {
      AddUpright(problem, root);
    } else {
      problem.SetParameterBlockConstant(root.data());
    }
    return Solve(problem, ceres::DENSE_NORMAL_CHOLESKY, 40);
  }

  // Solves all frames' unknowns with shape and places; frames may share a root.
  double SolveAll(const std::vector<SeenMarkers>& frames,
                  const std::vector<Eigen::VectorXd*>& roots,
                  const std::vector<Eigen::VectorXd*>& poses, double robust_m, int iterations) {
    ceres::Problem problem;
    for (std::size_t f = 0; f < frames.size(); ++f) {
      SeenMarkers seen = frames[f];
      std::ranges::fill(seen.sigma_m, kMarkerResidual_m);
      AddFrame(problem, std::move(seen), robust_m, *roots[f], *poses[f]);
      if (f == 0 || roots[f] != roots[f - 1]) AddUpright(problem, *roots[f]);
    }
    for (int m = 0; m < person_.body.NumMarkers(); ++m) {
      problem.AddResidualBlock(
          new MarkerPlacePrior(person_.usual.segment<3>(3 * m),
                               person_.J_usual.middleRows(3 * m, 3), place_sigma_[m]),
          nullptr, betas_.data(), places_.data() + 3 * m);
    }
    for (int m = 0; m < person_.body.NumMarkers(); ++m) {
      const SkinPatch& patch = person_.skin[m];
      if (patch.faces.cols() == 0) continue;
      problem.AddResidualBlock(new MarkerOnSkin(patch, kOnSkinSigma_m), nullptr, betas_.data(),
                               &height_, places_.data() + 3 * m);
    }
    if (problem.HasParameterBlock(&height_)) {
      problem.AddResidualBlock(
          new ceres::NormalPrior(Eigen::Matrix<double, 1, 1>(1.0 / kMarkerHeightSigma_m),
                                 Eigen::Matrix<double, 1, 1>(kMarkerHeight_m)),
          nullptr, &height_);
    }
    const int shapes = person_.body.NumShape();
    problem.AddResidualBlock(new ceres::NormalPrior(Eigen::MatrixXd::Identity(shapes, shapes),
                                                    Eigen::VectorXd::Zero(shapes)),
                             nullptr, betas_.data());
    return Solve(problem, ceres::SPARSE_NORMAL_CHOLESKY, iterations);
  }

 private:
  void AddFrame(ceres::Problem& problem, SeenMarkers seen, double robust_m, Eigen::VectorXd& root,
                Eigen::VectorXd& q) {
    for (SeenMarkers& of_joint : ByJoint(person_.body, seen)) {
      auto* const distance = new MarkerDistance(person_.body, std::move(of_joint), robust_m);
      problem.AddResidualBlock(
          distance, nullptr,
          distance->Blocks(root.data(), q.data(), betas_.data(), places_.data()));
    }
    const std::vector<FreePose::Part> parts = person_.body.free.Parts();
    std::vector<std::unique_ptr<PoseRest>> rest = person_.RestTerms();
    for (std::size_t k = 0; k < parts.size(); ++k) {
      problem.AddResidualBlock(rest[k].release(), nullptr, q.data() + parts[k].column);
    }
  }
  void AddUpright(ceres::Problem& problem, Eigen::VectorXd& root) const {
    if (!person_.pelvis_marked) {
      problem.AddResidualBlock(new PelvisUpright(kUpright), nullptr, root.data());
    }
  }
  double Solve(ceres::Problem& problem, ceres::LinearSolverType type, int iterations) {
    ceres::Solver::Options options = SparseOptions(iterations, 1e-4);
    options.linear_solver_type = type;
    options.parameter_tolerance = 1e-5;
    const ceres::Solver::Summary summary = SolveQuietly(options, problem);
    iterations_ += static_cast<int>(summary.iterations.size());
    return summary.final_cost;
  }

  const MarkedPerson& person_;
  Eigen::VectorXd betas_, places_;
  std::vector<double> place_sigma_;
  double height_ = kMarkerHeight_m;  // of markers on the skin
  int iterations_ = 0;
};

// Finds the pose of a frame without an initial guess: the best of several arm and free leg starts.
void FindPose(const MarkedPerson& person, const SeenMarkers& seen, double facing_rad, bool known,
              Calibrator& calibrator, Eigen::VectorXd& root, Eigen::VectorXd& q) {
  double best = std::numeric_limits<double>::infinity();
  for (const ArmStart start :
       {ArmStart::kForward, ArmStart::kBent, ArmStart::kHanging, ArmStart::kSideways}) {
    for (const bool sits : {false, true}) {
      JointPose pose = person.body.free.Rest();
      SetArms(start, pose);
      if (sits && person.body.free.Column(kLeftHip) < 0 && person.body.free.Column(kRightHip) < 0) {
        break;
      }
      for (const int hip : {kLeftHip, kRightHip}) {
        if (!sits || person.body.free.Column(hip) < 0) continue;
        pose(0, hip) = -90.0 * kDegree;
        pose(0, hip + kLeftKnee - kLeftHip) = 90.0 * kDegree;
      }
      Eigen::VectorXd at = RootAt(person, seen, facing_rad), candidate = person.body.free.Of(pose);
      const double cost = calibrator.SolvePose(seen, true, known, kWide_m, at, candidate);
      if (!(cost < best)) continue;
      best = cost;
      root = at;
      q = candidate;
    }
  }
}

}  // namespace

MarkerCalibration CalibrateMarkers(MarkedPerson& person,
                                   const std::vector<SeenMarkers>& static_frames,
                                   const std::vector<SeenMarkers>& trial_frames,
                                   double static_facing_rad, double trial_facing_rad) {
  Calibrator calibrator(person);
  MarkerCalibration calibration;
  std::vector<SeenMarkers> frames = static_frames;
  frames.insert(frames.end(), trial_frames.begin(), trial_frames.end());
  const std::size_t still = static_frames.size();
  std::vector<Eigen::VectorXd> poses(frames.size());
  Eigen::VectorXd still_root = Eigen::VectorXd::Zero(6), trial_root = still_root;
  std::vector<Eigen::VectorXd> moving_roots(trial_frames.size(), trial_root);
  const auto root_of = [&](std::size_t f) -> Eigen::VectorXd& {
    if (f < still) return still_root;
    return person.pelvis_marked ? moving_roots[f - still] : trial_root;
  };
  const auto solve = [&](std::size_t begin, std::size_t end, double robust_m, int iterations) {
    std::vector<Eigen::VectorXd*> roots, qs;
    for (std::size_t f = begin; f < end; ++f) {
      roots.push_back(&root_of(f));
      qs.push_back(&poses[f]);
    }
    calibrator.SolveAll({frames.begin() + static_cast<std::ptrdiff_t>(begin),
                         frames.begin() + static_cast<std::ptrdiff_t>(end)},
                        roots, qs, robust_m, iterations);
  };

  // Initialize shape and places from the static trial, or from one frame.
  if (still > 0) {
    FindPose(person, frames[0], static_facing_rad, false, calibrator, still_root, poses[0]);
    for (std::size_t f = 1; f < still; ++f) poses[f] = poses[0];
    solve(0, still, kWide_m, 30);
    solve(0, still, kMarkerRobust_m, 20);
  }
  FindPose(person, frames[still], trial_facing_rad, still > 0, calibrator, root_of(still),
           poses[still]);
  for (std::size_t f = still + 1; f < frames.size(); ++f) {
    poses[f] = poses[f - 1];
    if (person.pelvis_marked) root_of(f) = root_of(f - 1);
    calibrator.SolvePose(frames[f], person.pelvis_marked, still > 0, kWide_m, root_of(f), poses[f]);
  }
  if (still == 0) solve(0, frames.size(), kWide_m, 30);
  person.BlendAt(calibrator.Places());
  solve(0, frames.size(), kMarkerRobust_m, 25);

  calibration.betas = calibrator.Betas();
  calibration.places =
      Eigen::Map<const Eigen::Matrix3Xd>(calibrator.Places().data(), 3, person.body.NumMarkers());
  for (std::size_t f = still; f < frames.size(); ++f) {
    calibration.roots.push_back(root_of(f));
    calibration.poses.push_back(poses[f]);
  }
  calibration.iterations = calibrator.Iterations();
  return calibration;
}

std::vector<SkinPlace> PlacesOnSkin(const MarkedPerson& person,
                                    const MarkerCalibration& calibration) {
  const BodySurface surface(person.model, calibration.betas);
  const Eigen::Matrix3Xd& vertices = surface.RestVertices();
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, vertices.cols());
  for (Eigen::Index f = 0; f < surface.Faces().cols(); ++f) {
    const Eigen::Vector3i c = surface.Faces().col(f);
    const Eigen::Vector3d n =
        (vertices.col(c(1)) - vertices.col(c(0))).cross(vertices.col(c(2)) - vertices.col(c(0)));
    for (const int corner : c) normals.col(corner) += n;
  }
  const NearestPoints nearest(vertices);
  std::vector<SkinPlace> places;
  for (int k = 0; k < person.body.NumMarkers(); ++k) {
    const Eigen::Vector3d x =
        surface.RestJoints().col(person.body.joint[k]) + calibration.places.col(k);
    SkinPlace place;
    place.vertex = nearest.Nearest(x).id;
    place.height_m = (x - vertices.col(place.vertex)).dot(normals.col(place.vertex).normalized());
    places.push_back(place);
  }
  return places;
}

}  // namespace holdfast
