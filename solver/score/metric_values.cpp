// SPDX-License-Identifier: MIT
#include "solver/score/metric_values.h"

#include <algorithm>
#include <utility>

namespace holdfast {
namespace {

using Hands = std::span<const HandObjectScore>;

// Mean and maximum of what was seen; nothing of nothing.
class Spread {
 public:
  void Add(double value, double weight = 1.0) {
    max_ = weight_ > 0.0 ? std::max(max_, value) : value;
    sum_ += weight * value;
    weight_ += weight;
  }
  void Add(const std::optional<double>& value, double weight = 1.0) {
    if (value && weight > 0.0) Add(*value, weight);
  }
  std::optional<double> Mean() const {
    return weight_ > 0.0 ? std::optional(sum_ / weight_) : std::nullopt;
  }
  std::optional<double> Max() const { return weight_ > 0.0 ? std::optional(max_) : std::nullopt; }

 private:
  double sum_ = 0.0, max_ = 0.0, weight_ = 0.0;
};

// The volume shared by one hand in one frame: exact where known, else what stands in for it.
std::optional<double> Volume_cm3(const HandObjectFrame& frame, const ScoreOptions& options) {
  const HandObjectProtocol& protocol = options.hand_object;
  if (protocol.measure_exact && frame.exact_volume.Known()) {
    return 1e6 * frame.exact_volume.volume_m3;
  }
  if (!protocol.measure_voxels || options.exact == ExactMode::kOn) return std::nullopt;
  return frame.hand.intersection_volume_cm3;
}

// Sums over hands; unknown in a frame when it is of one of them.
void AddVolumes(Hands hands, const ScoreOptions& options, MetricValues& values) {
  Spread volume, exact;
  for (std::size_t t = 0; t < hands.front().frames.size(); ++t) {
    std::optional<double> sum = 0.0;
    bool all_exact = true;
    for (const HandObjectScore& hand : hands) {
      const std::optional<double> one = Volume_cm3(hand.frames[t], options);
      sum = sum && one ? std::optional(*sum + *one) : std::nullopt;
      all_exact = all_exact && hand.frames[t].exact_volume.Known();
    }
    volume.Add(sum);
    if (options.hand_object.measure_exact) exact.Add(all_exact ? 1.0 : 0.0);
  }
  values["intersection_volume_cm3"] = volume.Mean();
  values["intersection_volume_max_cm3"] = volume.Max();
  values["exact_volume_frames_ratio"] = exact.Mean();
}

void AddContact(Hands hands, const ScoreOptions& options, MetricValues& values) {
  const ContactScore score = ScoreContact(hands, options.deep_mm);
  values["deep_penetration_frames_ratio"] =
      score.deep_frames / static_cast<double>(score.frames.size());
  values["penetration_max_mm"] = score.penetration_max_mm;
  values["penetration_mean_max_mm"] = score.penetration_mean_max_mm;
  values["penetration_mean_mm"] = score.penetration_mean_mm;
  values["object_in_hand_max_mm"] = score.object_in_hand_max_mm;
  values["intersection_volume_voxel_cm3"] =
      options.hand_object.measure_voxels ? std::optional(score.voxel_volume_cm3) : std::nullopt;
  values["contact_frames_ratio"] = score.contact_frames_ratio;
  values["contact_ratio"] = score.contact_ratio;
  AddVolumes(hands, options, values);
  Spread iou, slip, slip_max, drift, drift_max;
  for (const HandObjectScore& hand : hands) {
    const ContactTrack& track = hand.track;
    const double weight = hand.FramesHeld();
    iou.Add(track.mean_iou, weight);
    slip.Add(track.mean_slip, weight);
    slip_max.Add(track.max_slip);
    drift.Add(track.mean_drift, weight);
    drift_max.Add(track.max_drift);
  }
  values["contact_iou"] = iou.Mean();
  values["contact_slip_mm_per_frame"] = slip.Mean();
  values["contact_slip_max_mm_per_frame"] = slip_max.Max();
  values["contact_drift_mm"] = drift.Mean();
  values["contact_drift_max_mm"] = drift_max.Max();
}

void AddJitter(Hands hands, MetricValues& values) {
  const CarryJitter jitter = MeanJitter(hands);
  values["jitter_acceleration_ratio"] = jitter.acceleration_ratio;
  values["jitter_jerk_ratio"] = jitter.jerk_ratio;
  values["jitter_angular_acceleration_ratio"] = jitter.angular_acceleration_ratio;
  values["jitter_angular_jerk_ratio"] = jitter.angular_jerk_ratio;
  values["object_acceleration_m_s2"] = jitter.object.acceleration_m_s2;
  values["object_jerk_m_s3"] = jitter.object.jerk_m_s3;
  values["object_angular_acceleration_rad_s2"] = jitter.object.angular_acceleration_rad_s2;
  values["object_angular_jerk_rad_s3"] = jitter.object.angular_jerk_rad_s3;
  values["wrist_acceleration_m_s2"] = jitter.wrist.acceleration_m_s2;
  values["wrist_jerk_m_s3"] = jitter.wrist.jerk_m_s3;
}

void AddBodyDepth(const BodyDepth& depth, const std::string& name, const ScoreOptions& options,
                  MetricValues& values) {
  values[name + "_frames_ratio"] = depth.DeepRatio(options.deep_mm);
  values[name + "_max_mm"] = depth.max_mm;
  values[name + "_mean_mm"] = depth.mean_mm;
}

void AddReference(const ReferenceScore& reference, MetricValues& values) {
  Spread global, root, right, left;
  for (const JointError& error : reference.joints) {
    global.Add(error.global);
    root.Add(error.root_aligned);
    right.Add(error.right_hand);
    left.Add(error.left_hand);
  }
  values["mpjpe_mm"] = global.Mean();
  values["mpjpe_root_aligned_mm"] = root.Mean();
  values["mpjpe_right_hand_mm"] = right.Mean();
  values["mpjpe_left_hand_mm"] = left.Mean();
  Spread translation, rotation, modulo, add, add_s, add_within, add_s_within;
  const double within = 0.1 * reference.diameter_mm;
  for (const ObjectPoseError& error : reference.object) {
    translation.Add(error.translation_mm);
    rotation.Add(error.rotation_deg);
    modulo.Add(error.rotation_modulo_deg);
    add.Add(error.add_mm);
    add_s.Add(error.add_s_mm);
    add_within.Add(error.add_mm < within ? 1.0 : 0.0);
    add_s_within.Add(error.add_s_mm < within ? 1.0 : 0.0);
  }
  values["object_translation_error_mm"] = translation.Mean();
  values["object_rotation_error_deg"] = rotation.Mean();
  values["object_rotation_error_modulo_symmetry_deg"] = modulo.Mean();
  values["object_add_mm"] = add.Mean();
  values["object_add_s_mm"] = add_s.Mean();
  values["object_add_within_ratio"] = add_within.Mean();
  values["object_add_s_within_ratio"] = add_s_within.Mean();
}

}  // namespace

MetricValues ClipValues(const ClipScore& score, const ScoreOptions& options) {
  MetricValues values;
  for (const MetricDefinition& metric : MetricDefinitions(options)) values[metric.key];
  if (!score.hands.empty()) {
    AddContact(score.hands, options, values);
    AddJitter(score.hands, values);
  }
  if (score.own_body) {
    if (score.own_body->object) {
      AddBodyDepth(*score.own_body->object, "object_in_body", options, values);
    }
    AddBodyDepth(score.own_body->arms, "self_penetration", options, values);
  }
  const MotionMetrics& motion = score.motion;
  values["joint_acceleration_m_s2"] = motion.joint_acceleration_m_s2.mean;
  values["joint_jerk_m_s3"] = motion.joint_jerk_m_s3.mean;
  values["foot_skate_mm_per_frame"] = motion.foot_skate_mm_per_frame;
  values["foot_slide_max_mm_per_frame"] = motion.foot_slide_max_mm_per_frame;
  if (score.reference) AddReference(*score.reference, values);
  return values;
}

MetricValues HandValues(const ClipScore& score, std::size_t hand, const ScoreOptions& options) {
  MetricValues values;
  AddContact({&score.hands[hand], 1}, options, values);
  AddJitter({&score.hands[hand], 1}, values);
  return values;
}

std::optional<MetricSummary> SummarizeMetric(const MetricDefinition& metric,
                                             std::span<const MetricValues> clips) {
  std::vector<double> known;
  MetricSummary summary;
  for (std::size_t c = 0; c < clips.size(); ++c) {
    const std::optional<double> value = clips[c].at(metric.key);
    if (!value) continue;
    const bool worse = metric.worse == MetricDefinition::Worse::kHigher ? *value > summary.worst
                                                                        : *value < summary.worst;
    if (known.empty() || worse) {
      summary.worst = *value;
      summary.worst_clip = c;
    }
    known.push_back(*value);
    summary.mean += *value;
  }
  if (known.empty()) return std::nullopt;
  summary.count = static_cast<int>(known.size());
  summary.mean /= summary.count;
  std::sort(known.begin(), known.end());
  const std::size_t middle = known.size() / 2;
  summary.median =
      known.size() % 2 == 1 ? known[middle] : 0.5 * (known[middle - 1] + known[middle]);
  return summary;
}

}  // namespace holdfast
