// SPDX-License-Identifier: MIT
#include "solver/fit/finger_repair.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include "solver/terms/hand/hand_prior.h"
#include "solver/terms/motion/goal_terms.h"
#include "solver/terms/motion/posture_terms.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast {
namespace {

using Turns = std::vector<Eigen::Quaterniond>;  // of one joint, one per frame

constexpr double kFingerJump = 40.0 * kDegree;  // radians between two frames
constexpr double kMaxSpeed = 1200.0 * kDegree;  // radians per second
constexpr double kMaxStep = 30.0 * kDegree;     // radians per frame, at low rates
constexpr double kBurst_s = 0.25;               // longer bursts are motion
constexpr double kMoves = 1e-3;                 // radians, all joints together
constexpr double kReplacedWeight = 0.1;
constexpr double kLimitWeight = 10.0;
constexpr double kSmoothing_s = 2.0 / 60.0;

Turns TurnsOf(const Clip& clip, int joint) {
  Turns turns;
  for (const JointPose& pose : clip.pose) turns.emplace_back(ExpSO3(pose.col(joint)));
  return turns;
}

// Largest set of mutually consistent frames.
std::vector<bool> KeptFrames(const Turns& turns, double most_step, int window) {
  const int frames = static_cast<int>(turns.size());
  std::vector<int> count(turns.size(), 1), before(turns.size(), -1);
  for (int t = 1; t < frames; ++t) {
    for (int s = t - 1; s >= std::max(0, t - window); --s) {
      if (count[s] + 1 <= count[t] ||
          turns[s].angularDistance(turns[t]) > most_step * static_cast<double>(t - s)) {
        continue;
      }
      count[t] = count[s] + 1;
      before[t] = s;
    }
  }
  std::vector<bool> kept(turns.size(), false);
  const auto last = std::ranges::max_element(count) - count.begin();
  for (int t = static_cast<int>(last); t >= 0; t = before[t]) kept[t] = true;
  return kept;
}

// Interpolates the frames that are not kept.
void Bridge(const std::vector<bool>& kept, Turns& turns) {
  int last = -1;
  const int frames = static_cast<int>(turns.size());
  for (int t = 0; t <= frames; ++t) {
    if (t < frames && !kept[t]) continue;
    for (int u = last + 1; u < t; ++u) {
      turns[u] = last < 0 ? turns[t]
                 : t == frames
                     ? turns[last]
                     : turns[last].slerp(static_cast<double>(u - last) / (t - last), turns[t]);
    }
    last = t;
  }
}

// Smooths a joint's angles, one frame per column, with minimal change and within their limits.
void Smooth(const HandAxes& axes, int joint, const Eigen::VectorXd& trust, double weight,
            Eigen::Matrix3Xd& angles) {
  ceres::Problem problem;
  const auto at = [&](Eigen::Index t) { return angles.col(t).data(); };
  for (Eigen::Index t = 0; t < angles.cols(); ++t) {
    problem.AddResidualBlock(new NearPoint(angles.col(t), trust(t)), nullptr, at(t));
    problem.AddResidualBlock(new AngleRangeTerm(axes, joint, kLimitWeight), nullptr, at(t));
    if (t < 2) continue;
    problem.AddResidualBlock(new JointAcceleration(1.0, weight), nullptr, at(t - 2), at(t - 1),
                             at(t));
  }
  ceres::Solver::Options options = SparseOptions(20, 1e-12);
  options.initial_trust_region_radius = 1e12;  // linear except for the active limits
  SolveQuietly(options, problem);
}

}  // namespace

int FingerJumpFrames(const Clip& clip, Side side) {
  std::vector<bool> jumps(clip.pose.size(), false);
  for (int k = 0; k < kJointsPerHand; ++k) {
    const Turns turns = TurnsOf(clip, HandBegin(side) + k);
    for (std::size_t t = 1; t < turns.size(); ++t) {
      if (turns[t].angularDistance(turns[t - 1]) > kFingerJump) jumps[t] = true;
    }
  }
  return static_cast<int>(std::ranges::count(jumps, true));
}

FingerRepair RepairFingers(const HandAxes& axes, Clip& clip) {
  FingerRepair repair;
  repair.side = axes.HandSide();
  const int frames = clip.NumFrames(), first = HandBegin(repair.side);
  for (int t = 1; t < frames && !repair.moves; ++t) {
    repair.moves =
        (FingersOf(clip.pose[t], repair.side) - FingersOf(clip.pose[0], repair.side)).norm() >
        kMoves;
  }
  repair.jump_frames = FingerJumpFrames(clip, repair.side);
  if (repair.jump_frames == 0) return repair;

  const double most_step = std::min(kMaxStep, kMaxSpeed / clip.frame_rate);
  const int window = static_cast<int>(std::ceil(std::numbers::pi / most_step) +
                                      std::ceil(kBurst_s * clip.frame_rate));
  const double smooth = std::pow(kSmoothing_s * clip.frame_rate, 4);
  for (int k = 0; k < kJointsPerHand; ++k) {
    Turns turns = TurnsOf(clip, first + k);
    const std::vector<bool> kept = KeptFrames(turns, most_step, window);
    repair.replaced += static_cast<int>(std::ranges::count(kept, false));
    Bridge(kept, turns);
    Eigen::Matrix3Xd angles(3, frames);
    Eigen::VectorXd trust(frames);
    Eigen::Vector3d turn = LogSO3(turns[0].toRotationMatrix());
    for (int t = 0; t < frames; ++t) {
      turn = UnwrapAxisAngle(LogSO3(turns[t].toRotationMatrix()), turn);
      angles.col(t) = axes.Axes(k).transpose() * turn;
      trust(t) = kept[t] ? 1.0 : kReplacedWeight;
    }
    Smooth(axes, k, trust, smooth, angles);
    for (int t = 0; t < frames; ++t) clip.pose[t].col(first + k) = axes.Axes(k) * angles.col(t);
  }
  return repair;
}

Eigen::MatrixXd GaussianFilter(const Eigen::MatrixXd& values, double sigma_frames) {
  const auto reach = static_cast<Eigen::Index>(std::ceil(3.0 * sigma_frames));
  Eigen::MatrixXd smooth(values.rows(), values.cols());
  for (Eigen::Index t = 0; t < values.cols(); ++t) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(values.rows());
    double weights = 0.0;
    for (Eigen::Index u = std::max<Eigen::Index>(0, t - reach);
         u <= std::min(values.cols() - 1, t + reach); ++u) {
      const double k = static_cast<double>(u - t) / sigma_frames;
      const double weight = std::exp(-0.5 * k * k);
      sum += weight * values.col(u);
      weights += weight;
    }
    smooth.col(t) = sum / weights;
  }
  return smooth;
}

double NoiseAfterSmoothing(double sigma_frames) {
  // The sum of a normalized Gaussian's squared weights is 1 / (2 sqrt(pi) sigma).
  return std::min(1.0, 1.0 / std::sqrt(2.0 * std::sqrt(std::numbers::pi) * sigma_frames));
}

double NoiseOfSlope(Eigen::Index reach) {
  const double n = static_cast<double>(reach);
  return 1.0 / std::sqrt(n * (n + 1.0) * (2.0 * n + 1.0) / 3.0);
}

double WhiteNoise(const Eigen::Matrix3Xd& positions) {
  if (positions.cols() < 5) return 0.0;
  std::vector<double> bends;
  for (Eigen::Index t = 1; t + 1 < positions.cols(); ++t) {
    bends.push_back((positions.col(t - 1) - 2.0 * positions.col(t) + positions.col(t + 1)).norm());
  }
  const auto middle = bends.begin() + static_cast<std::ptrdiff_t>(bends.size() / 2);
  std::nth_element(bends.begin(), middle, bends.end());
  // The second difference of white noise has sqrt(6) times its standard deviation; 1.538 is the
  // median length of a standard normal vector in three dimensions.
  return *middle / (1.538 * std::sqrt(6.0));
}

}  // namespace holdfast
