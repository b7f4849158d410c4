// SPDX-License-Identifier: MIT
#include "generator/imos/key_frames.h"

#include <vector>

#include <fmt/format.h>

#include "geometry/clip/resample.h"
#include "geometry/error.h"

namespace holdfast::imos {
namespace {

constexpr int kPaperSteps = 20;  // into which the published code divides the contact

Clip Picked(const Clip& clip, int first, int step) {
  std::vector<int> frames(kNumKeyFrames);
  for (int k = 0; k < kNumKeyFrames; ++k) frames[k] = first + k * step;
  Clip out = clip;
  out.frame_rate = clip.frame_rate / step;
  out.trans = clip.trans(Eigen::all, frames);
  const auto pick_track = [&](const std::optional<ObjectTrack>& from,
                              std::optional<ObjectTrack>& to) {
    if (!from) return;
    to->trans = from->trans(Eigen::all, frames);
    to->orient = from->orient(Eigen::all, frames);
  };
  pick_track(clip.object, out.object);
  pick_track(clip.table, out.table);
  out.pose.clear();
  out.holding_hand.clear();
  for (const int frame : frames) {
    out.pose.push_back(clip.pose[frame]);
    if (!clip.holding_hand.empty()) out.holding_hand.push_back(clip.holding_hand[frame]);
  }
  if (clip.contact && clip.contact->object.size() > 0) {
    out.contact->object = clip.contact->object(Eigen::all, frames);
  }
  if (clip.contact && clip.contact->body.size() > 0) {
    out.contact->body = clip.contact->body(Eigen::all, frames);
  }
  return out;
}

}  // namespace

std::optional<std::pair<int, int>> ContactInterval(const Clip& clip) {
  const bool labelled = clip.contact && clip.contact->object.size() > 0;
  if (!labelled && clip.holding_hand.empty()) return std::nullopt;
  std::optional<std::pair<int, int>> interval;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const bool touches =
        labelled ? (clip.contact->object.col(t).array() != 0).any() : clip.holding_hand[t] != 0;
    if (!touches) continue;
    if (!interval) interval.emplace(t, t);
    interval->second = t;
  }
  return interval;
}

std::optional<std::string> LackOfKeyFrames(const Clip& clip, KeyFrameRule rule) {
  if (clip.NumFrames() < kNumKeyFrames) {
    return fmt::format("the clip has {} frames, {} are needed", clip.NumFrames(), kNumKeyFrames);
  }
  if (rule == KeyFrameRule::kWhole) return std::nullopt;
  const auto contact = ContactInterval(clip);
  if (!contact) return "nothing touches the object, or nothing says so";
  const int frames = contact->second - contact->first;
  if (frames >= kPaperSteps) return std::nullopt;
  return fmt::format("the object is touched for {} frames, more than {} are needed", frames + 1,
                     kPaperSteps);
}

Clip KeyFramesOf(const Clip& clip, KeyFrameRule rule) {
  if (const auto lack = LackOfKeyFrames(clip, rule)) {
    throw Error("key frames", *lack,
                rule == KeyFrameRule::kPaper ? "Give clips with contact, or take the whole of them"
                                             : "Give longer clips");
  }
  if (rule == KeyFrameRule::kWhole) {
    const double step = static_cast<double>(clip.NumFrames() - 1) / (kNumKeyFrames - 1);
    return Resample(clip, clip.frame_rate / step);
  }
  const auto [first, last] = *ContactInterval(clip);
  return Picked(clip, first, (last - first) / kPaperSteps);
}

}  // namespace holdfast::imos
