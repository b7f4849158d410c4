// SPDX-License-Identifier: MIT
#include "solver/markers/marker_track.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <ceres/normal_prior.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include "geometry/conventions/hand_evidence.h"
#include "solver/terms/body/posture_terms.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast {
namespace {

constexpr double kOutlier_m = 0.03;  // and farther than six times the marker's median
constexpr double kSwap_m = 0.02;  // for both; each at most half as far from the other's prediction

// Distance of each seen marker from its predicted position.
std::vector<std::vector<double>> Distances(const Eigen::MatrixXd& carried,
                                           const std::vector<SeenMarkers>& frames) {
  std::vector<std::vector<double>> off(frames.size());
  for (std::size_t t = 0; t < frames.size(); ++t) {
    for (int k = 0; k < frames[t].Count(); ++k) {
      off[t].push_back(
          (frames[t].place.col(k) - carried.block<3, 1>(3 * frames[t].marker[k], t)).norm());
    }
  }
  return off;
}

// Adds the terms of a frame's markers; `terms` keeps ownership.
void AddMarkers(const MarkedPerson& person, const SeenMarkers& seen, double robust_m, double* root,
                double* q, Eigen::VectorXd& betas, Eigen::Matrix3Xd& places,
                std::vector<std::unique_ptr<MarkerDistance>>& terms, ceres::Problem& problem) {
  for (SeenMarkers& of_joint : ByJoint(person.body, seen)) {
    std::ranges::fill(of_joint.sigma_m, kMarkerResidual_m);
    terms.push_back(std::make_unique<MarkerDistance>(person.body, std::move(of_joint), robust_m));
    problem.AddResidualBlock(terms.back().get(), nullptr,
                             terms.back()->Blocks(root, q, betas.data(), places.data()));
  }
}

// Holds shape and marker positions constant.
void HoldCalibration(Eigen::VectorXd& betas, Eigen::Matrix3Xd& places, ceres::Problem& problem) {
  if (problem.HasParameterBlock(betas.data())) problem.SetParameterBlockConstant(betas.data());
  for (Eigen::Index k = 0; k < places.cols(); ++k) {
    double* const place = places.col(k).data();
    if (problem.HasParameterBlock(place)) problem.SetParameterBlockConstant(place);
  }
}

}  // namespace

MarkerTrack FollowMarkers(const MarkedPerson& person, const MarkerCalibration& calibration,
                          const std::vector<SeenMarkers>& frames, MarkerTrack start) {
  constexpr double kStep_rad = 0.5;     // of a joint between frames
  constexpr double kFollowed_m = 0.15;  // robust scale: a step may be large
  MarkerTrack track = std::move(start);
  Eigen::VectorXd betas = calibration.betas;
  Eigen::Matrix3Xd places = calibration.places;
  const std::vector<FreePose::Part> parts = person.body.free.Parts();
  const std::vector<std::unique_ptr<PoseRest>> rest = person.RestTerms();
  ceres::Solver::Options options = SparseOptions(15, 1e-3);
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const auto column = static_cast<Eigen::Index>(t);
    if (t > 0) {
      track.poses.col(column) = track.poses.col(column - 1);
      if (person.pelvis_marked) track.roots.col(column) = track.roots.col(column - 1);
    }
    if (frames[t].Count() == 0) continue;
    double* const q = track.poses.col(column).data();
    double* const root = track.roots.col(column).data();
    ceres::Problem problem(BorrowingProblem());
    std::vector<std::unique_ptr<ceres::CostFunction>> steps;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      problem.AddResidualBlock(rest[k].get(), nullptr, q + parts[k].column);
      const Eigen::Index n = parts[k].size;
      steps.push_back(std::make_unique<ceres::NormalPrior>(
          Eigen::MatrixXd::Identity(n, n) / kStep_rad,
          Eigen::VectorXd(track.poses.col(column).segment(parts[k].column, n))));
      problem.AddResidualBlock(steps.back().get(), nullptr, q + parts[k].column);
    }
    std::vector<std::unique_ptr<MarkerDistance>> distances;
    AddMarkers(person, frames[t], kFollowed_m, root, q, betas, places, distances, problem);
    HoldCalibration(betas, places, problem);
    if (!person.pelvis_marked) problem.SetParameterBlockConstant(root);
    track.iterations += static_cast<int>(SolveQuietly(options, problem).iterations.size());
  }
  return track;
}

MarkerTrack TrackMarkers(const MarkedPerson& person, const MarkerCalibration& calibration,
                         const std::vector<SeenMarkers>& frames, double frame_rate,
                         MarkerTrack start, int max_iterations,
                         const std::function<bool(int, int)>& progress) {
  MarkerTrack track = std::move(start);
  Eigen::VectorXd betas = calibration.betas;
  Eigen::Matrix3Xd places = calibration.places;
  const bool moves = person.pelvis_marked;
  Eigen::VectorXd still = track.roots.col(0);
  ceres::Problem problem(BorrowingProblem());
  const double step2 = 1.0 / (frame_rate * frame_rate);
  const std::vector<FreePose::Part> parts = person.body.free.Parts();
  const std::vector<std::unique_ptr<PoseRest>> rest = person.RestTerms();
  std::vector<std::unique_ptr<PoseAcceleration>> acceleration;
  for (const auto& [column, size] : parts) {
    acceleration.push_back(
        std::make_unique<PoseAcceleration>(person.acceleration.segment(column, size) * step2));
  }
  Eigen::VectorXd root_sigma(6);
  root_sigma << Eigen::Vector3d::Constant(10.0), Eigen::Vector3d::Constant(30.0);
  PoseAcceleration root_acceleration(root_sigma * step2);
  std::vector<std::unique_ptr<MarkerDistance>> distances;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const auto q_at = [&](std::size_t frame) { return track.poses.col(frame).data(); };
    const auto root_at = [&](std::size_t frame) {
      return moves ? track.roots.col(frame).data() : still.data();
    };
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const int column = parts[k].column;
      problem.AddResidualBlock(rest[k].get(), nullptr, q_at(t) + column);
      if (t < 2) continue;
      problem.AddResidualBlock(acceleration[k].get(), nullptr, q_at(t - 2) + column,
                               q_at(t - 1) + column, q_at(t) + column);
    }
    if (t >= 2 && moves) {
      problem.AddResidualBlock(&root_acceleration, nullptr, root_at(t - 2), root_at(t - 1),
                               root_at(t));
    }
    AddMarkers(person, frames[t], kMarkerRobust_m, root_at(t), q_at(t), betas, places, distances,
               problem);
  }
  HoldCalibration(betas, places, problem);
  if (!moves && problem.HasParameterBlock(still.data())) {
    problem.SetParameterBlockConstant(still.data());
  }
  ceres::Solver::Options options = SparseOptions(max_iterations, 1e-4);
  StopWhenAsked stop(progress, max_iterations);
  options.callbacks.push_back(&stop);
  const ceres::Solver::Summary summary = SolveQuietly(options, problem);
  track.iterations += static_cast<int>(summary.iterations.size());
  track.converged =
      summary.termination_type != ceres::USER_FAILURE && summary.termination_type != ceres::FAILURE;
  return track;
}

Eigen::MatrixXd CarriedMarkers(const MarkedPerson& person, const MarkerCalibration& calibration,
                               const MarkerTrack& track) {
  const Eigen::Matrix3Xd joints = person.body.RestJoints(calibration.betas.data());
  Eigen::MatrixXd carried(3 * person.body.NumMarkers(), track.poses.cols());
  FreePoseState state;
  for (Eigen::Index t = 0; t < track.poses.cols(); ++t) {
    state.Evaluate(person.body.free, joints, track.roots.col(t).data(), track.poses.col(t).data(),
                   false);
    for (int k = 0; k < person.body.NumMarkers(); ++k) {
      carried.block<3, 1>(3 * k, t) =
          person.body.Carry(state.Body(), joints, k, calibration.places.col(k));
    }
  }
  return carried;
}

MarkerFaults RepairMarkers(const Eigen::MatrixXd& carried, std::vector<SeenMarkers>& frames) {
  MarkerFaults faults;
  std::vector<std::vector<double>> off = Distances(carried, frames);
  const auto at = [&](int marker, std::size_t t) -> Eigen::Vector3d {
    return carried.block<3, 1>(3 * marker, t);
  };
  for (std::size_t t = 0; t < frames.size(); ++t) {
    SeenMarkers& seen = frames[t];
    for (int i = 0; i < seen.Count(); ++i) {
      for (int j = i + 1; j < seen.Count(); ++j) {
        if (off[t][i] < kSwap_m || off[t][j] < kSwap_m) continue;
        const double crossed_i = (seen.place.col(j) - at(seen.marker[i], t)).norm(),
                     crossed_j = (seen.place.col(i) - at(seen.marker[j], t)).norm();
        if (2.0 * crossed_i > off[t][i] || 2.0 * crossed_j > off[t][j]) continue;
        seen.place.col(i).swap(seen.place.col(j));
        off[t][i] = crossed_i;
        off[t][j] = crossed_j;
        faults.swaps.push_back({static_cast<int>(t), seen.marker[i], seen.marker[j]});
      }
    }
  }
  std::vector<std::vector<double>> of_marker(static_cast<std::size_t>(carried.rows() / 3));
  for (std::size_t t = 0; t < frames.size(); ++t) {
    for (int k = 0; k < frames[t].Count(); ++k) {
      of_marker[frames[t].marker[k]].push_back(off[t][k]);
    }
  }
  std::vector<double> most;
  for (std::vector<double>& values : of_marker) {
    most.push_back(std::max(kOutlier_m, 6.0 * Median(std::move(values))));
  }
  for (std::size_t t = 0; t < frames.size(); ++t) {
    SeenMarkers kept;
    kept.place.resize(3, frames[t].place.cols());
    for (int k = 0; k < frames[t].Count(); ++k) {
      const int marker = frames[t].marker[k];
      if (off[t][k] > most[marker]) {
        faults.outliers.push_back({static_cast<int>(t), marker, off[t][k]});
        continue;
      }
      kept.place.col(kept.Count()) = frames[t].place.col(k);
      kept.marker.push_back(marker);
      kept.sigma_m.push_back(frames[t].sigma_m[k]);
    }
    kept.place.conservativeResize(3, kept.Count());
    frames[t] = std::move(kept);
  }
  return faults;
}

}  // namespace holdfast
