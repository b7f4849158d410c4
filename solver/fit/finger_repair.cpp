// SPDX-License-Identifier: MIT
#include "solver/fit/finger_repair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

namespace holdfast {
namespace {

using Turns = std::vector<Eigen::Quaterniond>;  // of one joint, a frame each

constexpr double kMostSpeed = 1200.0 * kDegree;  // radians a second
constexpr double kMostStep = 30.0 * kDegree;     // radians a frame, at low rates
constexpr double kBurst_s = 0.25;                // bursts longer than this are motion
constexpr double kMoves = 1e-3;                  // radians, all joints together
constexpr double kReplacedWeight = 0.1;
constexpr double kLimitWeight = 10.0;
constexpr double kSmoothing_s = 2.0 / 60.0;

Turns TurnsOf(const Clip& clip, int joint) {
  Turns turns;
  for (const JointPose& pose : clip.pose) turns.emplace_back(ExpSO3(pose.col(joint)));
  return turns;
}

bool Jumps(const Turns& turns, std::size_t t) {
  return turns[t].angularDistance(turns[t - 1]) > kFingerJump;
}

// The most frames that can stand beside one another.
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

// Frames that are not kept, between those that are.
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

// The angle nearest to `data` that changes its velocity little and keeps to its range.
class AngleSmoother {
 public:
  AngleSmoother(int frames, double weight) : smooth_(frames, frames) {
    std::vector<Eigen::Triplet<double>> entries;
    constexpr std::array<double, 3> kSecond = {1.0, -2.0, 1.0};
    for (int t = 0; t + 2 < frames; ++t) {
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          entries.emplace_back(t + i, t + j, weight * kSecond[i] * kSecond[j]);
        }
      }
    }
    for (int t = 0; t < frames; ++t) entries.emplace_back(t, t, 0.0);
    smooth_.setFromTriplets(entries.begin(), entries.end());
    solver_.analyzePattern(smooth_);
  }

  // By Gauss-Newton: which frames are beyond the range is settled within a few rounds.
  Eigen::VectorXd Solve(const Eigen::VectorXd& data, const Eigen::VectorXd& trust,
                        const AngleRange& range) {
    Eigen::VectorXd angle = data;
    Eigen::VectorXd beyond = Eigen::VectorXd::Constant(data.size(), -1.0);
    constexpr int kRounds = 20;
    for (int round = 0; round < kRounds; ++round) {
      Eigen::VectorXd weight = trust, right = trust.cwiseProduct(data), now(data.size());
      for (Eigen::Index t = 0; t < data.size(); ++t) {
        now(t) = angle(t) < range.low ? 1.0 : angle(t) > range.high ? 2.0 : 0.0;
        if (now(t) == 0.0) continue;
        weight(t) += kLimitWeight;
        right(t) += kLimitWeight * (now(t) == 1.0 ? range.low : range.high);
      }
      if (now == beyond) break;
      beyond = now;
      Eigen::SparseMatrix<double> matrix = smooth_;
      matrix.diagonal() += weight;
      solver_.factorize(matrix);
      angle = solver_.solve(right);
    }
    return angle;
  }

 private:
  Eigen::SparseMatrix<double> smooth_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
};

}  // namespace

int FingerJumpFrames(const Clip& clip, Side side) {
  std::vector<bool> jumps(clip.pose.size(), false);
  for (int k = 0; k < kJointsPerHand; ++k) {
    const Turns turns = TurnsOf(clip, HandBegin(side) + k);
    for (std::size_t t = 1; t < turns.size(); ++t) {
      if (Jumps(turns, t)) jumps[t] = true;
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

  const double most_step = std::min(kMostStep, kMostSpeed / clip.frame_rate);
  const int window = static_cast<int>(std::ceil(std::numbers::pi / most_step) +
                                      std::ceil(kBurst_s * clip.frame_rate));
  AngleSmoother smoother(frames, std::pow(kSmoothing_s * clip.frame_rate, 4));
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
    for (int row = 0; row < 3; ++row) {
      angles.row(row) =
          smoother.Solve(angles.row(row).transpose(), trust, axes.Range(row, k)).transpose();
    }
    for (int t = 0; t < frames; ++t) clip.pose[t].col(first + k) = axes.Axes(k) * angles.col(t);
  }
  return repair;
}

}  // namespace holdfast
