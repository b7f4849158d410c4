// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/goal_plan.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/rollout.h"
#include "geometry/body/skeleton.h"
#include "geometry/mesh/distance_grid.h"
#include "solver/latent/motion_objective.h"

namespace holdfast {

/// Properties of the person.
struct LatentBody {
  wandr::BoneOffsets<float> bones;
  std::vector<BodyPoint> soles;       ///< heels, balls and toe tips on the soles of both feet
  std::vector<BodyPoint> fingertips;  ///< of flat hands
  /// Maximum angle of each joint, radians; 0 for no limit.
  std::array<double, kNumBodyJoints> joint_limits = {};
};
LatentBody LatentBodyOf(const Eigen::Matrix3Xd& rest_joints, double sole_y);

/// Latent optimization: changes the latents of a whole rollout until the wrist is at the goal and
/// the motion is physically plausible. Weights are on sums over frames; see solver/terms.
struct LatentOptions {
  /// Condition rollouts on the intention from the start (closed loop); false: the network is a
  /// motion prior without knowledge of the goal, as in the published VAE + opt.
  bool with_intention = true;
  wandr::IntentionOptions intention{.min_frames_left = 10.0, .hold_last_goal = true};

  /// Arrival: the wrist is at the goal at the deadline and for `hold_frames` after it; with
  /// `free_time`, at any time up to `late_frames` after the deadline (FirstArrival).
  bool free_time = false;
  int hold_frames = 12;
  int late_frames = 30;
  double soft_min_from_m = 0.5, soft_min_to_m = 0.1;  ///< tau of FirstArrival, over the iterations
  std::optional<Eigen::Vector3d> approach;            ///< unit, from elbow to wrist on arrival

  double goal = 1.0;
  double direction = 0.5;
  double prior = 1e-4;  ///< on |z - z_0|^2
  double skate = 3.0;
  double creep = 0.3;
  double floor = 3.0;
  double airborne = 1.0;
  double speed = 0.05;
  double fastest_m_s = 1.65;
  double near = 2.0;
  double farthest_stance_m = 0.5;  ///< horizontal distance from pelvis to goal
  double path = 0.08;
  double along = 0.2;    ///< heading along the path
  double cadence = 0.3;  ///< natural step period for the speed
  double turn = 0.02;
  double fastest_turn_rad_s = 1.0;
  double lean = 1.0;
  double farthest_lean_m = 0.04;           ///< horizontal offset of neck from pelvis, on the way
  double farthest_lean_reaching_m = 0.08;  ///< same, from shortly before the deadline on
  double height = 1.0;
  double lowest_walk = 0.97;  ///< pelvis height on the way, relative to that on straight legs
  double limits = 0.01;
  double collars = 0.2;  ///< as `limits`, for the collars
  double acceleration = 1e-7;
  double obstacle = 1.0;
  double look = 0.005;
  double balance = 0.3;
  std::vector<std::shared_ptr<const DistanceGrid>> obstacles;  ///< avoided by the body's thickness

  int lbfgs_iterations = 80;  ///< contacts are updated every ten
  int lm_iterations = 10;
  double lm_goal_m = 0.003;  ///< Levenberg-Marquardt stops here
  /// Retry motions that leave the ground or miss the goal by more than 10 cm: with path, cadence,
  /// turn and lean relaxed, and a higher weight on a goal that was missed on foot; then from other
  /// latents. The better motion is kept.
  bool hurries = true;
  int batch = 16;
  /// Called before each iteration, from several threads; its exceptions end the run.
  std::function<void()> poll = {};
};

/// A motion to optimize: from a start, with the right wrist at a goal (see wandr::MirroredStates
/// for the left).
struct ReachTask {
  wandr::RolloutStart<float> start;
  Eigen::Vector3d goal = Eigen::Vector3d::Zero();  ///< world, meters
  int num_steps = 239;                             ///< T: frames 0..T at 30 fps
  int deadline = 239;                              ///< frame at which the wrist is due
  /// The initial latents are those of wandr::DrawLatents for this stream.
  std::uint64_t seed = 1;
  std::uint64_t stream = 0;
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< of the pelvis at the start, m/s
};

/// History of an optimization: one entry per iterate, the first before any step.
struct ReachTrace {
  std::vector<float> closest_m;  ///< minimum distance of wrist and goal over all frames
  std::vector<float> last_m;     ///< distance at the last frame
  std::vector<float> seconds;    ///< elapsed time of the batch, divided by its size
};

/// Summary of one minimization, in Ceres' terms.
struct LatentSolve {
  std::string minimizer;  ///< "LEVENBERG_MARQUARDT", "LBFGS", ..; "ADAM" is not a Ceres minimizer
  std::string linear_solver;  ///< "CGNR"; empty without one
  int iterations = 0;
  std::string termination;  ///< "CONVERGENCE", "NO_CONVERGENCE", ..
};

struct ReachSolution {
  wandr::RolloutTrack track;
  Eigen::VectorXf latents;  ///< (64 T)
  ReachTrace trace;
  std::vector<LatentSolve> solves;  ///< in order
};

}  // namespace holdfast
