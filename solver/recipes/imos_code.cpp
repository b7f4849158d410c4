// SPDX-License-Identifier: MIT
#include "solver/recipes/imos_code.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <ceres/problem.h>
#include <ceres/solver.h>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/fit/hand_object_block.h"
#include "solver/recipes/adam.h"
#include "solver/recipes/imos_finger_loss.h"
#include "solver/recipes/rotation_6d.h"
#include "solver/terms/hand/contact.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {
namespace {

// The fingers as the code's unknowns, and the loss's gradient with respect to them.
Eigen::VectorXd Fingers6d(const FingerPose& fingers) {
  Eigen::VectorXd x(6 * kJointsPerHand);
  for (int k = 0; k < kJointsPerHand; ++k) {
    x.segment<6>(6 * k) = To6d(ExpSO3(fingers.segment<3>(3 * k)));
  }
  return x;
}

FingerPose FromFingers6d(const Eigen::VectorXd& x) {
  FingerPose fingers;
  for (int k = 0; k < kJointsPerHand; ++k) {
    fingers.segment<3>(3 * k) = LogSO3(From6d(x.segment<6>(6 * k), nullptr));
  }
  return fingers;
}

Eigen::VectorXd Chain6d(const Eigen::VectorXd& x, const FingerPose& fingers,
                        const FingerPose& slope) {
  Eigen::VectorXd gradient(x.size());
  for (int k = 0; k < kJointsPerHand; ++k) {
    Eigen::Matrix<double, 3, 6> J_turn_x;
    From6d(x.segment<6>(6 * k), &J_turn_x);
    const Eigen::Matrix3d J_fingers_turn = InverseLeftJacobianSO3(fingers.segment<3>(3 * k));
    gradient.segment<6>(6 * k) = (J_fingers_turn * J_turn_x).transpose() * slope.segment<3>(3 * k);
  }
  return gradient;
}

// Second stage, one frame: the fingers after all steps but the last, which the code does not use.
FingerPose FitFingers(ImosFingerLoss& loss, const FingerPose& start, const ImosCodeOptions& options,
                      ReferenceAdam& adam) {
  Eigen::VectorXd x = Fingers6d(start);
  FingerPose fingers = start;
  double learning_rate = options.learning_rate;
  for (int step = 0; step < options.finger_steps; ++step) {
    fingers = FromFingers6d(x);
    FingerPose slope;
    loss.Evaluate(fingers, &slope);
    adam.Step(Chain6d(x, fingers, slope), learning_rate, x);
    learning_rate *= options.learning_rate_decay;
  }
  return fingers;
}

}  // namespace

int ImosReferenceFrame(const ObjectTrack& track, int given_frames) {
  constexpr double kMoved = 1e-3;
  for (int t = 1; t < given_frames; ++t) {
    if ((track.trans.col(t) - track.trans.col(0)).norm() >= kMoved) return t - 1;
  }
  return std::max(0, given_frames - 2);
}

Side ImosCodeSide(const Clip& clip) {
  const std::vector<std::uint8_t>& holding = clip.holding_hand;
  const auto right = [](std::uint8_t bits) { return (bits & kHoldsRight) != 0; };
  if (std::ranges::all_of(holding, right)) return Side::kRight;
  return holding.size() > 3 && right(holding[3]) ? Side::kRight : Side::kLeft;
}

int FitImosObject(HandState& state, const HandObjectDistance& distance,
                  const ImosCodeOptions& options, ObjectPose& pose) {
  const ObjectPose start = pose;
  FingerPose fingers = state.Fingers();
  HandObjectBlock block(&state);
  block.AddTerm(&distance);
  RotationManifold manifold;
  ceres::Problem::Options problem_options;
  problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  double* const q = pose.orientation.coeffs().data();
  problem.AddParameterBlock(q, 4, &manifold);
  problem.AddResidualBlock(&block, nullptr, q, pose.translation.data(), fingers.data());
  problem.SetParameterBlockConstant(fingers.data());
  ceres::Solver::Options solver_options;
  solver_options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver_options.max_num_iterations = options.max_iterations;
  solver_options.function_tolerance = options.tolerance;
  solver_options.parameter_tolerance = options.tolerance;
  solver_options.gradient_tolerance = options.tolerance;
  solver_options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options, &problem, &summary);
  if (!summary.IsSolutionUsable()) {
    pose = start;
    return -1;
  }
  return summary.num_successful_steps + summary.num_unsuccessful_steps;
}

FitResult FitClipImosCode(const Clip& clip, const HandModel& hand,
                          const Eigen::Matrix3Xd& object_vertices, const ImosCodeOptions& options,
                          const std::function<bool(int, int)>& progress) {
  if (!clip.object) {
    throw Error("clip", "has no object: its first frame must hold one",
                "Make a grasp first, or give a clip with object_trans and object_orient");
  }
  if (object_vertices.cols() == 0) {
    throw Error("object", "has no vertices", "Give a mesh with a surface");
  }
  const int frames = clip.NumFrames(), given = std::clamp(options.given_frames, 1, frames);
  const Side side = hand.HandSide();
  FitResult result{clip, {}, 0};
  ObjectTrack& track = *result.clip.object;
  const auto given_object = [&](int t) {
    return ObjectPose{Eigen::Quaterniond(ExpSO3(clip.object->orient.col(t))),
                      clip.object->trans.col(t)};
  };

  const int reference = ImosReferenceFrame(track, given);
  const FingerPose start = FingersOf(clip.pose[reference], side);
  HandState state(hand);
  state.SetBody(clip.pose[reference], clip.trans.col(reference));
  state.Evaluate(start, false);
  const ObjectPose held = given_object(reference);
  const Eigen::MatrixXd distances = HandObjectDistance::Distances(
      InObjectFrame(state.Vertices(), held.orientation, held.translation), object_vertices);
  const HandObjectDistance distance(object_vertices, distances, 1.0, PairPrecision::kDouble);
  const FitOptions paper = FitOptions{}.OnlyPaper();
  const Contact contact(object_vertices, distances, options.contact_threshold_m, 1.0);
  result.num_contact_pairs = contact.NumPairs();
  ReferenceAdam adam(6 * kJointsPerHand);

  ObjectPose object = given_object(0), object_before = object;
  FingerPose fingers = FingersOf(clip.pose[0], side), fingers_before = fingers;
  const auto fill_energies = [&](FrameReport& report) {
    HandObjectBlock block(&state);
    block.AddTerm(&distance);
    block.AddTerm(&contact);
    const double* parameters[] = {object.orientation.coeffs().data(), object.translation.data(),
                                  fingers.data()};
    const std::vector<double>& energies = block.Energies(parameters);
    report.energy_distance = energies[0];
    report.energy_contact = energies[1];
    report.energy_temporal =
        LogSO3((object_before.orientation.conjugate() * object.orientation).toRotationMatrix())
            .squaredNorm() +
        (object.translation - object_before.translation).squaredNorm() +
        (fingers - fingers_before).squaredNorm();
    report.energy_total = paper.lambda_distance * report.energy_distance +
                          paper.lambda_contact * report.energy_contact +
                          paper.lambda_temporal * report.energy_temporal;
  };

  int done = 0;
  for (; done < frames; ++done) {
    if (progress && done > 0 && !progress(done, frames)) break;
    const auto begin = std::chrono::steady_clock::now();
    FrameReport report;
    state.SetBody(clip.pose[done], clip.trans.col(done));
    if (done < given) {
      object = given_object(done);
      fingers = FingersOf(clip.pose[done], side);
    } else {
      state.Evaluate(start, false);
      const int iterations = FitImosObject(state, distance, options, object);
      report.stop = iterations < 0                         ? StopReason::kFailed
                    : iterations >= options.max_iterations ? StopReason::kIterationLimit
                                                           : StopReason::kConverged;
      const Eigen::Matrix3Xd in_world =
          (object.orientation.toRotationMatrix() * object_vertices).colwise() + object.translation;
      ImosFingerLoss loss(state, in_world, start, options.lambda_contact, options.lambda_drift,
                          options.contact_threshold_m);
      fingers = FitFingers(loss, start, options, adam);
      report.iterations = std::max(0, iterations) + options.finger_steps;
    }
    fill_energies(report);
    report.solve_ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    result.frames.push_back(report);
    track.trans.col(done) = object.translation;
    const Eigen::Vector3d orient = LogSO3(object.orientation.toRotationMatrix());
    track.orient.col(done) =
        done == 0 ? orient : UnwrapAxisAngle(orient, track.orient.col(done - 1));
    SetFingers(result.clip.pose[done], side, fingers);
    object_before = object;
    fingers_before = fingers;
  }
  result.clip.holding_hand.assign(frames, HoldingBit(side));
  if (done < frames) result.clip = Slice(result.clip, 0, done);
  if (progress) progress(done, frames);
  return result;
}

}  // namespace holdfast
