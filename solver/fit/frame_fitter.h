// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ceres/solver.h>

#include <Eigen/Core>

#include "geometry/body/hand_model.h"
#include "solver/fit/fit_options.h"
#include "solver/fit/fitted_hand.h"

namespace holdfast {

/// Ceres options for solving one frame, single-threaded.
ceres::Solver::Options FrameSolverOptions(const FitOptions& options);

/// World pose of a wrist.
struct WristFrame {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

/// Object pose after following the wrist rigidly. If the fingers do not move relative to the wrist,
/// this is the optimum of E_d and E_c; it is the initial value of every frame.
ObjectPose FollowWrist(const ObjectPose& object, const WristFrame& from, const WristFrame& to);

/// Why the solver stopped in a frame.
enum class StopReason {
  kGiven,    ///< first frame: defines D and S, not solved
  kResting,  ///< no hand holds the object: it stays in place
  kConverged,
  kIterationLimit,  ///< usable, but not a minimum
  kFailed,          ///< not finite: the frame keeps its rigid initial value
};
std::string_view StopReasonName(StopReason reason);

/// Report of one frame. Energies as in the paper, without weights and the factor 1/2, in the
/// precision of the pair loop, summed over the holding hands.
struct FrameReport {
  Energies energies;
  double energy_total = 0.0;            ///< weighted sum
  std::vector<double> custom_energies;  ///< of FitOptions::custom_terms; NaN if inactive
  std::string fault;  ///< error of a custom term, so the frame keeps its initial value; or empty
  double wrist_offset_m = 0.0;  ///< maximum distance of a wrist from the clip's
  int iterations = 0;
  double solve_ms = 0.0;  ///< wall time of the frame: body model, initialization, solve
  StopReason stop = StopReason::kGiven;
};

/// Fits one frame after another, with one or two hands. Prepares everything that a clip shares
/// (hands, object, D, S) once, for repeated solves. Not thread-safe.
class FrameFitter {
 public:
  /// For the hands in `hands` (one, or one of each side), none of which holds yet. `object` and the
  /// models must outlive this. `frame_s`: frame interval.
  FrameFitter(std::span<const HandModel* const> hands, const FitObject& object,
              const FitOptions& options, double frame_s);

  /// Sets the object pose before any hand holds it.
  void Place(const ObjectPose& object) { object_ = object; }
  /// Starts a hold in the last solved (or the given first) frame, with the wrist at `offset` from
  /// the clip's. Computes D and S.
  void TakeHold(Side side, const JointPose& pose, const Eigen::Vector3d& trans,
                const FingerPose& fingers, const WristOffset& offset = {});
  void Release(Side side);
  /// Refines a grasp that has just started, with its D and S, to resolve excessive penetration: by
  /// moving the object within the hand (`move_object`), or else hand and arm. Does nothing if the
  /// penetration terms are off or satisfied.
  void Refine(Side side, const JointPose& pose, const Eigen::Vector3d& trans, bool move_object);

  /// The clip's object pose in the next frame, for FitOptions::lambda_object.
  void Guide(const ObjectPose& object) { guide_ = object; }
  /// Solves the next frame, starting from the last solution moved rigidly with the wrists.
  FrameReport Solve(const JointPose& pose, const Eigen::Vector3d& trans);

  const ObjectPose& Object() const { return object_; }  ///< of the last solved frame
  /// The clip's pose of the last frame, with arms and fingers of the holding hands.
  const JointPose& Body() const { return body_; }
  const FittedHand& Hand(Side side) const { return Find(side); }
  /// Report of the current frame without solving: for the given first one.
  FrameReport FirstFrame();
  int NumContactPairs() const;  ///< of the currently holding hands

 private:
  FittedHand& Find(Side side) const;
  void SetBody(const JointPose& pose, const Eigen::Vector3d& trans);
  void FillEnergies(FrameReport& report);

  FitOptions options_;
  double frame_s_;
  std::vector<std::unique_ptr<FittedHand>> hands_;
  ObjectPose object_;
  int frame_ = 0;  // last solved
  std::optional<ObjectPose> guide_;
  JointPose body_;
};

}  // namespace holdfast
