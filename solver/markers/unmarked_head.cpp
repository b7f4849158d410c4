// SPDX-License-Identifier: MIT
#include "solver/markers/unmarked_head.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <ceres/problem.h>
#include <ceres/solver.h>

#include "geometry/body/own_body.h"
#include "geometry/rotation.h"
#include "solver/terms/body/goal_terms.h"
#include "solver/terms/body/posture_terms.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kArmReach_m = 0.45;  // of a wrist whose hand or forearm may touch the head
constexpr double kNear_m = 0.06;      // points farther from the skin are ignored
constexpr double kDeep_m = 0.002;
constexpr double kCalm_s = 0.5;         // margin before and after a constraint
constexpr double kAcceleration = 40.0;  // rad / s^2
constexpr double kSigma_deg = 15.0;     // of neck and of head, any axis

// For neck and head each: flexion and extension, axial rotation, lateral bending.
std::vector<PoseLimit> Limits() {
  std::vector<PoseLimit> limits;
  for (const int column : {0, 3}) {
    limits.push_back({column, Vector3d::UnitX(), -45.0 * kDegree, 35.0 * kDegree});
    limits.push_back({column, Vector3d::UnitY(), -38.0 * kDegree, 38.0 * kDegree});
    limits.push_back({column, Vector3d::UnitZ(), -22.0 * kDegree, 22.0 * kDegree});
  }
  return limits;
}

class HeadSolver {
 public:
  HeadSolver(const std::shared_ptr<const BodyModel>& model, const VectorXd& betas,
             std::span<const HeadWish> wishes, Clip& clip)
      : surface_(model, betas), wishes_(wishes), clip_(clip) {
    std::vector<int> ids;
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const std::vector<int> arm = OwnBody::ForearmAndHand(surface_, side);
      (side == Side::kRight ? right_ : left_) = static_cast<int>(arm.size());
      ids.insert(ids.end(), arm.begin(), arm.end());
    }
    arms_.emplace(model, betas, ids);
  }

  HeadReport Solve() {
    HeadReport report;
    FindArms();
    if (arm_points_.empty() && wishes_.empty()) return report;
    const FaceMarks face = FindFaceMarks(surface_);
    DistanceGridOptions grid;
    grid.cell_m = 0.004;
    grid.padding_m = 0.03;
    const DistanceGrid skin(SignedDistance(face.head), grid);
    const HeadPlace::Head head{skin, LipsOf(face)};
    report.worst_before_m = Deepest(skin, report.deep_before);
    const std::vector<char> active = ActiveFrames(skin);
    if (std::ranges::count(active, 1) > 0) Turn(head, active, report);
    report.worst_m = Deepest(skin, report.deep);
    return report;
  }

 private:
  // Skin of hands and forearms, world, in frames with a wrist near the head.
  void FindArms() {
    std::vector<Matrix3Xd> points(clip_.pose.size());
    bool any = false;
    BodyState state;
    for (int t = 0; t < clip_.NumFrames(); ++t) {
      ForwardJoints(surface_.RestJoints(), clip_.pose[t], clip_.trans.col(t), state);
      const Vector3d head = state.joints.col(kHead);
      const bool right = (state.joints.col(kRightWrist) - head).norm() < kArmReach_m,
                 left = (state.joints.col(kLeftWrist) - head).norm() < kArmReach_m;
      if (!right && !left) continue;
      any = true;
      Forward(*arms_, clip_.pose[t], clip_.trans.col(t), state);
      Matrix3Xd& at = points[t];
      at.resize(3, (right ? right_ : 0) + (left ? left_ : 0));
      if (right) at.leftCols(right_) = state.vertices.leftCols(right_);
      if (left) at.rightCols(left_) = state.vertices.rightCols(left_);
    }
    if (any) arm_points_ = std::move(points);
  }

  Eigen::Isometry3d HeadAt(int t) const {
    BodyState state;
    ForwardJoints(surface_.RestJoints(), clip_.pose[t], clip_.trans.col(t), state);
    return state.WorldFromJoint(kHead);
  }

  double Deepest(const DistanceGrid& skin, int& deep) const {
    double worst = 0.0;
    for (std::size_t t = 0; t < arm_points_.size(); ++t) {
      if (arm_points_[t].cols() == 0) continue;
      const Matrix3Xd in_head = HeadAt(static_cast<int>(t)).inverse() * arm_points_[t];
      double depth = 0.0;
      for (Eigen::Index i = 0; i < in_head.cols(); ++i) {
        depth = std::max(depth, -skin.Linear(in_head.col(i)));
      }
      deep += depth > kDeep_m ? 1 : 0;
      worst = std::max(worst, depth);
    }
    return worst;
  }

  // Points of arms and wishes near the head; `any_deep`: one violates the clearance.
  Matrix3Xd Near(const DistanceGrid& skin, int t, bool& any_deep) const {
    const Eigen::Isometry3d head_from_world = HeadAt(t).inverse();
    std::vector<Vector3d> near;
    const auto add = [&](const Matrix3Xd& points, int every) {
      for (Eigen::Index i = 0; i < points.cols(); i += every) {
        const double off = skin.Linear(head_from_world * Vector3d(points.col(i)));
        if (off > kNear_m) continue;
        near.emplace_back(points.col(i));
        any_deep = any_deep || off < 0.003;
      }
    };
    if (!arm_points_.empty()) add(arm_points_[t], 2);
    if (!wishes_.empty()) add(wishes_[t].points, 1);
    Matrix3Xd points(3, static_cast<Eigen::Index>(near.size()));
    for (std::size_t i = 0; i < near.size(); ++i) {
      points.col(i) = near[i];
    }
    return points;
  }

  // Frames that may change: those around a wish or a point that is too close.
  std::vector<char> ActiveFrames(const DistanceGrid& skin) {
    const int frames = clip_.NumFrames();
    const int calm = static_cast<int>(std::lround(kCalm_s * clip_.frame_rate));
    std::vector<char> active(clip_.pose.size(), 0);
    near_.assign(clip_.pose.size(), Matrix3Xd(3, 0));
    for (int t = 0; t < frames; ++t) {
      bool wanted = false;
      near_[t] = Near(skin, t, wanted);
      if (!wishes_.empty()) wanted = wanted || wishes_[t].lips || !wishes_[t].turn.isZero(0.0);
      if (!wanted) continue;
      std::fill(active.begin() + std::max(0, t - calm),
                active.begin() + std::min(frames, t + calm + 1), 1);
    }
    return active;
  }

  // First move the lips to the rim, then avoid points: a cup that starts across the face would keep
  // the face on the wrong side.
  void Turn(const HeadPlace::Head& head, const std::vector<char>& active, HeadReport& report) {
    Eigen::MatrixXd q(6, clip_.NumFrames());
    for (int t = 0; t < clip_.NumFrames(); ++t) {
      q.col(t) = FreePose(clip_.pose[t], {kNeck, kHead}, {}).Of(clip_.pose[t]);
    }
    const bool usable =
        (wishes_.empty() || Minimize(head, active, false, q)) && Minimize(head, active, true, q);
    if (!usable) return;
    for (int t = 0; t < clip_.NumFrames(); ++t) {
      if (active[t] == 0) continue;
      const auto turned = q.col(t);
      ++report.moved;
      report.turned_rad =
          std::max(report.turned_rad,
                   AngleBetween(ExpSO3(clip_.pose[t].col(kNeck)) * ExpSO3(clip_.pose[t].col(kHead)),
                                ExpSO3(turned.head<3>()) * ExpSO3(turned.tail<3>())));
      clip_.pose[t].col(kNeck) = turned.head<3>();
      clip_.pose[t].col(kHead) = turned.tail<3>();
    }
  }

  // `q` (6 x T): neck and head. Returns false if the solution is not usable.
  bool Minimize(const HeadPlace::Head& head, const std::vector<char>& active, bool with_points,
                Eigen::MatrixXd& q) const {
    const int frames = clip_.NumFrames();
    std::vector<FreePose> free(static_cast<std::size_t>(frames));
    ceres::Problem problem;
    const double step = 1.0 / (clip_.frame_rate * clip_.frame_rate);
    for (int t = 0; t < frames; ++t) {
      free[t] = FreePose(clip_.pose[t], {kNeck, kHead}, {});
      VectorXd rest = free[t].Of(clip_.pose[t]);
      if (!wishes_.empty()) rest += 0.5 * wishes_[t].turn.replicate<2, 1>();
      problem.AddResidualBlock(
          new PoseRest(rest, Eigen::MatrixXd::Identity(6, 6) / (kSigma_deg * kDegree), Limits(),
                       2.0 * kDegree),
          nullptr, q.col(t).data());
      Eigen::Matrix<double, 6, 1> root;
      root << clip_.trans.col(t), clip_.pose[t].col(0);
      const std::optional<Vector3d> lips = wishes_.empty() ? std::nullopt : wishes_[t].lips;
      const Matrix3Xd points = with_points ? near_[t] : Matrix3Xd(3, 0);
      if (active[t] != 0 && (lips || points.cols() > 0)) {
        problem.AddResidualBlock(
            new HeadPlace(free[t], surface_.RestJoints(), root, head, lips, points), nullptr,
            q.col(t).data());
      }
      if (t < 2) continue;
      problem.AddResidualBlock(new PoseAcceleration(VectorXd::Constant(6, kAcceleration * step)),
                               nullptr, q.col(t - 2).data(), q.col(t - 1).data(), q.col(t).data());
    }
    for (int t = 0; t < frames; ++t) {
      if (active[t] == 0) problem.SetParameterBlockConstant(q.col(t).data());
    }
    return SolveQuietly(SparseOptions(40, 1e-4), problem).IsSolutionUsable();
  }

  const BodySurface surface_;
  std::optional<BodySurface> arms_;
  int right_ = 0, left_ = 0;  // vertices of `arms_`: first the right arm's, then the left's
  std::span<const HeadWish> wishes_;
  Clip& clip_;
  std::vector<Matrix3Xd> arm_points_;  // T, or empty if no wrist is ever near
  std::vector<Matrix3Xd> near_;
};

}  // namespace

Vector3d LipsOf(const FaceMarks& face) { return face.mouth + Vector3d(0.0, -0.004, 0.003); }

HeadReport PoseUnmarkedHead(const std::shared_ptr<const BodyModel>& model, const VectorXd& betas,
                            std::span<const HeadWish> wishes, Clip& clip) {
  return HeadSolver(model, betas, wishes, clip).Solve();
}

}  // namespace holdfast
