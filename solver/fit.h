// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include <ceres/solver.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/clip.h"
#include "geometry/hand_model.h"
#include "solver/hand_object_block.h"
#include "solver/terms/contact.h"
#include "solver/terms/hand_object_distance.h"

namespace holdfast {

/// Options of the object optimizer (IMoS, Ghosh et al. 2023, eq. 5-9). Weights multiply sums, as in
/// the paper; its values are the defaults. The paper leaves tau open: 1 cm is its code's.
struct FitOptions {
  double lambda_distance = 1.0;       ///< weight of E_d
  double lambda_contact = 0.005;      ///< weight of E_c
  double lambda_temporal = 0.005;     ///< weight of E_t
  double contact_threshold_m = 0.01;  ///< tau: first-frame pairs closer than this are in contact
  PairPrecision precision = PairPrecision::kSingle;
  int max_iterations = 50;           ///< Levenberg-Marquardt iterations per frame
  double step_tolerance = 1e-5;      ///< stop when a step is this small against the unknowns
  double function_tolerance = 1e-9;  ///< or when the cost changes by this share
};

/// How Ceres is asked to solve one frame, on one thread.
ceres::Solver::Options FrameSolverOptions(const FitOptions& options);

/// world_from_object: x_world = orientation * x_object + translation.
struct ObjectPose {
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
};

/// World pose of a wrist.
struct WristPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

/// Where an object is that follows the wrist rigidly. If the fingers do not move relative to the
/// wrist this is the optimum of E_d and E_c, and the start of every frame.
ObjectPose FollowWrist(const ObjectPose& object, const WristPose& from, const WristPose& to);

/// Why the solver left a frame.
enum class StopReason {
  kGiven,  ///< the first frame: it defines D and S and is not solved
  kConverged,
  kIterationLimit,  ///< usable, but not at its minimum
  kFailed,          ///< not finite: the frame holds the rigid start instead
};
std::string_view StopReasonName(StopReason reason);

/// One frame's account. Energies as the paper writes them, without weights and factor 1/2, in the
/// precision of the pair loop.
struct FrameReport {
  double energy_distance = 0.0;  ///< E_d, m^2
  double energy_contact = 0.0;   ///< E_c, m^2
  double energy_temporal = 0.0;  ///< E_t, m^2 + rad^2
  double energy_total = 0.0;     ///< weighted sum
  int iterations = 0;
  double solve_ms = 0.0;  ///< wall time of the frame: body model, start, solve
  StopReason stop = StopReason::kGiven;
};

/// Fits one frame after another: the door for repeated solves, with everything that a clip keeps
/// (hand, object, D, S) prepared once. Not for use by several threads at a time.
class FrameFitter {
 public:
  /// `object_vertices` (3 x M) in the object's frame. Frame 0 is given: the body's pose with the
  /// grasping fingers in it, and the object's pose. D and S are taken from it.
  FrameFitter(const HandModel& hand, const Eigen::Matrix3Xd& object_vertices,
              const JointPose& first_pose, const Eigen::Vector3d& first_trans,
              const ObjectPose& first_object, const FitOptions& options = {});
  ~FrameFitter();
  FrameFitter(const FrameFitter&) = delete;
  FrameFitter& operator=(const FrameFitter&) = delete;

  /// Solves the next frame, from the last one's solution carried along rigidly by the wrist.
  FrameReport Solve(const JointPose& pose, const Eigen::Vector3d& trans);

  const ObjectPose& Object() const { return object_; }    ///< of the last frame solved
  const FingerPose& Fingers() const { return fingers_; }  ///< of the last frame solved
  const FrameReport& FirstFrame() const { return first_; }
  int NumContactPairs() const { return contact_->NumPairs(); }

 private:
  void FillEnergies(const ObjectPose& previous_object, const FingerPose& previous_fingers,
                    FrameReport& report);

  FitOptions options_;
  HandState state_;
  std::unique_ptr<HandObjectDistance> distance_;
  std::unique_ptr<Contact> contact_;
  std::unique_ptr<HandObjectBlock> block_;
  ObjectPose object_;
  FingerPose fingers_;
  WristPose wrist_;
  FrameReport first_;
};

struct FitResult {
  Clip clip;  ///< the input with fitted fingers, object track and holding_hand
  std::vector<FrameReport> frames;
  int num_contact_pairs = 0;  ///< sum of S
};

/// Carries the object through a clip with one hand, frame by frame. The clip's first frame holds
/// the grasp: finger pose and object pose; object poses and this hand's fingers in later frames are
/// ignored. Object rotations come out unwrapped (no jumps of 2 pi). `progress` (frames done,
/// frames) may be empty and stops the fit by returning false (the result then holds the frames
/// done). Throws Error for a clip without an object track or an object without vertices.
FitResult FitClip(const Clip& clip, const HandModel& hand, const Eigen::Matrix3Xd& object_vertices,
                  const FitOptions& options = {},
                  const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
