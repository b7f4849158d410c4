// SPDX-License-Identifier: MIT
#include "solver/markers/keypoint_hand.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "geometry/body/default_hand.h"
#include "geometry/error.h"
#include "geometry/import/world_frame.h"
#include "geometry/rotation.h"
#include "solver/markers/object_markers.h"
#include "solver/terms/hand/hand_prior.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/dense_problem.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {
namespace {

using Points = KeypointHand::Points;

// Fingers of the keypoints in the model's numbering.
constexpr std::array<int, kNumFingers> kFingerOf = {kThumb, kIndex, kMiddle, kRing, kPinky};
constexpr double kTipInset_m = 0.006;  // a detector's tip is inside the finger

constexpr double kNoise_m = 0.005;
constexpr int kMinKeypoints = 6;
constexpr int kMaxIterations = 12;
constexpr HandPriorWeights kPrior = {
    .limits = 30.0, .coupling = 2.0, .neighbors = 0.0, .stay = 0.8, .spread = 3.0};
// Fingers: held to the frame before, per radian at 30 Hz.
constexpr double kHold = 5.0;

// w (P - P_0).
class HoldTerm final : public ceres::SizedCostFunction<kHandDofs, kHandDofs> {
 public:
  FingerPose pose = FingerPose::Zero();
  double weight = 0.0;
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<FingerPose>{residuals} =
        weight * (Eigen::Map<const FingerPose>(parameters[0]) - pose);
    if (jacobians && jacobians[0]) {
      Eigen::Map<Eigen::Matrix<double, kHandDofs, kHandDofs, Eigen::RowMajor>>{jacobians[0]} =
          weight * Eigen::Matrix<double, kHandDofs, kHandDofs>::Identity();
    }
    return true;
  }
};

bool SeenAt(const Eigen::VectorXd& targets, int keypoint) {
  return std::isfinite(targets[3 * keypoint]);
}

int CountSeen(const Eigen::VectorXd& targets) {
  int count = 0;
  for (int k = 0; k < kNumKeypoints; ++k) count += SeenAt(targets, k) ? 1 : 0;
  return count;
}

// The points of a hand whose keypoints were seen, and these.
struct SeenPoints {
  SeenPoints(const Points& hand, const Eigen::VectorXd& targets)
      : points(3, CountSeen(targets)), goals(3, points.cols()) {
    for (int k = 0, column = 0; k < kNumKeypoints; ++k) {
      if (!SeenAt(targets, k)) continue;
      points.col(column) = hand.col(k);
      goals.col(column++) = targets.segment<3>(3 * k);
    }
  }
  Eigen::Matrix3Xd points, goals;
};

// A hand that follows the keypoints of successive frames.
class Follower {
 public:
  Follower(const HandAxes& axes, double rate_hz)
      : hand_(axes),
        keypoints_(hand_, 1.0 / kNoise_m),
        prior_(axes, axes.Relaxed(), kPrior),
        relaxed_(axes.PoseOf(axes.Relaxed())),
        hold_weight_(kHold * std::sqrt(rate_hz / 30.0)),
        solver_(DenseOptions(kMaxIterations, 1e-8, 1e-5)) {
    problem_.AddParameterBlock(turn_.coeffs().data(), 4, true);
    problem_.AddParameterBlock(place_.data(), 3);
    problem_.AddParameterBlock(fingers_.data(), kHandDofs);
    problem_.AddResidualBlock(keypoints_, {turn_.coeffs().data(), place_.data(), fingers_.data()});
    problem_.AddResidualBlock(prior_, {fingers_.data()});
    problem_.AddResidualBlock(hold_, {fingers_.data()});
  }

  // Forgets the last frame: the next one begins at a relaxed hand.
  void Restart() { follows_ = false; }

  // Returns the root mean square distance from the keypoints, meters.
  double Solve(const Eigen::VectorXd& targets) {
    if (!follows_) fingers_ = relaxed_;
    Points points;
    hand_.Evaluate(fingers_, points, nullptr);
    const SeenPoints start(points, targets);
    const Eigen::Isometry3d pose = Kabsch(start.points, start.goals);
    turn_ = Eigen::Quaterniond(pose.linear());
    place_ = pose.translation();
    keypoints_.SetTargets(targets);
    hold_.pose = fingers_;
    hold_.weight = follows_ ? hold_weight_ : 0.0;
    (void)problem_.Solve(solver_);
    follows_ = true;
    const SeenPoints seen(Fitted(), targets);
    return std::sqrt((seen.points - seen.goals).colwise().squaredNorm().mean());
  }

  Points Fitted() const {
    Points points;
    hand_.Evaluate(fingers_, points, nullptr);
    return (turn_.toRotationMatrix() * points).colwise() + place_;
  }
  const KeypointHand& Hand() const { return hand_; }
  const Eigen::Quaterniond& Turn() const { return turn_; }
  const Eigen::Vector3d& Place() const { return place_; }
  const FingerPose& Fingers() const { return fingers_; }

 private:
  KeypointHand hand_;
  KeypointTerm keypoints_;
  HandPriorTerm prior_;
  HoldTerm hold_;
  FingerPose relaxed_, fingers_;
  double hold_weight_;
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d place_ = Eigen::Vector3d::Zero();
  DenseProblem problem_;
  ceres::Solver::Options solver_;
  bool follows_ = false;
};

// The keypoints about the wrist at 1 / `ratio` of their size. Without a wrist, about the first one.
Eigen::VectorXd Scaled(const Eigen::VectorXd& targets, double ratio) {
  int center = 0;
  while (center + 1 < kNumKeypoints && !SeenAt(targets, center)) ++center;
  const Eigen::Vector3d middle = targets.segment<3>(3 * center);
  Eigen::VectorXd scaled = targets;
  for (int k = 0; k < kNumKeypoints; ++k) {
    scaled.segment<3>(3 * k) = middle + (targets.segment<3>(3 * k) - middle) / ratio;
  }
  return scaled;
}

// Median over the frames of the sum of all bones that were seen, over the same bones of the model.
double SizeOf(const Eigen::MatrixXd& keypoints, const Points& model) {
  std::vector<double> ratios;
  for (Eigen::Index t = 0; t < keypoints.cols(); ++t) {
    double measured = 0.0, own = 0.0;
    for (int k = 1; k < kNumKeypoints; ++k) {
      const int parent = k % 4 == 1 ? 0 : k - 1;
      const double length =
          (keypoints.block<3, 1>(3 * k, t) - keypoints.block<3, 1>(3 * parent, t)).norm();
      if (!std::isfinite(length)) continue;
      measured += length;
      own += (model.col(k) - model.col(parent)).norm();
    }
    if (own > 0.0) ratios.push_back(measured / own);
  }
  if (ratios.empty()) return 0.0;
  std::ranges::nth_element(ratios, ratios.begin() + std::ssize(ratios) / 2);
  return ratios[ratios.size() / 2];
}

// One reading of a table: a side and an order.
struct Reading {
  Side side;
  const KeypointOrder* order;
  Eigen::MatrixXd keypoints;  // meters
  double unit = 1.0, ratio = 1.0;
  double rms_m = std::numeric_limits<double>::infinity();
};

std::vector<Eigen::Index> SampleFrames(const Eigen::MatrixXd& keypoints, int most) {
  std::vector<Eigen::Index> seen, sample;
  for (Eigen::Index t = 0; t < keypoints.cols(); ++t) {
    if (CountSeen(keypoints.col(t)) >= kMinKeypoints) seen.push_back(t);
  }
  const Eigen::Index count = std::min<Eigen::Index>(most, std::ssize(seen));
  for (Eigen::Index i = 0; i < count; ++i) {
    sample.push_back(seen[static_cast<std::size_t>(i * std::ssize(seen) / count)]);
  }
  return sample;
}

// Finds unit and size of a reading, and how well it fits.
void Judge(const HandAxes& axes, const KeypointOptions& options, Reading& reading) {
  constexpr int kSample = 12;
  constexpr double kSmallest = 0.5, kLargest = 1.6;
  Follower follower(axes, options.rate_hz);
  Points model;
  follower.Hand().Evaluate(axes.PoseOf(axes.Relaxed()), model, nullptr);
  const double size = SizeOf(reading.keypoints, model);
  if (options.meters_per_unit) {
    reading.unit = *options.meters_per_unit;
  } else {
    reading.unit = 0.0;
    for (const double unit : {1.0, 0.01, 0.001}) {
      if (size * unit > kSmallest && size * unit < kLargest) reading.unit = unit;
    }
    if (reading.unit == 0.0) return;
  }
  reading.keypoints *= reading.unit;
  reading.ratio = size * reading.unit;
  if (!(reading.ratio > 0.0)) return;
  // Noise makes bones longer: the size is that of the fitted hands.
  constexpr int kSizeRounds = 3;
  const std::vector<Eigen::Index> sample = SampleFrames(reading.keypoints, kSample);
  for (int round = 0; round < kSizeRounds; ++round) {
    double together = 0.0, own = 0.0, sum = 0.0;
    for (const Eigen::Index t : sample) {
      const Eigen::VectorXd targets = Scaled(reading.keypoints.col(t), reading.ratio);
      follower.Restart();
      const double rms = follower.Solve(targets);
      sum += rms * rms;
      SeenPoints seen(follower.Fitted(), targets);
      seen.points.colwise() -= seen.points.rowwise().mean().eval();
      seen.goals.colwise() -= seen.goals.rowwise().mean().eval();
      together += seen.points.cwiseProduct(seen.goals).sum();
      own += seen.points.squaredNorm();
    }
    reading.rms_m = std::sqrt(sum / static_cast<double>(sample.size()));
    if (round + 1 < kSizeRounds && own > 0.0) reading.ratio *= together / own;
  }
}

}  // namespace

KeypointHand::KeypointHand(const HandAxes& axes) {
  for (int j = 0; j < kJointsPerHand; ++j) {
    rest_.col(j) = axes.RestJoints().col(j);
    if (j % 3 > 0) rest_.col(j) -= axes.RestJoints().col(j - 1);
  }
  for (int f = 0; f < kNumFingers; ++f) {
    const Eigen::Vector3d tip = axes.RestTips().col(f) - axes.RestJoints().col(3 * f + 2);
    tips_.col(f) = tip * std::max(0.0, 1.0 - kTipInset_m / tip.norm());
  }
}

void KeypointHand::Evaluate(const FingerPose& fingers, Points& points, Jacobian* jacobian) const {
  if (jacobian) jacobian->setZero();
  points.col(0).setZero();
  for (int f = 0; f < kNumFingers; ++f) {
    const int first = 3 * kFingerOf[static_cast<std::size_t>(f)];
    std::array<Eigen::Matrix3d, 3> before, own;  // rotations of the parent, and of the joint
    std::array<Eigen::Vector3d, 3> place;
    Eigen::Matrix3d world = Eigen::Matrix3d::Identity();
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (int j = 0; j < 3; ++j) {
      at += world * rest_.col(first + j);
      points.col(1 + 4 * f + j) = at;
      place[j] = at;
      before[j] = world;
      own[j] = LeftJacobianSO3(fingers.segment<3>(3 * (first + j)));
      world = world * ExpSO3(fingers.segment<3>(3 * (first + j)));
    }
    points.col(4 + 4 * f) = at + world * tips_.col(first / 3);
    if (jacobian == nullptr) continue;
    for (int j = 0; j < 3; ++j) {
      // In the world of the hand, the joint turns by before * own * dw.
      const Eigen::Matrix3d turned = before[j] * own[j];
      for (int k = j + 1; k < 4; ++k) {
        const Eigen::Vector3d arm = points.col(1 + 4 * f + k) - place[j];
        jacobian->block<3, 3>(3 * (1 + 4 * f + k), 3 * (first + j)) = -Skew(arm) * turned;
      }
    }
  }
}

bool KeypointTerm::Evaluate(double const* const* parameters, double* residuals,
                            double** jacobians) const {
  const Eigen::Map<const Eigen::Quaterniond> turn(parameters[0]);
  const Eigen::Map<const Eigen::Vector3d> place(parameters[1]);
  const Eigen::Matrix3d R = turn.toRotationMatrix();
  Points points;
  KeypointHand::Jacobian J_fingers;
  const bool with_fingers = jacobians && jacobians[2];
  hand_.Evaluate(Eigen::Map<const FingerPose>(parameters[2]), points,
                 with_fingers ? &J_fingers : nullptr);
  Eigen::Map<Eigen::Matrix<double, 3 * kNumKeypoints, 1>> r(residuals);
  Eigen::Matrix<double, 3 * kNumKeypoints, 3> J_turn;
  for (int k = 0; k < kNumKeypoints; ++k) {
    const bool seen = SeenAt(targets_, k);
    r.segment<3>(3 * k).setZero();
    J_turn.middleRows<3>(3 * k).setZero();
    if (!seen) {
      if (with_fingers) J_fingers.middleRows<3>(3 * k).setZero();
      continue;
    }
    r.segment<3>(3 * k) = weight_ * (place + R * points.col(k) - targets_.segment<3>(3 * k));
    // q exp(delta): R (delta x k).
    J_turn.middleRows<3>(3 * k) = -weight_ * R * Skew(Eigen::Vector3d(points.col(k)));
    if (with_fingers) {
      J_fingers.middleRows<3>(3 * k) = (weight_ * R * J_fingers.middleRows<3>(3 * k)).eval();
    }
  }
  if (!jacobians) return true;
  if (jacobians[0]) {
    Eigen::Map<Eigen::Matrix<double, 3 * kNumKeypoints, 4, Eigen::RowMajor>>{jacobians[0]} =
        RotationManifold::Lift(J_turn, parameters[0]);
  }
  if (jacobians[1]) {
    Eigen::Map<Eigen::Matrix<double, 3 * kNumKeypoints, 3, Eigen::RowMajor>> J(jacobians[1]);
    for (int k = 0; k < kNumKeypoints; ++k) {
      J.middleRows<3>(3 * k) = (SeenAt(targets_, k) ? weight_ : 0.0) * Eigen::Matrix3d::Identity();
    }
  }
  if (with_fingers) Eigen::Map<KeypointHand::Jacobian>{jacobians[2]} = J_fingers;
  return true;
}

OptionTable OptionsOf(KeypointOptions& options) {
  OptionTable table;
  table.Group("Keypoints of a hand");
  table.Choice("hand", options.side,
               {{"auto", std::optional<Side>()}, {"right", Side::kRight}, {"left", Side::kLeft}},
               "Side of the hand; auto: the side that fits better, or right if the file has both "
               "hands");
  std::vector<std::pair<std::string, const KeypointOrder*>> orders = {{"auto", nullptr}};
  std::string help = "Order of the keypoints; auto: the one that fits. ";
  for (const KeypointOrder& order : KeypointOrders()) {
    orders.emplace_back(order.name, &order);
    help += fmt::format("{}{}: {}", orders.size() > 2 ? "; " : "", order.name, order.used_by);
  }
  table.Choice("order", options.order, orders, help);
  table.Number("meters_per_unit", "", options.meters_per_unit, {1e-6, 1e3},
               "m, cm or mm, detected from the size of the hand",
               "Length unit of the keypoints, in meters");
  table.Choice("up", options.up, UpAxisChoices(), "Up axis of the keypoints; auto: z, with a note");
  table.Number("fps", "", options.rate_hz, {1.0, 1000.0}, "Frames per second of the keypoints");
  return table;
}

SolvedKeypoints SolveKeypoints(const std::vector<KeypointTable>& tables,
                               const KeypointOptions& options, const std::string& where,
                               const StagedProgress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  const auto tell = [&](const char* stage, int done, int total) {
    if (progress && !progress(stage, done, total)) throw WorkStopped();
  };
  SolvedKeypoints solved;
  KeypointReport& report = solved.report;
  std::optional<Side> wanted = options.side;
  if (tables.size() > 1 && !wanted) {
    wanted = Side::kRight;
    report.notes.emplace_back("the file has two hands: the right one is used (--hand left)");
  }

  std::array<std::unique_ptr<HandModel>, 2> models;
  std::array<std::unique_ptr<HandAxes>, 2> axes;
  std::vector<Reading> readings;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    if (wanted && *wanted != side) continue;
    const auto i = static_cast<std::size_t>(side);
    models[i] = std::make_unique<HandModel>(DefaultHand(side), Eigen::VectorXd(), side);
    axes[i] = std::make_unique<HandAxes>(*models[i]);
    for (const KeypointTable& table : tables) {
      for (const KeypointOrder& order : KeypointOrders()) {
        if (order.count != table.points || (options.order && options.order != &order)) continue;
        readings.push_back({side, &order, table.In(order)});
      }
    }
  }
  if (readings.empty()) {
    throw Error(where,
                fmt::format("has {} points a frame, not the {} of --order {}", tables.at(0).points,
                            options.order->count, options.order->name),
                "Choose another order");
  }
  std::erase_if(readings,
                [](const Reading& reading) { return SampleFrames(reading.keypoints, 1).empty(); });
  if (readings.empty()) {
    throw Error(where, fmt::format("has no frame with {} keypoints", kMinKeypoints),
                "Give frames in which the hand was seen");
  }
  for (std::size_t i = 0; i < readings.size(); ++i) {
    tell("choosing side and order", static_cast<int>(i), static_cast<int>(readings.size()));
    Judge(*axes[static_cast<std::size_t>(readings[i].side)], options, readings[i]);
  }
  std::ranges::stable_sort(readings, {}, &Reading::rms_m);
  const Reading& best = readings[0];
  if (!std::isfinite(best.rms_m)) {
    throw Error(where, "does not have the size of a hand in meters, centimeters or millimeters",
                "Give the unit with --meters-per-unit; pixels and normalized image coordinates "
                "cannot be used");
  }
  report.side = best.side;
  report.order = best.order->name;
  report.meters_per_unit = best.unit;
  report.size_ratio = best.ratio;
  if (readings.size() > 1) report.other_rms_mm = 1e3 * readings[1].rms_m;

  const auto frames = static_cast<int>(best.keypoints.cols());
  const HandAxes& own = *axes[static_cast<std::size_t>(best.side)];
  Follower follower(own, options.rate_hz);
  Clip& clip = solved.clip;
  clip.surface_model_type = "mano";
  clip.frame_rate = options.rate_hz;
  clip.pose.assign(static_cast<std::size_t>(frames), JointPose::Zero());
  clip.trans.setZero(3, frames);
  const Eigen::Vector3d wrist =
      models[static_cast<std::size_t>(best.side)]->Surface().RestJoints().col(0);
  std::vector<int> with;
  double sum = 0.0;
  constexpr int kTell = 100;
  for (int t = 0; t < frames; ++t) {
    if (t % kTell == 0) tell("fitting", t, frames);
    if (CountSeen(best.keypoints.col(t)) < kMinKeypoints) {
      follower.Restart();
      continue;
    }
    const double rms = follower.Solve(Scaled(best.keypoints.col(t), best.ratio));
    sum += rms * rms;
    JointPose& pose = clip.pose[static_cast<std::size_t>(t)];
    pose.col(0) = LogSO3(follower.Turn().toRotationMatrix());
    if (!with.empty()) {
      pose.col(0) =
          UnwrapAxisAngle(pose.col(0), clip.pose[static_cast<std::size_t>(with.back())].col(0));
    }
    SetFingers(pose, best.side, follower.Fingers());
    clip.trans.col(t) = follower.Place() - wrist;
    with.push_back(t);
  }
  report.rms_mm = 1e3 * std::sqrt(sum / static_cast<double>(with.size()));
  report.gaps = frames - static_cast<int>(with.size());
  // Between two fitted frames in proportion; beyond the ends as there.
  std::size_t next = 0;
  for (int t = 0; t < frames; ++t) {
    while (next < with.size() && with[next] < t) ++next;
    if (next < with.size() && with[next] == t) continue;
    const int after = with[std::min(next, with.size() - 1)];
    const int before = with[next == 0 ? 0 : next - 1];
    const double share = after > before ? static_cast<double>(t - before) / (after - before) : 0.0;
    const JointPose &a = clip.pose[static_cast<std::size_t>(before)],
                    &b = clip.pose[static_cast<std::size_t>(after)];
    clip.pose[static_cast<std::size_t>(t)] = (1.0 - share) * a + share * b;
    clip.trans.col(t) = (1.0 - share) * clip.trans.col(before) + share * clip.trans.col(after);
  }
  if (!options.up) {
    report.notes.emplace_back(
        "keypoints do not state which way is up: z is assumed (--up overrides this; --up=-y for "
        "MediaPipe and for cameras of OpenCV)");
  }
  TurnWorld(clip, ZUpFrom(options.up.value_or(UpAxis::kZ)), wrist);
  report.solve_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return solved;
}

}  // namespace holdfast
