// SPDX-License-Identifier: MIT
#include "generator/matching/motion_player.h"

#include <algorithm>
#include <cmath>

namespace holdfast {
namespace {

constexpr double kSwinging = 0.03;     // m per frame: a foot this fast is no longer on the ground
constexpr double kAnchorShare = 0.35;  // of what is new in a slide, taken up per frame

}  // namespace

MotionPlayer::MotionPlayer(const MotionLibrary& library, MotionLibrary::Place start, double rate)
    : library_(library), clip_(start.clip), next_(start.frame), rate_(rate) {
  // Begins at the origin, facing -y.
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

// Where the body goes so that the feet that carry it stay: the mean slide of the planted feet,
// eased in and out.
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

}  // namespace holdfast
