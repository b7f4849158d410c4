// SPDX-License-Identifier: MIT
#include "solver/fit.h"

#include <chrono>

#include <ceres/problem.h>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/rotation_manifold.h"
#include "solver/terms/temporal.h"

namespace holdfast {

std::string_view StopReasonName(StopReason reason) {
  switch (reason) {
    case StopReason::kGiven:
      return "given";
    case StopReason::kConverged:
      return "converged";
    case StopReason::kIterationLimit:
      return "iteration_limit";
    case StopReason::kFailed:
      return "failed";
  }
  return "unknown";
}

ceres::Solver::Options FrameSolverOptions(const FitOptions& options) {
  ceres::Solver::Options solver_options;
  solver_options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver_options.max_num_iterations = options.max_iterations;
  solver_options.parameter_tolerance = options.step_tolerance;
  solver_options.function_tolerance = options.function_tolerance;
  solver_options.num_threads = 1;
  solver_options.logging_type = ceres::SILENT;
  return solver_options;
}

ObjectPose FollowWrist(const ObjectPose& object, const WristPose& from, const WristPose& to) {
  const Eigen::Matrix3d turn = to.rotation * from.rotation.transpose();
  return {(Eigen::Quaterniond(turn) * object.orientation).normalized(),
          turn * (object.translation - from.position) + to.position};
}

FrameFitter::FrameFitter(const HandModel& hand, const Eigen::Matrix3Xd& object_vertices,
                         const JointPose& first_pose, const Eigen::Vector3d& first_trans,
                         const ObjectPose& first_object, const FitOptions& options)
    : options_(options),
      state_(hand),
      object_(first_object),
      fingers_(FingersOf(first_pose, hand.HandSide())) {
  state_.SetBody(first_pose, first_trans);
  state_.Evaluate(fingers_, false);
  wrist_ = {state_.WristRotation(), state_.WristPosition()};
  const Eigen::Matrix3Xd z =
      InObjectFrame(state_.Vertices(), object_.orientation, object_.translation);
  const Eigen::MatrixXd distances = HandObjectDistance::Distances(z, object_vertices);
  distance_ = std::make_unique<HandObjectDistance>(object_vertices, distances,
                                                   options.lambda_distance, options.precision);
  contact_ = std::make_unique<Contact>(object_vertices, distances, options.contact_threshold_m,
                                       options.lambda_contact);
  block_ = std::make_unique<HandObjectBlock>(&state_);
  block_->AddTerm(distance_.get());
  block_->AddTerm(contact_.get());
  FillEnergies(object_, fingers_, first_);
}

FrameFitter::~FrameFitter() = default;

FrameReport FrameFitter::Solve(const JointPose& pose, const Eigen::Vector3d& trans) {
  const auto begin = std::chrono::steady_clock::now();
  const ObjectPose previous_object = object_;
  const FingerPose previous_fingers = fingers_;

  state_.SetBody(pose, trans);
  const WristPose wrist{state_.WristRotation(), state_.WristPosition()};
  object_ = FollowWrist(previous_object, wrist_, wrist);
  wrist_ = wrist;
  const ObjectPose start = object_;

  Temporal temporal(previous_object.orientation, previous_object.translation, previous_fingers,
                    options_.lambda_temporal);
  RotationManifold manifold;
  ceres::Problem::Options problem_options;
  problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  double* q = object_.orientation.coeffs().data();
  double* t = object_.translation.data();
  double* p = fingers_.data();
  problem.AddParameterBlock(q, 4, &manifold);
  block_->Invalidate();
  problem.AddResidualBlock(block_.get(), nullptr, q, t, p);
  problem.AddResidualBlock(&temporal, nullptr, q, t, p);

  ceres::Solver::Summary summary;
  ceres::Solve(FrameSolverOptions(options_), &problem, &summary);

  FrameReport report;
  report.iterations = summary.num_successful_steps + summary.num_unsuccessful_steps;
  if (summary.termination_type == ceres::CONVERGENCE) {
    report.stop = StopReason::kConverged;
  } else if (summary.IsSolutionUsable()) {
    report.stop = StopReason::kIterationLimit;
  } else {
    report.stop = StopReason::kFailed;
    object_ = start;
    fingers_ = previous_fingers;
  }
  FillEnergies(previous_object, previous_fingers, report);
  report.solve_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

void FrameFitter::FillEnergies(const ObjectPose& previous_object,
                               const FingerPose& previous_fingers, FrameReport& report) {
  const double* parameters[] = {object_.orientation.coeffs().data(), object_.translation.data(),
                                fingers_.data()};
  const std::vector<double>& energies = block_->Energies(parameters);  // in the order added
  report.energy_distance = energies[0];
  report.energy_contact = energies[1];
  report.energy_temporal =
      Temporal::Energy(previous_object.orientation, previous_object.translation, previous_fingers,
                       object_.orientation, object_.translation, fingers_);
  report.energy_total = options_.lambda_distance * report.energy_distance +
                        options_.lambda_contact * report.energy_contact +
                        options_.lambda_temporal * report.energy_temporal;
}

FitResult FitClip(const Clip& clip, const HandModel& hand, const Eigen::Matrix3Xd& object_vertices,
                  const FitOptions& options, const std::function<bool(int, int)>& progress) {
  if (!clip.object) {
    throw Error("clip", "has no object: its first frame must hold one",
                "Make a grasp first, or give a clip with object_trans and object_orient");
  }
  if (object_vertices.cols() == 0) {
    throw Error("object", "has no vertices", "Give a mesh with a surface");
  }
  const int frames = clip.NumFrames();
  FitResult result{clip, {}, 0};
  ObjectTrack& track = *result.clip.object;
  const ObjectPose first{Eigen::Quaterniond(ExpSO3(track.orient.col(0))), track.trans.col(0)};
  FrameFitter fitter(hand, object_vertices, clip.pose[0], clip.trans.col(0), first, options);
  result.num_contact_pairs = fitter.NumContactPairs();
  result.frames.push_back(fitter.FirstFrame());
  int done = 1;
  for (; done < frames; ++done) {
    if (progress && !progress(done, frames)) break;
    result.frames.push_back(fitter.Solve(clip.pose[done], clip.trans.col(done)));
    track.trans.col(done) = fitter.Object().translation;
    track.orient.col(done) = UnwrapAxisAngle(LogSO3(fitter.Object().orientation.toRotationMatrix()),
                                             track.orient.col(done - 1));
    SetFingers(result.clip.pose[done], hand.HandSide(), fitter.Fingers());
  }
  const std::uint8_t bit = hand.HandSide() == Side::kRight ? kHoldsRight : kHoldsLeft;
  result.clip.holding_hand.assign(frames, bit);
  if (done < frames) result.clip = Slice(result.clip, 0, done);
  if (progress) progress(done, frames);
  return result;
}

}  // namespace holdfast
