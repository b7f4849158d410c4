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

/// What must not be walked into, as a person of some thickness sees it.
struct LatentObstacle {
  std::shared_ptr<const DistanceGrid> solid;
};

/// What is known of the person.
struct LatentBody {
  wandr::BoneOffsets<float> bones;
  std::vector<BodyPoint> soles;       ///< heels, balls and toe tips on the soles of both feet
  std::vector<BodyPoint> fingertips;  ///< of flat hands
  /// Greatest angle of each joint, radians; 0 for no limit.
  std::array<double, kNumBodyJoints> joint_limits = {};
};
LatentBody LatentBodyOf(const Eigen::Matrix3Xd& rest_joints, double sole_y);

/// Latent optimization: the latents of a whole rollout are changed until the wrist is at the goal
/// and the motion is physically plausible. Weights are on sums over frames; see solver/terms.
struct LatentOptions {
  /// Rollouts follow the intention from the start (closed loop); false: the network is a motion
  /// prior that does not know the goal, as in the published VAE + opt.
  bool with_intention = true;
  wandr::IntentionOptions intention{.min_frames_left = 10.0, .hold_last_goal = true};

  /// Arrival: the wrist is at the goal at the deadline and `hold_frames` after it; with
  /// `free_time`, at any time up to `late_frames` after the deadline (FirstArrival).
  bool free_time = false;
  int hold_frames = 12;
  int late_frames = 30;
  double soft_min_from_m = 0.5, soft_min_to_m = 0.1;  ///< tau of FirstArrival, over the iterations
  int goal_joint = 0;                       ///< 0: the wrist of `intention`; else this joint
  std::optional<Eigen::Vector3d> approach;  ///< unit, from elbow to wrist on arrival

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
  double farthest_stance_m = 0.5;  ///< pelvis to goal, as seen from above
  double path = 0.08;
  double along = 0.2;    ///< faces where the way goes
  double cadence = 0.3;  ///< steps as long as people take at that speed
  double turn = 0.02;
  double fastest_turn_rad_s = 1.0;
  double lean = 1.0;
  double farthest_lean_m = 0.04;           ///< neck from above the pelvis, on the way
  double farthest_lean_reaching_m = 0.08;  ///< the same from shortly before the deadline on
  double height = 1.0;
  double lowest_walk = 0.97;  ///< pelvis on the way, of its height on straight legs
  double limits = 0.01;
  double collars = 0.2;  ///< the same of the collars
  double acceleration = 1e-7;
  double obstacle = 1.0;
  double look = 0.005;
  double balance = 0.3;
  std::vector<LatentObstacle> obstacles;

  int lbfgs_iterations = 80;  ///< contacts are found anew every ten
  int lm_iterations = 10;
  double lm_goal_m = 0.003;  ///< Levenberg-Marquardt stops here
  /// A motion that leaves the ground, or does not get within 10 cm of the goal, is made again in a
  /// hurry: path, cadence, turn and lean relaxed, and the goal, if it was missed on foot, weighing
  /// more; then from other latents. What is better is kept.
  bool hurries = true;
  int batch = 16;
  /// Called before each iteration, from several threads; what it throws ends the run.
  std::function<void()> poll = {};
};

/// A motion that is wanted: from a start, its wrist at a goal. The wrist is the right one (see
/// wandr::MirroredStates for the left).
struct ReachTask {
  wandr::RolloutStart<float> start;
  Eigen::Vector3d goal = Eigen::Vector3d::Zero();  ///< world, meters
  int num_steps = 239;                             ///< T: frames 0..T at 30 fps
  int deadline = 239;                              ///< frame at which the wrist is due
  /// The optimization begins with the latents that wandr::DrawLatents gives this stream.
  std::uint64_t seed = 1;
  std::uint64_t stream = 0;
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< of the pelvis at the start, m/s
};

/// How an optimization went: one entry per iterate, the first before any step.
struct ReachTrace {
  std::vector<float> closest_m;  ///< least distance of wrist and goal over all frames
  std::vector<float> last_m;     ///< distance at the last frame
  std::vector<float> seconds;    ///< of the whole batch so far, by its size
};

/// How one minimization went, in Ceres' words.
struct LatentSolve {
  std::string minimizer;      ///< "LEVENBERG_MARQUARDT", "LBFGS", ..; "ADAM" is no Ceres minimizer
  std::string linear_solver;  ///< "CGNR"; empty without one
  int iterations = 0;
  std::string termination;  ///< "CONVERGENCE", "NO_CONVERGENCE", ..
};

struct ReachSolution {
  wandr::RolloutTrack track;
  Eigen::VectorXf latents;  ///< (64 T)
  ReachTrace trace;
  std::vector<LatentSolve> solves;  ///< one after another
};

}  // namespace holdfast
