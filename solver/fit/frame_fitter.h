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

/// How Ceres is asked to solve one frame, on one thread.
ceres::Solver::Options FrameSolverOptions(const FitOptions& options);

/// World pose of a wrist.
struct WristFrame {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

/// Where an object is that follows the wrist rigidly. If the fingers do not move relative to the
/// wrist this is the optimum of E_d and E_c, and the start of every frame.
ObjectPose FollowWrist(const ObjectPose& object, const WristFrame& from, const WristFrame& to);

/// Why the solver left a frame.
enum class StopReason {
  kGiven,    ///< the first frame: it defines D and S and is not solved
  kResting,  ///< no hand holds the object: it stays where it is
  kConverged,
  kIterationLimit,  ///< usable, but not at its minimum
  kFailed,          ///< not finite: the frame holds the rigid start instead
};
std::string_view StopReasonName(StopReason reason);

/// One frame's account. Energies as the paper writes them, without weights and factor 1/2, in the
/// precision of the pair loop, summed over the hands that hold.
struct FrameReport {
  Energies energies;
  double energy_total = 0.0;            ///< weighted sum
  std::vector<double> custom_energies;  ///< of FitOptions::custom_terms, NaN where one did not act
  std::string
      fault;  ///< what an custom term did wrong, so that the frame is at its start; or empty
  double wrist_offset_m = 0.0;  ///< how far the farther wrist is from the clip's
  int iterations = 0;
  double solve_ms = 0.0;  ///< wall time of the frame: body model, start, solve
  StopReason stop = StopReason::kGiven;
};

/// Fits one frame after another, with one hand or two: the door for repeated solves, with
/// everything that a clip keeps (hands, object, D, S) prepared once. Not for use by several threads
/// at a time.
class FrameFitter {
 public:
  /// For the hands in `hands` (one, or one of each side), none of which holds yet. `object` and
  /// the models must outlive this. `frame_s` is the time between frames.
  FrameFitter(std::span<const HandModel* const> hands, const FitObject& object,
              const FitOptions& options, double frame_s);

  /// One hand that holds from the given first frame on: the body's pose with the grasping fingers
  /// in it, and the object's pose. `object_vertices` (3 x M) in the object's frame; all that the
  /// paper's terms need, and no others are on.
  FrameFitter(const HandModel& hand, const Eigen::Matrix3Xd& object_vertices,
              const JointPose& first_pose, const Eigen::Vector3d& first_trans,
              const ObjectPose& first_object, const FitOptions& options = {});
  ~FrameFitter();
  FrameFitter(const FrameFitter&) = delete;
  FrameFitter& operator=(const FrameFitter&) = delete;

  /// Puts the object somewhere, before any hand holds it.
  void Place(const ObjectPose& object) { object_ = object; }
  /// A hand takes hold in the frame solved last (or given first), its wrist off the clip's by
  /// `offset`. Its D and S are taken here.
  void TakeHold(Side side, const JointPose& pose, const Eigen::Vector3d& trans,
                const FingerPose& fingers, const WristOffset& offset = {});
  void Release(Side side);
  /// Refines the grasp of a hand that has just taken hold, its D and S with it: what lies too deep
  /// in the other comes out, by the object that moves to where the hand leaves it (`move_object`),
  /// or by hand and arm. Does nothing where the terms of penetration are off or content.
  void Refine(Side side, const JointPose& pose, const Eigen::Vector3d& trans, bool move_object);

  /// Where the clip has the object in the next frame, for FitOptions::lambda_object.
  void Guide(const ObjectPose& object) { guide_ = object; }
  /// Solves the next frame, from the last one's solution carried along rigidly by the wrists.
  FrameReport Solve(const JointPose& pose, const Eigen::Vector3d& trans);

  const ObjectPose& Object() const { return object_; }  ///< of the last frame solved
  /// The clip's pose of the last frame with arms and fingers of the hands that hold.
  const JointPose& Body() const { return body_; }
  const FittedHand& Hand(Side side) const;
  const FingerPose& Fingers() const { return hands_.front()->fingers; }  ///< of the first hand
  /// Account of the frame as it stands, unsolved: for the given first one.
  FrameReport FirstFrame();
  int NumContactPairs() const;  ///< of the hands that hold now

 private:
  FittedHand& Find(Side side);
  WristFrame Wrist(const FittedHand& hand) const;
  void SetBody(const JointPose& pose, const Eigen::Vector3d& trans);
  void FillEnergies(FrameReport& report);

  FitOptions options_;
  double frame_s_;
  std::unique_ptr<FitObject> own_object_;
  std::vector<std::unique_ptr<FittedHand>> hands_;
  ObjectPose object_;
  int frame_ = 0;  // solved last
  std::optional<ObjectPose> guide_;
  JointPose body_;
};

}  // namespace holdfast
