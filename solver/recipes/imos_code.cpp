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
#include "solver/terms/hand/paper_terms.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

ImosFingerLoss::ImosFingerLoss(HandState& state, const Eigen::Matrix3Xd& object,
                               const FingerPose& start, double lambda_contact, double lambda_drift,
                               double tau_m)
    : state_(state),
      object_(object.transpose()),
      lambda_contact_(lambda_contact),
      lambda_drift_(lambda_drift),
      tau_(tau_m) {
  state_.Evaluate(start, false);
  start_vertices_ = state_.Vertices();
  start_to_near_.resize(3, start_vertices_.cols());
  for (Eigen::Index j = 0; j < start_vertices_.cols(); ++j) {
    const Eigen::Vector3d v = start_vertices_.col(j);
    start_to_near_.col(j) = object_.row(Nearest(v)).transpose() - v;
  }
  weight_ = (-2.0 * start_to_near_.colwise().norm().transpose().array()).exp();
  slopes_.resize(3, start_vertices_.cols());
}

int ImosFingerLoss::Nearest(const Eigen::Vector3d& point) {
  squares_ = (object_.col(0).array() - point.x()).square() +
             (object_.col(1).array() - point.y()).square() +
             (object_.col(2).array() - point.z()).square();
  int index = 0;
  squares_.minCoeff(&index);
  return index;
}

double ImosFingerLoss::Evaluate(const FingerPose& fingers, FingerPose* gradient) {
  state_.Evaluate(fingers, gradient != nullptr);
  const Eigen::Matrix3Xd& vertices = state_.Vertices();
  const Eigen::Index num_vertices = vertices.cols(), num_object = object_.rows();
  const double share = 1.0 / (3.0 * static_cast<double>(num_vertices));
  double vectors = 0.0, drift = 0.0;
  for (Eigen::Index j = 0; j < num_vertices; ++j) {
    const Eigen::Vector3d v = vertices.col(j);
    const Eigen::Vector3d change = object_.row(Nearest(v)).transpose() - v - start_to_near_.col(j);
    const Eigen::Vector3d way = v - start_vertices_.col(j);
    const double square = weight_(j) * weight_(j);
    vectors += square * change.squaredNorm();
    drift += way.squaredNorm();
    slopes_.col(j) = 2.0 * share * (lambda_drift_ * way - square * change);
  }
  double contact = 0.0;
  int touching = 0;
  for (const bool add_slopes : {false, true}) {  // the mean needs the count first
    if (add_slopes && (touching == 0 || gradient == nullptr)) break;
    for (Eigen::Index k = 0; k < num_vertices; ++k) {
      const Eigen::Index entry = k * num_object;
      const Eigen::Index i = entry / num_vertices, j = entry % num_vertices;
      const Eigen::Vector3d away = vertices.col(j) - object_.row(i).transpose();
      const double distance = away.norm();
      if (!(distance < tau_)) continue;
      if (!add_slopes) {
        contact += distance;
        ++touching;
      } else if (distance > 0.0) {
        slopes_.col(j) += lambda_contact_ / touching * away / distance;
      }
    }
  }
  if (touching > 0) contact /= touching;
  if (gradient != nullptr) {
    gradient->setZero();
    for (Eigen::Index j = 0; j < num_vertices; ++j) {
      state_.AddJacobianRow(static_cast<int>(j), slopes_.col(j), gradient->data());
    }
  }
  return share * vectors + lambda_contact_ * contact + lambda_drift_ * share * drift;
}

namespace {

// Fingers as the code's unknowns, and the loss gradient with respect to them.
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

// Second stage, one frame: fingers before the last step, which the code does not use.
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

// Fits an object to a clip's frames in order. All arguments must outlive this.
class ImosCodeFitter {
 public:
  // The first `given` frames are those of the clip.
  ImosCodeFitter(const Clip& clip, const HandModel& hand, const Eigen::Matrix3Xd& object_vertices,
                 int given, const ImosCodeOptions& options)
      : clip_(clip),
        side_(hand.HandSide()),
        object_vertices_(object_vertices),
        given_(given),
        options_(options),
        reference_(ImosReferenceFrame(*clip.object, given)),
        start_(FingersOf(clip.pose[reference_], side_)),
        state_(hand),
        distances_(ReferenceDistances()),
        distance_(object_vertices, distances_, 1.0, PairPrecision::kDouble),
        contact_(object_vertices, distances_, options.contact_threshold_m, 1.0),
        adam_(6 * kJointsPerHand),
        object_(GivenObject(0)),
        fingers_(FingersOf(clip.pose[0], side_)) {}

  FrameReport FitFrame(int t) {
    const auto begin = std::chrono::steady_clock::now();
    const ObjectPose object_before = object_;
    const FingerPose fingers_before = fingers_;
    FrameReport report;
    state_.SetBody(clip_.pose[t], clip_.trans.col(t));
    if (t < given_) {
      object_ = GivenObject(t);
      fingers_ = FingersOf(clip_.pose[t], side_);
    } else {
      FitBothStages(report);
    }
    FillEnergies(object_before, fingers_before, report);
    report.solve_ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    return report;
  }

  const ObjectPose& Object() const { return object_; }    // of the last frame
  const FingerPose& Fingers() const { return fingers_; }  // of the last frame
  int NumContactPairs() const { return contact_.NumPairs(); }

 private:
  ObjectPose GivenObject(int t) const { return ObjectPose(clip_.object->Pose(t)); }

  Eigen::MatrixXd ReferenceDistances() {
    state_.SetBody(clip_.pose[reference_], clip_.trans.col(reference_));
    state_.Evaluate(start_, false);
    const ObjectPose held = GivenObject(reference_);
    return HandObjectDistance::Distances(
        InObjectFrame(state_.Vertices(), held.orientation, held.translation), object_vertices_);
  }

  void FitBothStages(FrameReport& report) {
    state_.Evaluate(start_, false);
    const int iterations = FitImosObject(state_, distance_, options_, object_);
    report.stop = iterations < 0                          ? StopReason::kFailed
                  : iterations >= options_.max_iterations ? StopReason::kIterationLimit
                                                          : StopReason::kConverged;
    const Eigen::Matrix3Xd in_world =
        (object_.orientation.toRotationMatrix() * object_vertices_).colwise() + object_.translation;
    ImosFingerLoss loss(state_, in_world, start_, options_.lambda_contact, options_.lambda_drift,
                        options_.contact_threshold_m);
    fingers_ = FitFingers(loss, start_, options_, adam_);
    report.iterations = std::max(0, iterations) + options_.finger_steps;
  }

  // The paper's energies, with its weights, at the solution.
  void FillEnergies(const ObjectPose& object_before, const FingerPose& fingers_before,
                    FrameReport& report) {
    HandObjectBlock block(&state_);
    block.AddTerm(EnergyTerm::kDistance, &distance_);
    block.AddTerm(EnergyTerm::kContact, &contact_);
    const double* parameters[] = {object_.orientation.coeffs().data(), object_.translation.data(),
                                  fingers_.data()};
    report.energies = block.EnergiesAt(parameters);
    report.energies[EnergyTerm::kTemporal] =
        Temporal::Energy(object_before.orientation, object_before.translation, fingers_before,
                         object_.orientation, object_.translation, fingers_);
    report.energy_total = report.energies.Total(FitOptions{}.OnlyPaper());
  }

  const Clip& clip_;
  Side side_;
  const Eigen::Matrix3Xd& object_vertices_;
  int given_;
  const ImosCodeOptions& options_;
  int reference_;
  FingerPose start_;
  HandState state_;
  Eigen::MatrixXd distances_;  // in the reference frame
  HandObjectDistance distance_;
  Contact contact_;
  ReferenceAdam adam_;
  ObjectPose object_;
  FingerPose fingers_;
};

}  // namespace

int ImosReferenceFrame(const ObjectTrack& track, int given_frames) {
  constexpr double kMoved = 1e-3;
  for (int t = 1; t < given_frames; ++t) {
    if ((track.trans.col(t) - track.trans.col(0)).norm() >= kMoved) return t - 1;
  }
  return std::max(0, given_frames - 2);
}

int FitImosObject(HandState& state, const HandObjectDistance& distance,
                  const ImosCodeOptions& options, ObjectPose& pose) {
  const ObjectPose start = pose;
  FingerPose fingers = state.Fingers();
  HandObjectBlock block(&state);
  block.AddTerm(EnergyTerm::kDistance, &distance);
  RotationManifold manifold;
  ceres::Problem problem(BorrowingProblem());
  double* const q = pose.orientation.coeffs().data();
  problem.AddParameterBlock(q, 4, &manifold);
  problem.AddResidualBlock(&block, nullptr, q, pose.translation.data(), fingers.data());
  problem.SetParameterBlockConstant(fingers.data());
  ceres::Solver::Options solver_options =
      DenseOptions(options.max_iterations, options.tolerance, options.tolerance);
  solver_options.gradient_tolerance = options.tolerance;
  const ceres::Solver::Summary summary = SolveQuietly(solver_options, problem);
  if (!summary.IsSolutionUsable()) {
    pose = start;
    return -1;
  }
  return StepsOf(summary);
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
  FitResult result{clip, {}, 0, {}};
  ObjectTrack& track = *result.clip.object;
  ImosCodeFitter fitter(clip, hand, object_vertices, given, options);
  result.num_contact_pairs = fitter.NumContactPairs();
  int done = 0;
  for (; done < frames; ++done) {
    if (progress && done > 0 && !progress(done, frames)) break;
    result.frames.push_back(fitter.FitFrame(done));
    track.trans.col(done) = fitter.Object().translation;
    const Eigen::Vector3d orient = LogSO3(fitter.Object().orientation.toRotationMatrix());
    track.orient.col(done) =
        done == 0 ? orient : UnwrapAxisAngle(orient, track.orient.col(done - 1));
    SetFingers(result.clip.pose[done], side, fitter.Fingers());
  }
  result.clip.holding_hand.assign(frames, HoldingBit(side));
  if (done < frames) result.clip = Slice(result.clip, 0, done);
  if (progress) progress(done, frames);
  return result;
}

}  // namespace holdfast
