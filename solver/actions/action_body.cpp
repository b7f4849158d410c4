// SPDX-License-Identifier: MIT
#include "solver/actions/action_body.h"

#include <algorithm>

#include "geometry/body/skeleton.h"
#include "geometry/rotation.h"
#include "solver/actions/action_measures.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/change_spline.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

class ActionBodySolver {
 public:
  ActionBodySolver(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& feet,
                   const ActionScript& script, const ActionPath& path, double path_end_s,
                   const ActionBodyOptions& options, std::vector<BodyFrame>& frames)
      : chain_(rest_joints, Side::kRight),
        feet_(feet),
        script_(script),
        path_(path),
        path_end_s_(path_end_s),
        options_(options),
        frames_(frames),
        base_(frames),
        change_(static_cast<int>(frames.size()), options.knot_frames) {}

  ActionBodyReport Solve() {
    ceres::Problem problem;
    change_.AddTo(problem);
    for (int t = 0; t < static_cast<int>(base_.size()); ++t) {
      change_.AddFrame(problem, t, [&](const Eigen::Vector4d& basis) {
        return new ActionFrameBlock(chain_, base_[static_cast<std::size_t>(t)], TermsOf(t), basis);
      });
    }
    // The arm is already near its target.
    change_.AddPrior(problem, UpperBodySigma({0.03, 0.04, 0.02}, 4.0 * kDegree, 12.0 * kDegree),
                     0.35);
    const ceres::Solver::Summary summary =
        SolveQuietly(SparseOptions(options_.max_iterations, 1e-3), problem);
    ActionBodyReport report;
    report.iterations = summary.num_successful_steps + summary.num_unsuccessful_steps;
    report.usable = summary.IsSolutionUsable();
    if (report.usable) Finish(report);
    return report;
  }

 private:
  ActionFrameTerms TermsOf(int t) const {
    const double time = t / options_.frame_rate;
    const BodyFrame& frame = base_[static_cast<std::size_t>(t)];
    const BodyPlacement placed = Place(chain_.RestJoints(), frame);
    ActionFrameTerms terms;
    const PathPoint wanted = path_.At(time);
    terms.hand.share = wanted.share;
    terms.hand.in_world = wanted.world.translation();
    terms.hand.in_head = wanted.head.translation();
    // A hand that is free again has no target.
    terms.hand.sigma_m = time < path_end_s_ ? options_.hand_sigma_m : 1.0;
    const Isometry3d head = placed.WorldFromJoint(kHead);
    const Vector3d eyes = head * Vector3d(0.0, 0.05, 0.08);
    terms.gaze.wanted = GazeAt(script_, time, eyes, wanted.At(head).translation());
    terms.gaze.sigma = options_.gaze_sigma;
    const Matrix3d chest = LeanRotation(LeanAt(script_, time)) * placed.rotation[kSpine3];
    terms.lean.up = chest.col(1);
    terms.lean.forward = chest.col(2);
    terms.lean.sigma = options_.lean_sigma;
    terms.balance.captured = Balance::Middle(chain_, placed);
    terms.legs = LegReach::Of(chain_, placed, feet_);
    terms.range = JointRange::Of(chain_, frame, options_.joint_limits);
    return terms;
  }

  // Applies the change to the frames, legs included.
  void Finish(ActionBodyReport& report) {
    for (int t = 0; t < static_cast<int>(base_.size()); ++t) {
      BodyFrame frame = chain_.Changed(base_[static_cast<std::size_t>(t)], change_.At(t));
      report.worst_missed_m =
          std::max(report.worst_missed_m, PlaceLegs(chain_.RestJoints(), feet_, frame));
      const double time = t / options_.frame_rate;
      if (time < path_end_s_) {
        const BodyPlacement placed = Place(chain_.RestJoints(), frame);
        const Vector3d wanted = path_.At(time).At(placed.WorldFromJoint(kHead)).translation();
        report.worst_hand_m = std::max(report.worst_hand_m,
                                       (placed.joints.col(chain_.WristJointId()) - wanted).norm());
      }
      frames_[static_cast<std::size_t>(t)] = frame;
    }
  }

  UpperBodyChain chain_;
  const FeetTarget& feet_;
  const ActionScript& script_;
  const ActionPath& path_;
  double path_end_s_;
  const ActionBodyOptions& options_;
  std::vector<BodyFrame>& frames_;
  std::vector<BodyFrame> base_;
  ChangeSpline change_;
};

}  // namespace

ActionBodyReport MoveActionBody(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& feet,
                                const ActionScript& script, const ActionPath& path,
                                double path_end_s, const ActionBodyOptions& options,
                                std::vector<BodyFrame>& frames) {
  return ActionBodySolver(rest_joints, feet, script, path, path_end_s, options, frames).Solve();
}

}  // namespace holdfast
