// SPDX-License-Identifier: MIT
#include "geometry/clip/resample.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {

namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kMaxFrames = 2e6;  // 2.6 GB for a clip; 18 hours at 30 Hz

// Position of an output frame among the input frames.
struct Between {
  int before = 0, after = 0;
  double share = 0.0;
};

Matrix3Xd ChordPoints(const Matrix3Xd& x, const std::vector<Between>& times) {
  Matrix3Xd out(3, times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const Between& t = times[i];
    out.col(i) = (1 - t.share) * x.col(t.before) + t.share * x.col(t.after);
  }
  return out;
}

Matrix3Xd ChordRotations(const Matrix3Xd& x, const std::vector<Between>& times) {
  Matrix3Xd out(3, times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const Vector3d a = x.col(times[i].before), b = x.col(times[i].after);
    if (times[i].share == 0) {
      out.col(i) = a;
      continue;
    }
    const Matrix3d Ra = ExpSO3(a);
    const Matrix3d R = Ra * ExpSO3(times[i].share * LogSO3(Ra.transpose() * ExpSO3(b)));
    out.col(i) = UnwrapAxisAngle(LogSO3(R), a);
  }
  return out;
}

// Slopes at the frames from those of the intervals between them (3 x F-1): zero at the ends and
// where a component reverses, otherwise their mean, limited to three times the smaller one.
Matrix3Xd Slopes(const Matrix3Xd& stretches) {
  const Eigen::Index frames = stretches.cols() + 1;
  Matrix3Xd slopes = Matrix3Xd::Zero(3, frames);
  for (Eigen::Index t = 1; t + 1 < frames; ++t) {
    for (int c = 0; c < 3; ++c) {
      const double a = stretches(c, t - 1), b = stretches(c, t);
      if (a * b <= 0) continue;
      const double most = 3.0 * std::min(std::abs(a), std::abs(b));
      slopes(c, t) = std::clamp(0.5 * (a + b), -most, most);
    }
  }
  return slopes;
}

Matrix3Xd CurvePoints(const Matrix3Xd& x, const std::vector<Between>& times) {
  const Matrix3Xd stretches = x.rightCols(x.cols() - 1) - x.leftCols(x.cols() - 1);
  const Matrix3Xd slopes = Slopes(stretches);
  Matrix3Xd out(3, times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto [before, after, s] = times[i];
    out.col(i) = (1 + 2 * s) * (1 - s) * (1 - s) * x.col(before) +
                 s * s * (3 - 2 * s) * x.col(after) + s * (1 - s) * (1 - s) * slopes.col(before) -
                 s * s * (1 - s) * slopes.col(after);
  }
  return out;
}

Matrix3Xd CurveRotations(const Matrix3Xd& x, const std::vector<Between>& times) {
  const Eigen::Index frames = x.cols();
  std::vector<Matrix3d> R(frames);
  for (Eigen::Index t = 0; t < frames; ++t) R[t] = ExpSO3(x.col(t));
  // In the coordinates of the frame itself, so that the slopes of both sides are comparable.
  Matrix3Xd stretches(3, frames - 1);
  for (Eigen::Index t = 0; t + 1 < frames; ++t) {
    stretches.col(t) = LogSO3(R[t].transpose() * R[t + 1]);
  }
  const Matrix3Xd slopes = Slopes(stretches);
  const auto blend = [](const Matrix3d& a, const Matrix3d& b, double s) -> Matrix3d {
    return a * ExpSO3(s * LogSO3(a.transpose() * b));
  };
  Matrix3Xd out(3, times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto [before, after, s] = times[i];
    if (s == 0) {
      out.col(i) = x.col(before);
      continue;
    }
    const Matrix3d second = R[before] * ExpSO3(slopes.col(before) / 3.0);
    const Matrix3d third = R[after] * ExpSO3(-slopes.col(after) / 3.0);
    const Matrix3d a = blend(R[before], second, s), b = blend(second, third, s),
                   c = blend(third, R[after], s);
    out.col(i) = UnwrapAxisAngle(LogSO3(blend(blend(a, b, s), blend(b, c, s), s)), x.col(before));
  }
  return out;
}

// Samples translations and rotations at these times, in frames, along curves or chords.
Clip AtTimes(const Clip& clip, const std::vector<double>& at, double frame_rate, bool curved) {
  const int frames = clip.NumFrames(), count = static_cast<int>(at.size());
  std::vector<Between> times(at.size());
  std::vector<int> nearest(at.size());
  for (int i = 0; i < count; ++i) {
    times[i].before = std::min(static_cast<int>(at[i] + 1e-9), frames - 1);
    times[i].after = std::min(times[i].before + 1, frames - 1);
    times[i].share = std::clamp(at[i] - times[i].before, 0.0, 1.0);
    if (times[i].share < 1e-9) times[i].share = 0.0;
    nearest[i] = times[i].share < 0.5 ? times[i].before : times[i].after;
  }
  const auto points = [&](const Matrix3Xd& x) {
    return curved ? CurvePoints(x, times) : ChordPoints(x, times);
  };
  const auto rotations = [&](const Matrix3Xd& x) {
    return curved ? CurveRotations(x, times) : ChordRotations(x, times);
  };
  Clip out = clip;
  out.frame_rate = frame_rate;
  out.trans = points(clip.trans);
  out.pose.resize(count);
  Matrix3Xd joint(3, frames);
  for (int j = 0; j < kNumJoints; ++j) {
    for (int t = 0; t < frames; ++t) joint.col(t) = clip.pose[t].col(j);
    const Matrix3Xd turned = rotations(joint);
    for (int i = 0; i < count; ++i) out.pose[i].col(j) = turned.col(i);
  }
  for (const auto& [from, to] :
       {std::pair{&clip.object, &out.object}, std::pair{&clip.table, &out.table}}) {
    if (!*from) continue;
    (*to)->trans = points((*from)->trans);
    (*to)->orient = rotations((*from)->orient);
  }
  if (!clip.holding_hand.empty()) {
    out.holding_hand.resize(count);
    for (int i = 0; i < count; ++i) out.holding_hand[i] = clip.holding_hand[nearest[i]];
  }
  if (clip.contact) {
    if (clip.contact->object.size() > 0) {
      out.contact->object = clip.contact->object(Eigen::all, nearest);
    }
    if (clip.contact->body.size() > 0) out.contact->body = clip.contact->body(Eigen::all, nearest);
  }
  return out;
}

Clip ResampleAlong(const Clip& clip, double frame_rate, bool curved) {
  if (!(frame_rate > 0)) {
    throw Error("resampling", "the frame rate is not positive", "Give frames per second");
  }
  const int frames = clip.NumFrames();
  if (frames == 0 || std::abs(frame_rate - clip.frame_rate) < 1e-9) return clip;
  const double step = clip.frame_rate / frame_rate;
  const double frames_after = std::floor((frames - 1) / step + 1e-6) + 1;
  if (!(frames_after <= kMaxFrames)) {
    throw Error("resampling",
                fmt::format("{} frames at {:g} Hz would be {:g} at {:g} Hz, more than {:g}", frames,
                            clip.frame_rate, frames_after, frame_rate, kMaxFrames),
                "Cut the clip into parts, or check the frame rates");
  }
  std::vector<double> at(static_cast<std::size_t>(frames_after));
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = static_cast<double>(i) * step;
  return AtTimes(clip, at, frame_rate, curved);
}

}  // namespace

Clip Resample(const Clip& clip, double frame_rate) {
  return ResampleAlong(clip, frame_rate, false);
}

Clip ResampleAt(const Clip& clip, const std::vector<double>& frames) {
  for (const double at : frames) {
    if (at >= 0.0 && at <= clip.NumFrames() - 1) continue;
    throw Error("resampling",
                fmt::format("frame {:g} does not exist: there are {} frames", at, clip.NumFrames()),
                "Give times from 0 to the last frame");
  }
  return AtTimes(clip, frames, clip.frame_rate, false);
}

Clip ResampleSmoothly(const Clip& clip, double frame_rate) {
  return ResampleAlong(clip, frame_rate, true);
}

Clip TakeFrames(const Clip& clip, const std::vector<int>& frames) {
  Clip taken = clip;
  const auto choose = [&](auto& columns) { columns = columns(Eigen::all, frames).eval(); };
  choose(taken.trans);
  for (std::optional<ObjectTrack>* track : {&taken.object, &taken.table}) {
    if (!*track) continue;
    choose((*track)->trans);
    choose((*track)->orient);
  }
  if (taken.contact) {
    for (ContactLabels::Matrix* labels : {&taken.contact->object, &taken.contact->body}) {
      if (labels->size() > 0) choose(*labels);
    }
  }
  taken.pose.clear();
  taken.holding_hand.clear();
  for (const int t : frames) {
    const auto frame = static_cast<std::size_t>(t);
    taken.pose.push_back(clip.pose[frame]);
    if (!clip.holding_hand.empty()) taken.holding_hand.push_back(clip.holding_hand[frame]);
  }
  return taken;
}

std::vector<int> EvenFrames(int num_frames, int count) {
  std::vector<int> frames;
  count = std::min(count, num_frames);
  for (int k = 0; k < count; ++k) {
    frames.push_back(count == 1 ? 0 : k * (num_frames - 1) / (count - 1));
  }
  return frames;
}

std::vector<int> EveryFrame(int num_frames, int every) {
  std::vector<int> frames;
  for (int t = 0; t < num_frames; t += every) frames.push_back(t);
  return frames;
}

std::vector<int> FramesAtRate(int num_frames, double clip_frame_rate, double frames_per_second) {
  std::vector<int> frames;
  for (int k = 0;; ++k) {
    const double frame = std::round(k * clip_frame_rate / frames_per_second);
    if (frame > num_frames - 1) return frames;
    frames.push_back(static_cast<int>(frame));
  }
}

}  // namespace holdfast
