// SPDX-License-Identifier: MIT
#include "generator/matching/motion_player.h"

#include <algorithm>
#include <cmath>

#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kSwinging = 0.03;     // m per frame: a faster foot is not on the ground
constexpr double kAnchorShare = 0.35;  // fraction of a change in slide corrected per frame

}  // namespace

MotionPlayer::MotionPlayer(const MotionLibrary& library, MotionLibrary::Place start, double rate)
    : library_(library), clip_(start.clip), next_(start.frame), rate_(rate) {
  // Starts at the origin, facing -y.
  move_ = AlignHeading(Sample(clip_, next_), BodyFrame());
  segments_.push_back({0, clip_, next_, rate_});
}

BodyFrame MotionPlayer::Sample(int clip, double frame) const {
  const std::vector<BodyFrame>& frames = library_.Clips()[clip].frames;
  const double last = static_cast<double>(frames.size()) - 1.0;
  const double at = std::clamp(frame, 0.0, last);
  const auto before = static_cast<std::size_t>(at);
  return Interpolate(frames[before], frames[std::min(before + 1, frames.size() - 1)],
                     at - static_cast<double>(before));
}

BodyFrame MotionPlayer::Next() const {
  return blend_.Apply(move_ * Sample(clip_, next_), blend_frames_ / MotionLibrary::kFrameRate);
}

bool MotionPlayer::CanStep() const {
  return next_ + rate_ <= static_cast<double>(library_.Clips()[clip_].frames.size()) - 1.0;
}

// Moves the body so that planted feet stay in place: removes the mean slide of the planted feet,
// low-pass filtered.
void MotionPlayer::Anchor(BodyFrame& frame, SoleBits contact) {
  Soles soles = library_.SolesOfBody().At(Place(library_.RestJoints(), frame));
  Eigen::Vector2d slide = Eigen::Vector2d::Zero();
  int planted = 0;
  for (const int heel : {0, 2}) {
    const unsigned both = frames_.empty() ? 0u : contact & contacts_.back() & (3u << heel);
    if (both == 0) continue;
    const int point = (both & (2u << heel)) != 0 ? heel + 1 : heel;
    const Eigen::Vector2d moved = (soles.col(point) - soles_.col(point)).head<2>();
    if (moved.norm() > kSwinging) continue;
    slide += moved;
    ++planted;
  }
  if (planted > 0) slide /= planted;
  anchor_ += kAnchorShare * (slide - anchor_);
  frame.pelvis.head<2>() -= anchor_;
  move_.shift -= anchor_;
  soles_ = soles;
  soles_.topRows<2>().colwise() -= anchor_;
}

void MotionPlayer::Step() {
  const auto nearest = static_cast<std::size_t>(next_ + 0.5);
  const SoleBits contact = library_.Clips()[clip_].contacts[nearest];
  BodyFrame frame = Next();
  Anchor(frame, contact);
  frames_.push_back(frame);
  contacts_.push_back(contact);
  next_ += rate_;
  ++blend_frames_;
}

MotionLibrary::Place MotionPlayer::At() const {
  const int last = static_cast<int>(library_.Clips()[clip_].frames.size()) - 1;
  return {clip_, std::clamp(static_cast<int>(next_ - rate_ + 0.5), 0, last), 0.0f};
}

PlanarMove MotionPlayer::MoveFor(MotionLibrary::Place place) const {
  return AlignHeading(Sample(place.clip, place.frame), Next());
}

void MotionPlayer::Jump(MotionLibrary::Place place, double rate, double blend_s) {
  const BodyFrame old_now = Next();
  const PlanarMove move = MoveFor(place);
  const BodyFrame new_now = move * Sample(place.clip, place.frame);
  const BodyFrame new_before = move * Sample(place.clip, place.frame - rate);
  blend_ =
      MotionBlend(frames_.back(), old_now, new_before, new_now, MotionLibrary::kFrameRate, blend_s);
  blend_frames_ = 0;
  move_ = move;
  clip_ = place.clip;
  next_ = place.frame;
  rate_ = rate;
  segments_.push_back({static_cast<int>(frames_.size()), clip_, next_, rate_});
}

WalkState MotionPlayer::State() const {
  WalkState state;
  const BodyFrame& now = frames_.back();
  state.place = now.pelvis.head<2>();
  state.yaw_rad = Yaw(now);
  const std::size_t span = std::min<std::size_t>(5, frames_.size() - 1);
  if (span > 0) {
    const BodyFrame& before = frames_[frames_.size() - 1 - span];
    state.velocity = (now.pelvis - before.pelvis).head<2>() * MotionLibrary::kFrameRate /
                     static_cast<double>(span);
  }
  return state;
}

namespace {

// Limits for offset velocities: larger ones are capture noise and would overshoot.
constexpr double kMaxTurnRate = 3.0;  // rad/s
constexpr double kMaxSpeed = 0.8;     // m/s

Eigen::Vector3d Turn(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  return LogSO3((to * from.conjugate()).toRotationMatrix());
}

Eigen::Vector3d Limited(const Eigen::Vector3d& v, double limit) {
  const double norm = v.norm();
  return norm > limit ? Eigen::Vector3d(v * (limit / norm)) : v;
}

}  // namespace

MotionBlend::MotionBlend(const BodyFrame& old_before, const BodyFrame& old_now,
                         const BodyFrame& new_before, const BodyFrame& new_now, double frame_rate,
                         double duration_s)
    : duration_s_(duration_s) {
  for (int j = 0; j < kNumBodyJoints; ++j) {
    offset_.col(j) = Turn(new_now.local[j], old_now.local[j]);
    const Eigen::Vector3d before = Turn(new_before.local[j], old_before.local[j]);
    velocity_.col(j) = Limited(frame_rate * (offset_.col(j) - before), kMaxTurnRate);
  }
  offset_.col(kNumBodyJoints) = old_now.pelvis - new_now.pelvis;
  const Eigen::Vector3d before = old_before.pelvis - new_before.pelvis;
  velocity_.col(kNumBodyJoints) =
      Limited(frame_rate * (offset_.col(kNumBodyJoints) - before), kMaxSpeed);
}

BodyFrame MotionBlend::Apply(const BodyFrame& frame, double time_s) const {
  if (time_s >= duration_s_) return frame;
  const double s = std::max(time_s, 0.0) / duration_s_;
  const double s3 = s * s * s;
  // Quintic Hermite polynomials for the initial value and the initial velocity.
  const double value = 1.0 + s3 * (-10.0 + s * (15.0 - 6.0 * s));
  const double slope = s + s3 * (-6.0 + s * (8.0 - 3.0 * s));
  const Offsets left = value * offset_ + slope * duration_s_ * velocity_;
  BodyFrame blended = frame;
  for (int j = 0; j < kNumBodyJoints; ++j) {
    blended.local[j] = (Eigen::Quaterniond(ExpSO3(left.col(j))) * frame.local[j]).normalized();
  }
  blended.pelvis += left.col(kNumBodyJoints);
  return blended;
}

namespace {

using Eigen::Vector2d;

constexpr double kStep = 1.0 / 30.0;    // seconds
constexpr double kVelocityTime = 0.25;  // time constant of velocity changes, s
constexpr double kTurnTime = 0.2;       // time constant of heading changes, s
constexpr double kFastestTurn = 3.5;    // rad/s
constexpr double kSlowDown = 0.6;       // m before the target
constexpr double kFaceAsAsked = 0.7;    // m before the target

}  // namespace

Vector2d Facing(double yaw_rad) { return {std::sin(yaw_rad), -std::cos(yaw_rad)}; }

double YawToFace(const Vector2d& direction) { return std::atan2(direction.x(), -direction.y()); }

FuturePath PlanWalk(const WalkState& now, const WalkTarget& target) {
  WalkState walker = now;
  FuturePath path;
  for (int step = 1; step <= 30; ++step) {
    const Vector2d to_go = target.place - walker.place;
    const double distance = to_go.norm();
    const double asked = distance > kFaceAsAsked ? YawToFace(to_go) : target.yaw_rad;
    const double off = std::remainder(asked - walker.yaw_rad, 2.0 * M_PI);
    walker.yaw_rad += std::clamp(off / kTurnTime, -kFastestTurn, kFastestTurn) * kStep;
    Vector2d velocity = Vector2d::Zero();
    if (distance > 1e-6) {
      double speed = target.speed * std::min(1.0, distance / kSlowDown);
      // A walker turns around before walking off.
      if (distance > kFaceAsAsked) speed *= std::clamp(0.35 + 0.65 * std::cos(off), 0.1, 1.0);
      velocity = speed * to_go / distance;
    }
    walker.velocity += (velocity - walker.velocity) * (kStep / kVelocityTime);
    walker.place += walker.velocity * kStep;
    if (step % 10 != 0) continue;
    const int column = step / 10 - 1;
    path.col(column) = Eigen::Rotation2Dd(-now.yaw_rad) * Vector2d(walker.place - now.place);
    path.col(3 + column) = Facing(walker.yaw_rad - now.yaw_rad);
  }
  return path;
}

FuturePath PlanStand() {
  FuturePath path = FuturePath::Zero();
  path.rightCols<3>().row(1).setConstant(-1.0);
  return path;
}

}  // namespace holdfast
