// SPDX-License-Identifier: MIT
#include "geometry/score/contact_score.h"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace holdfast {
namespace {

ContactScore::Frame ScoreFrame(std::span<const HandObjectScore> hands, std::size_t t) {
  ContactScore::Frame all;
  all.min_distance_mm = std::numeric_limits<double>::infinity();
  double depth_sum = 0.0, inside = 0.0;
  int holding = 0;
  for (const HandObjectScore& hand : hands) {
    const HandObjectFrame& one = hand.frames[t];
    all.penetration_mm = std::max(all.penetration_mm, one.DeepestPenetration_mm());
    all.object_in_hand_mm = std::max(all.object_in_hand_mm, one.object_max_penetration_mm);
    all.min_distance_mm = std::min(all.min_distance_mm, one.hand.min_distance_mm);
    all.voxel_volume_cm3 += one.hand.intersection_volume_cm3;
    depth_sum += one.hand.mean_penetration_mm * one.hand.penetrating_ratio;
    inside += one.hand.penetrating_ratio;
    if (!hand.Holds(t)) continue;
    ++holding;
    all.in_contact = all.in_contact || one.hand.in_contact;
    all.contact_ratio += one.hand.contact_ratio;
  }
  all.held = holding > 0;
  if (inside > 0.0) all.mean_penetration_mm = depth_sum / inside;
  if (holding > 1) all.contact_ratio /= holding;
  return all;
}

}  // namespace

ContactScore ScoreContact(std::span<const HandObjectScore> hands, double deep_mm) {
  ContactScore score;
  const std::size_t count = hands.empty() ? 0 : hands.front().frames.size();
  double in_contact = 0.0, held = 0.0, ratios = 0.0, holds = 0.0;
  for (std::size_t t = 0; t < count; ++t) {
    const ContactScore::Frame& frame = score.frames.emplace_back(ScoreFrame(hands, t));
    score.penetration_max_mm = std::max(score.penetration_max_mm, frame.penetration_mm);
    score.object_in_hand_max_mm = std::max(score.object_in_hand_max_mm, frame.object_in_hand_mm);
    score.penetration_mean_max_mm += frame.penetration_mm;
    score.penetration_mean_mm += frame.mean_penetration_mm;
    score.voxel_volume_cm3 += frame.voxel_volume_cm3;
    score.deep_frames += frame.penetration_mm > deep_mm;
    held += frame.held;
    in_contact += frame.in_contact;
    for (const HandObjectScore& hand : hands) {
      if (!hand.Holds(t)) continue;
      ++holds;
      ratios += hand.frames[t].hand.contact_ratio;
    }
  }
  if (count > 0) {
    const auto frames = static_cast<double>(count);
    score.penetration_mean_max_mm /= frames;
    score.penetration_mean_mm /= frames;
    score.voxel_volume_cm3 /= frames;
  }
  if (held > 0.0) score.contact_frames_ratio = in_contact / held;
  if (holds > 0.0) score.contact_ratio = ratios / holds;
  return score;
}

CarryJitter MeanJitter(std::span<const HandObjectScore> hands) {
  const auto mean = [&](const auto& get) {
    double sum = 0.0, weight = 0.0;
    for (const HandObjectScore& hand : hands) {
      const std::optional<double> value = get(hand.jitter);
      if (!value) continue;
      sum += hand.FramesHeld() * *value;
      weight += hand.FramesHeld();
    }
    return weight > 0.0 ? std::optional(sum / weight) : std::nullopt;
  };
  const auto unevenness = [&](Unevenness CarryJitter::*part) {
    return Unevenness{
        mean([&](const CarryJitter& j) { return (j.*part).acceleration_m_s2; }),
        mean([&](const CarryJitter& j) { return (j.*part).jerk_m_s3; }),
        mean([&](const CarryJitter& j) { return (j.*part).angular_acceleration_rad_s2; }),
        mean([&](const CarryJitter& j) { return (j.*part).angular_jerk_rad_s3; })};
  };
  return {unevenness(&CarryJitter::object),
          unevenness(&CarryJitter::wrist),
          unevenness(&CarryJitter::follower),
          mean([](const CarryJitter& j) { return j.acceleration_ratio; }),
          mean([](const CarryJitter& j) { return j.jerk_ratio; }),
          mean([](const CarryJitter& j) { return j.angular_acceleration_ratio; }),
          mean([](const CarryJitter& j) { return j.angular_jerk_ratio; })};
}

}  // namespace holdfast
