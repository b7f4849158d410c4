// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/motion_style.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "generator/walk_statistics/gait.h"
#include "generator/walk_statistics/hand_way.h"
#include "generator/walk_statistics/power_spectrum.h"
#include "generator/walk_statistics/sample_statistics.h"
#include "generator/walk_statistics/way_pace.h"
#include "generator/wandr/reach_outcome.h"
#include "geometry/body/skeleton.h"

namespace holdfast {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kRate = 30.0;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kMoving = 0.3;       // m/s, over kTravelFrames to both sides
constexpr int kTravelFrames = 7;      // half a second in all: longer than the sway of one step
constexpr int kTurnFrames = 4;        // a quarter of a second in all
constexpr double kSpeeding = 2.0;     // m/s
constexpr double kSideways = 45.0;    // degrees
constexpr double kStillArm = 0.01;    // meters of swing: below, its phase means nothing
constexpr double kUsualStride = 1.1;  // seconds, where a motion has no stride to measure

double ShareOf(const std::vector<double>& values, double above) {
  if (values.empty()) return kNone;
  const auto count = std::ranges::count_if(values, [&](double v) { return v > above; });
  return static_cast<double>(count) / static_cast<double>(values.size());
}

VectorXd Histogram(const std::vector<double>& values, StyleCurve curve) {
  const StyleCurveInfo& info = StyleCurves()[static_cast<std::size_t>(curve)];
  if (values.empty()) return {};
  VectorXd shares = VectorXd::Zero(info.points);
  for (const double value : values) {
    const double bin = std::floor((value - info.begin) / info.step);
    shares[static_cast<Eigen::Index>(std::clamp(bin, 0.0, info.points - 1.0))] += 1.0;
  }
  return shares / static_cast<double>(values.size());
}

// A signal less its mean over `window` frames about each; nothing where the window leaves the
// motion. A swing that repeats every `window` frames comes through as it is.
std::vector<std::optional<double>> AboutItsMean(const VectorXd& signal, int window) {
  std::vector<std::optional<double>> about(static_cast<std::size_t>(signal.size()));
  for (Eigen::Index t = 0; t < signal.size(); ++t) {
    const Eigen::Index begin = t - window / 2;
    if (begin < 0 || begin + window > signal.size()) continue;
    about[static_cast<std::size_t>(t)] = signal[t] - signal.segment(begin, window).mean();
  }
  return about;
}

class Measurer {
 public:
  Measurer(std::span<const BodyFrame> frames, const StyleBody& body, MotionStyle& style)
      : frames_(frames), body_(body), style_(style), count_(static_cast<int>(frames.size())) {
    placed_ = Place(body.rest_joints, frames);
    soles_ = SolePoints(body.rest_joints, body.sole_y).At(placed_);
    contacts_ = FindContacts(soles_, kRate);
    for (int t = 0; t < count_; ++t) {
      const Vector2d travel = TravelAt(t);
      travel_.push_back(travel);
      moving_.push_back(travel.norm() > kMoving ? 1.0 : 0.0);
    }
  }

  void MeasureAll() {
    MeasureFeet();
    MeasureSteps();
    MeasureWay();
    MeasureHeading();
    MeasureSwing();
    MeasureTrunk();
    MeasureJoints();
    MeasureLimits();
    MeasureHand();
  }

 private:
  void Set(StyleMeasure measure, double value) {
    style_.values[static_cast<std::size_t>(measure)] = value;
  }
  void Set(StyleCurve curve, VectorXd points) {
    style_.curves[static_cast<std::size_t>(curve)] = std::move(points);
  }
  Vector2d Ground(int t, int joint = 0) const { return placed_[t].joints.col(joint).head<2>(); }
  bool Moving(int t) const { return moving_[t] > 0.0; }
  Vector2d Heading(int t) const {
    return Eigen::Rotation2Dd(Yaw(frames_[t])) * Vector2d(0.0, -1.0);
  }

  // Velocity of the pelvis over half a second, m/s.
  Vector2d TravelAt(int t) const {
    const int begin = std::max(t - kTravelFrames, 0), end = std::min(t + kTravelFrames, count_ - 1);
    if (end == begin) return Vector2d::Zero();
    return (Ground(end) - Ground(begin)) * (kRate / (end - begin));
  }

  void MeasureFeet() {
    std::vector<double> left, right, both, none, depth;
    for (int t = 0; t < count_; ++t) {
      depth.push_back(std::max(0.0, -soles_[t].row(2).minCoeff()));
      if (!Moving(t)) continue;
      const bool on_left = (contacts_[t] & kLeftSole) != 0, on_right = contacts_[t] & kRightSole;
      left.push_back(on_left);
      right.push_back(on_right);
      both.push_back(on_left && on_right);
      none.push_back(!on_left && !on_right);
    }
    Set(StyleMeasure::kLeftPlanted, MeanOf(left));
    Set(StyleMeasure::kRightPlanted, MeanOf(right));
    Set(StyleMeasure::kBothPlanted, MeanOf(both));
    Set(StyleMeasure::kNonePlanted, MeanOf(none));
    Set(StyleMeasure::kSoleDepth, MeanOf(depth));
    Set(StyleMeasure::kSoleDepthWorst, QuantileOf(depth, 0.99));

    const std::vector<double> drifts = ContactDrifts(contacts_, soles_);
    Set(StyleMeasure::kContactDrift, MeanOf(drifts));
    Set(StyleMeasure::kContactDriftWorst, QuantileOf(drifts, 0.95));

    Eigen::MatrixXf joints(wandr::kJointNumbers, count_);
    for (int t = 0; t < count_; ++t) {
      Eigen::Map<wandr::BodyJoints<float>>(joints.col(t).data()) = placed_[t].joints.cast<float>();
    }
    const wandr::ReachOutcome outcome = wandr::MeasureReach(joints, Vector3d::Zero());
    Set(StyleMeasure::kAirborne, outcome.airborne_share);
    if (count_ < 2) return;
    Set(StyleMeasure::kSkatingJoints, outcome.skating_share);
    if (body_.surface == nullptr) return;
    wandr::StateMatrix<float> states(wandr::kStateSize, count_);
    for (int t = 0; t < count_; ++t) {
      wandr::Pose<double> pose;
      pose.translation = frames_[t].pelvis - body_.rest_joints.col(0);
      for (int j = 0; j < kNumBodyJoints; ++j) {
        pose.rotation[j] = frames_[t].local[j].toRotationMatrix();
      }
      states.col(t) = wandr::StateOf(pose).cast<float>();
    }
    Set(StyleMeasure::kSkating, wandr::SkatingOfLowestVertex(*body_.surface, states));
  }

  void MeasureSteps() {
    const std::vector<Stance> stances = FindStances(contacts_, soles_);
    std::vector<double> seconds, lengths, times, lifts;
    for (const Stance& stance : stances) {
      if (stance.begin > 0 && stance.end < count_) seconds.push_back(stance.Frames() / kRate);
    }
    for (const Stride& stride : FindStrides(stances, soles_, kRate)) {
      lengths.push_back(0.5 * stride.length_m);
      lifts.push_back(stride.height_m);
      if (std::isfinite(stride.duration_s)) times.push_back(stride.duration_s);
    }
    Set(StyleMeasure::kStanceSeconds, QuantileOf(seconds, 0.5));
    Set(StyleMeasure::kStepLength, QuantileOf(lengths, 0.5));
    Set(StyleMeasure::kFootLift, QuantileOf(lifts, 0.5));
    const double stride_s = QuantileOf(times, 0.5);
    Set(StyleMeasure::kStepFrequency, 2.0 / stride_s);
    Set(StyleMeasure::kWalkRatio, QuantileOf(lengths, 0.5) * 0.5 * stride_s);
    Set(StyleCurve::kStepLengths, Histogram(lengths, StyleCurve::kStepLengths));
    const double known_s = std::isfinite(stride_s) ? std::clamp(stride_s, 0.6, 2.0) : kUsualStride;
    stride_frames_ = static_cast<int>(std::lround(known_s * kRate));
  }

  void MeasureWay() {
    std::vector<double> speeds, moving;
    for (int t = 0; t + 1 < count_; ++t) {
      const double speed = (Ground(t + 1) - Ground(t)).norm() * kRate;
      speeds.push_back(speed);
      if (Moving(t)) moving.push_back(speed);
      style_.way_m = std::max(style_.way_m, (Ground(t + 1) - Ground(0)).norm());
    }
    Set(StyleMeasure::kSpeedMoving, MeanOf(moving));
    Set(StyleMeasure::kSpeedHigh, QuantileOf(speeds, 0.95));
    Set(StyleMeasure::kSpeedPeak, QuantileOf(speeds, 1.0));
    Set(StyleMeasure::kSpeeding, ShareOf(speeds, kSpeeding));
    Set(StyleCurve::kSpeeds, Histogram(speeds, StyleCurve::kSpeeds));
    const int points = StyleCurves()[static_cast<std::size_t>(StyleCurve::kSpeedProfile)].points;
    WayPace pace = MeasurePace(speeds, points);
    Set(StyleMeasure::kHalfWay, pace.half_way_ratio);
    Set(StyleMeasure::kFastestFifth, pace.fastest_fifth_ratio);
    Set(StyleCurve::kSpeedProfile, std::move(pace.profile));
  }

  void MeasureHeading() {
    std::vector<double> off, turns;
    for (int t = 0; t < count_; ++t) {
      if (Moving(t)) {
        const double cosine = Heading(t).dot(travel_[t].normalized());
        off.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)) * kDegrees);
      }
      const int begin = t - kTurnFrames, end = t + kTurnFrames;
      if (begin < 0 || end >= count_) continue;
      const double turn =
          std::remainder(Yaw(frames_[end]) - Yaw(frames_[begin]), 2.0 * std::numbers::pi);
      turns.push_back(std::abs(turn) * kDegrees * kRate / (end - begin));
    }
    Set(StyleMeasure::kHeadingOff, MeanOf(off));
    Set(StyleMeasure::kHeadingSideways, ShareOf(off, kSideways));
    Set(StyleMeasure::kTurnRate, QuantileOf(turns, 0.95));
    Set(StyleCurve::kHeadings, Histogram(off, StyleCurve::kHeadings));
  }

  // Where a joint is along the heading, against the pelvis or the middle of the shoulders.
  VectorXd Along(int joint, bool of_shoulders) const {
    VectorXd along(count_);
    for (int t = 0; t < count_; ++t) {
      const Vector2d origin =
          of_shoulders ? Vector2d(0.5 * (Ground(t, kLeftShoulder) + Ground(t, kRightShoulder)))
                       : Ground(t);
      along[t] = Heading(t).dot(Ground(t, joint) - origin);
    }
    return along;
  }

  void MeasureSwing() {
    VectorXd height(count_);
    for (int t = 0; t < count_; ++t) height[t] = placed_[t].joints(2, 0);
    const auto bob = AboutItsMean(height, stride_frames_);
    double squares = 0.0;
    int seen = 0;
    for (int t = 0; t < count_; ++t) {
      if (!Moving(t) || !bob[t]) continue;
      squares += *bob[t] * *bob[t];
      ++seen;
    }
    if (seen > 0) Set(StyleMeasure::kPelvisBob, std::sqrt(squares / seen));

    std::vector<double> correlations;
    for (const Side side : {Side::kLeft, Side::kRight}) {
      const int other_ankle = side == Side::kLeft ? 8 : 7;
      const auto wrist = AboutItsMean(Along(WristJoint(side), true), stride_frames_);
      const auto ankle = AboutItsMean(Along(other_ankle, false), stride_frames_);
      double ww = 0.0, aa = 0.0, wa = 0.0;
      int frames = 0;
      for (int t = 0; t < count_; ++t) {
        if (!Moving(t) || !wrist[t]) continue;
        ww += *wrist[t] * *wrist[t];
        aa += *ankle[t] * *ankle[t];
        wa += *wrist[t] * *ankle[t];
        ++frames;
      }
      if (frames < stride_frames_ / 2) continue;
      const double swing = std::sqrt(2.0 * ww / frames), step = std::sqrt(2.0 * aa / frames);
      Set(side == Side::kLeft ? StyleMeasure::kArmSwingLeft : StyleMeasure::kArmSwingRight, swing);
      if (swing > kStillArm && step > kStillArm) correlations.push_back(wa / std::sqrt(ww * aa));
    }
    Set(StyleMeasure::kArmLegCorrelation, MeanOf(correlations));
  }

  void MeasureTrunk() {
    std::vector<double> leans, moving;
    for (int t = 0; t < count_; ++t) {
      const Vector3d trunk = placed_[t].joints.col(kNeck) - placed_[t].joints.col(0);
      leans.push_back(std::atan2(trunk.head<2>().norm(), trunk.z()) * kDegrees);
      if (Moving(t)) moving.push_back(leans.back());
    }
    Set(StyleMeasure::kLeanMoving, MeanOf(moving));
    Set(StyleMeasure::kLean, MeanOf(leans));
    Set(StyleMeasure::kLeanHigh, QuantileOf(leans, 0.95));
    Set(StyleCurve::kLeans, Histogram(leans, StyleCurve::kLeans));
  }

  void MeasureJoints() {
    if (count_ < 3) return;
    std::vector<double> accelerations, jerks;
    Eigen::MatrixXd second(wandr::kJointNumbers, count_ - 2);
    std::vector<double> weights;
    for (int t = 1; t + 1 < count_; ++t) {
      const auto difference = [&](int at) -> wandr::BodyJoints<double> {
        return (placed_[at + 1].joints - 2.0 * placed_[at].joints + placed_[at - 1].joints) *
               kRate * kRate;
      };
      const wandr::BodyJoints<double> a = difference(t);
      second.col(t - 1) = a.reshaped();
      weights.push_back(moving_[t]);
      for (int j = 0; j < kNumBodyJoints; ++j) accelerations.push_back(a.col(j).norm());
      if (t + 2 >= count_) continue;
      const wandr::BodyJoints<double> jerk = (difference(t + 1) - a) * kRate;
      for (int j = 0; j < kNumBodyJoints; ++j) jerks.push_back(jerk.col(j).norm());
    }
    Set(StyleMeasure::kAcceleration, MeanOf(accelerations));
    Set(StyleMeasure::kAccelerationHigh, QuantileOf(std::move(accelerations), 0.99));
    Set(StyleMeasure::kJerk, MeanOf(jerks));

    PowerSpectrum power = EstimatePower(second, kRate, weights);
    if (power.density.size() == 0) return;
    const double whole = power.Power(0.0, 0.5 * kRate);
    if (whole > 0.0) {
      Set(StyleMeasure::kPower0To1, power.Power(0.0, 1.0) / whole);
      Set(StyleMeasure::kPower1To2, power.Power(1.0, 2.0) / whole);
      Set(StyleMeasure::kPower2To4, power.Power(2.0, 4.0) / whole);
      Set(StyleMeasure::kPower4To8, power.Power(4.0, 8.0) / whole);
      Set(StyleMeasure::kPower8To15, power.Power(8.0, 0.5 * kRate) / whole);
    }
    Set(StyleCurve::kPower, power.density / kNumBodyJoints);
  }

  void MeasureLimits() {
    if (body_.limits == nullptr) return;
    int beyond = 0;
    double excess = 0.0;
    for (const BodyFrame& frame : frames_) {
      for (int j = 1; j < kNumBodyJoints; ++j) {
        const double over = frame.local[j].angularDistance(Eigen::Quaterniond::Identity()) -
                            (*body_.limits)[static_cast<std::size_t>(j)];
        if (over <= 0.0) continue;
        ++beyond;
        excess += over * kDegrees;
      }
    }
    Set(StyleMeasure::kBeyondLimits, beyond / (count_ * (kNumBodyJoints - 1.0)));
    Set(StyleMeasure::kBeyondLimitsBy, beyond > 0 ? excess / beyond : 0.0);
  }

  // Of the hand that gets farther from where it was.
  void MeasureHand() {
    Eigen::Matrix3Xd farther;
    double farthest = -1.0;
    for (const Side side : {Side::kRight, Side::kLeft}) {
      Eigen::Matrix3Xd path = HandPath(frames_, placed_, side);
      const double far = (path.colwise() - path.col(0)).colwise().norm().maxCoeff();
      if (far <= farthest) continue;
      farthest = far;
      farther = std::move(path);
    }
    const int points = StyleCurves()[static_cast<std::size_t>(StyleCurve::kHandSpeed)].points;
    HandWay way = MeasureHandWay(farther, kRate, points);
    Set(StyleMeasure::kHandWay, way.length_m);
    Set(StyleMeasure::kHandSeconds, way.seconds);
    Set(StyleMeasure::kHandPeak, way.peak_m_s);
    Set(StyleMeasure::kHandTimeToPeak, way.time_to_peak_ratio);
    Set(StyleMeasure::kHandStraightness, way.straightness_ratio);
    Set(StyleMeasure::kHandSubmovements, way.submovements);
    Set(StyleCurve::kHandSpeed, std::move(way.profile));
  }

  std::span<const BodyFrame> frames_;
  const StyleBody& body_;
  MotionStyle& style_;
  int count_;
  std::vector<BodyPlacement> placed_;
  std::vector<Soles> soles_;
  std::vector<SoleBits> contacts_;
  std::vector<Vector2d> travel_;
  std::vector<double> moving_;  // 1 in moving frames, else 0
  int stride_frames_ = 0;
};

bool IsNumbers(const BodyFrame& frame) {
  return frame.pelvis.allFinite() &&
         std::ranges::all_of(frame.local, [](const auto& q) { return q.coeffs().allFinite(); });
}

}  // namespace

MotionStyle MeasureStyle(std::span<const BodyFrame> frames, const StyleBody& body) {
  MotionStyle style;
  style.values.fill(kNone);
  const auto end = std::ranges::find_if_not(frames, IsNumbers);
  style.frames = static_cast<int>(end - frames.begin());
  style.cut = end != frames.end();
  if (style.frames == 0) return style;
  Measurer(frames.first(style.frames), body, style).MeasureAll();
  style.faults = FindReachFaults(frames.first(style.frames), body.rest_joints);
  return style;
}

}  // namespace holdfast
