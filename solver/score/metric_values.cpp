// SPDX-License-Identifier: MIT
#include "solver/score/metric_values.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "generator/walk_statistics/balance.h"
#include "geometry/rotation.h"
#include "solver/score/protocol_score.h"

namespace holdfast {
namespace {

using Hands = std::span<const HandObjectScore>;

// Mean and maximum of the added values; nothing if there are none.
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

// Intersection volume of one hand in one frame: exact where known, else its substitute.
std::optional<double> Volume_cm3(const HandObjectFrame& frame, const ScoreOptions& options) {
  const HandObjectProtocol& protocol = options.hand_object;
  if (protocol.measure_exact && frame.exact_volume.Known()) {
    return 1e6 * frame.exact_volume.volume_m3;
  }
  if (!protocol.measure_voxels || options.exact == ExactMode::kOn) return std::nullopt;
  return frame.hand.intersection_volume_cm3;
}

// Sums over hands; unknown in a frame if unknown for one of them.
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

// Over the frames in which each hand holds.
void AddFingers(Hands hands, MetricValues& values) {
  constexpr std::size_t kThumb = 4;
  Spread free, thumb_off, bend;
  for (const HandObjectScore& hand : hands) {
    for (std::size_t t = 0; t < hand.frames.size(); ++t) {
      if (!hand.Holds(t)) continue;
      const HandObjectFrame& frame = hand.frames[t];
      const auto touching =
          std::count(frame.finger_touches.begin(), frame.finger_touches.begin() + kThumb, true);
      free.Add(static_cast<double>(kThumb) - static_cast<double>(touching));
      thumb_off.Add(frame.fingertip_touches[kThumb] ? 0.0 : 1.0);
      bend.Add(frame.thumb_bend_deg);
    }
  }
  values["free_fingers"] = free.Mean();
  values["thumb_tip_off_frames_ratio"] = thumb_off.Mean();
  values["thumb_bend_deg"] = bend.Mean();
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
  AddFingers(hands, values);
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

void AddStanding(const ClipScore& score, MetricValues& values) {
  if (score.standing) {
    const StandingScore& standing = *score.standing;
    values["pelvis_range_mm"] = 1e3 * standing.pelvis_range_m;
    values["free_wrist_range_mm"] = 1e3 * standing.free_wrist_range_m;
    values["head_range_deg"] = standing.head_range_rad / kDegree;
    if (standing.gaze_off_rad) values["gaze_off_deg"] = *standing.gaze_off_rad / kDegree;
    values["trunk_lean_start_deg"] = standing.lean_start_rad / kDegree;
    values["head_down_start_deg"] = standing.head_down_start_rad / kDegree;
    values["end_speed_m_s"] = standing.end_speed_m_s;
  }
  if (score.vessel) {
    values["vessel_tilt_start_deg"] = score.vessel->start_rad / kDegree;
    values["vessel_tilt_max_deg"] = score.vessel->max_rad / kDegree;
  }
}

void AddReference(const ReferenceScore& reference, MetricValues& values) {
  const auto mean = [](const auto& frames, const auto& value) {
    Spread spread;
    for (const auto& frame : frames) spread.Add(std::invoke(value, frame));
    return spread.Mean();
  };
  values["mpjpe_mm"] = mean(reference.joints, &JointError::global);
  values["mpjpe_root_aligned_mm"] = mean(reference.joints, &JointError::root_aligned);
  values["mpjpe_right_hand_mm"] = mean(reference.joints, &JointError::right_hand);
  values["mpjpe_left_hand_mm"] = mean(reference.joints, &JointError::left_hand);
  using O = ObjectPoseError;
  const auto within = [&](double O::*distance) {
    return [&, distance](const O& error) {
      return error.*distance < 0.1 * reference.diameter_mm ? 1.0 : 0.0;
    };
  };
  values["object_translation_error_mm"] = mean(reference.object, &O::translation_mm);
  values["object_rotation_error_deg"] = mean(reference.object, &O::rotation_deg);
  values["object_rotation_error_modulo_symmetry_deg"] =
      mean(reference.object, &O::rotation_modulo_deg);
  values["object_add_mm"] = mean(reference.object, &O::add_mm);
  values["object_add_s_mm"] = mean(reference.object, &O::add_s_mm);
  values["object_add_within_ratio"] = mean(reference.object, within(&O::add_mm));
  values["object_add_s_within_ratio"] = mean(reference.object, within(&O::add_s_mm));
}

// Undefined for a body that never stands still.
void AddBalance(std::span<const double> off_balance_m, MetricValues& values) {
  Spread falls, off;
  for (const double off_m : off_balance_m) {
    if (std::isnan(off_m)) continue;
    falls.Add(off_m > kOffBalance_m ? 1.0 : 0.0);
    off.Add(1e3 * off_m);
  }
  values["off_balance_frames_ratio"] = falls.Mean();
  values["off_balance_max_mm"] = off.Max();
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
    const auto in_table = [&](const std::optional<BodyDepth>& depth, const std::string& name) {
      if (!depth) return;
      values[name + "_in_table_frames_ratio"] = depth->DeepRatio(options.deep_mm);
      values[name + "_in_table_max_mm"] = depth->max_mm;
    };
    in_table(score.own_body->object_in_table, "object");
    in_table(score.own_body->arms_in_table, "arms");
  }
  if (!score.in_air.empty()) {
    values["object_in_mid_air_frames_ratio"] =
        static_cast<double>(std::ranges::count(score.in_air, std::uint8_t{1})) /
        static_cast<double>(score.in_air.size());
  }
  AddBalance(score.off_balance_m, values);
  AddStanding(score, values);
  const MotionMetrics& motion = score.motion;
  values["joint_acceleration_m_s2"] = motion.joint_acceleration_m_s2.mean;
  values["joint_jerk_m_s3"] = motion.joint_jerk_m_s3.mean;
  values["foot_skate_mm_per_frame"] = motion.foot_skate_mm_per_frame;
  values["foot_slide_max_mm_per_frame"] = motion.foot_slide_max_mm_per_frame;
  if (score.reference) AddReference(*score.reference, values);
  for (const auto& [key, value] : score.by_protocol) values[key] = value;
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

std::vector<MetricDefinition> MetricDefinitions(const ScoreOptions& options) {
  using enum MetricDefinition::Group;
  using enum MetricDefinition::Worse;
  const HandObjectProtocol& protocol = options.hand_object;
  const double voxel = protocol.contact.voxel_mm;
  const double threshold = protocol.contact.contact_threshold_mm;
  std::vector<MetricDefinition> list;
  const auto contact = [&](const char* key, std::string label, const char* unit, int digits,
                           MetricDefinition::Worse worse, std::string definition) {
    list.push_back(
        {key, std::move(label), unit, digits, worse, kContact, true, true, std::move(definition)});
  };
  const auto jitter = [&](const char* key, const char* label, const char* unit, int digits,
                          const char* definition) {
    list.push_back({key, label, unit, digits, kHigher, kJitter, true, false, definition});
  };
  const auto other = [&](MetricDefinition::Group group, const char* key, const char* label,
                         const char* unit, int digits, MetricDefinition::Worse worse,
                         const char* definition, bool hand_surface = false) {
    list.push_back({key, label, unit, digits, worse, group, false, hand_surface, definition});
  };

  contact("deep_penetration_frames_ratio",
          fmt::format("frames deeper than {:g} mm", options.deep_mm), "%", 1, kHigher,
          fmt::format("fraction of frames in which a hand vertex is inside the object, or an "
                      "object vertex inside the hand, by more than {:g} mm",
                      options.deep_mm));
  contact("penetration_max_mm", "penetration, deepest", "mm", 2, kHigher,
          "maximum depth over all frames of hand vertices inside the object and of object vertices "
          "inside the hand; exact signed distance to the triangles of the other mesh");
  contact("penetration_mean_max_mm", "penetration, mean of deepest", "mm", 2, kHigher,
          "mean over all frames of the maximum depth in the frame, in both directions as above; 0 "
          "where nothing is inside");
  contact("penetration_mean_mm", "penetration, mean of vertices", "mm", 2, kHigher,
          "mean over all frames of the mean depth of the hand vertices inside the object; 0 where "
          "none is inside");
  contact("object_in_hand_max_mm", "object in hand, deepest", "mm", 2, kHigher,
          "maximum depth over all frames of object vertices inside the hand's mesh (closed at the "
          "wrist by a fan)");
  contact("intersection_volume_cm3", "intersection volume", "cm3", 3, kHigher,
          protocol.measure_exact
              ? fmt::format("mean over all frames of the volume shared by object and hand (closed "
                            "at the wrist): exact, by cutting both meshes along their common "
                            "curve; {}",
                            options.exact == ExactMode::kOn || !protocol.measure_voxels
                                ? "frames where the exact volume is undefined are left out"
                                : fmt::format("by voxels of {:g} mm in frames where the exact "
                                              "volume is undefined (exact_volume_frames_ratio)",
                                              voxel))
              : fmt::format("mean over all frames of the volume shared by object and hand (closed "
                            "at the wrist), by voxels of {:g} mm",
                            voxel));
  contact("intersection_volume_max_cm3", "intersection volume, largest", "cm3", 3, kHigher,
          "maximum over all frames, measured in the same way");
  contact("intersection_volume_voxel_cm3", fmt::format("  by {:g} mm voxels", voxel), "cm3", 3,
          kHigher,
          fmt::format("the same mean by voxels: cubes of {:g} mm whose centers are inside both, on "
                      "a grid fixed to the object's frame",
                      voxel));
  contact("exact_volume_frames_ratio", "  exact in frames", "%", 1, kLower,
          "fraction of frames in which the exact volume is defined");
  contact("contact_frames_ratio", "frames in contact", "%", 1, kLower,
          fmt::format("fraction of the frames in which a hand holds the object (all frames if the "
                      "clip does not specify them) where a vertex of a holding hand is inside the "
                      "object or within {:g} mm of its surface",
                      threshold));
  contact("contact_ratio", "hand in contact", "%", 1, kLower,
          fmt::format("mean over the frames in which the hand holds the object of the fraction of "
                      "hand vertices within {:g} mm of the surface, on either side",
                      threshold));
  contact("free_fingers", "fingers off the object", "", 2, kHigher,
          fmt::format("mean over the frames in which the hand holds the object of the number of "
                      "fingers, without the thumb, that have no vertex within {:g} mm of it",
                      threshold));
  contact("thumb_tip_off_frames_ratio", "thumb tip off the object", "%", 1, kHigher,
          fmt::format("fraction of the frames in which the hand holds the object where the thumb's "
                      "last phalanx has no vertex within {:g} mm of it",
                      threshold));
  contact("thumb_bend_deg", "thumb bend", "deg", 1, kLower,
          "mean over the frames in which the hand holds the object of the angle between the "
          "thumb's first and last bone");
  contact(
      "contact_iou", "contact kept (IoU)", "%", 1, kLower,
      fmt::format(
          "mean over pairs of consecutive frames in which the hand holds the object of |A and B| / "
          "|A or B|, where A and B are the sets of vertices with signed distance below {:g} mm",
          threshold));
  contact("contact_slip_mm_per_frame", "slip, mean", "mm/frame", 3, kHigher,
          "mean over pairs of consecutive frames, and over the vertices in contact in both, of the "
          "smaller of two displacements in the object's frame: that of the vertex and that of the "
          "surface point nearest to it");
  contact("contact_slip_max_mm_per_frame", "slip, largest", "mm/frame", 2, kHigher,
          "maximum of the same displacement over all vertices and frames");
  contact("contact_drift_mm", "contact drift, mean", "mm", 2, kHigher,
          "the same displacement measured from where a vertex's contact began, maximum over the "
          "contact; mean over the vertices that are in contact in two consecutive frames");
  contact("contact_drift_max_mm", "contact drift, largest", "mm", 2, kHigher,
          "maximum drift of any vertex: how far contact points move over the clip");

  std::ranges::move(ProtocolMetrics(options.protocol), std::back_inserter(list));

  jitter("jitter_acceleration_ratio", "object/hand acceleration", "", 3,
         "mean acceleration of the object's center (by surface area) divided by that of a point "
         "fixed to the wrist at the center's mean position: 1 if the object is carried rigidly; "
         "undefined if the hand is still (below 1 mm/s2)");
  jitter("jitter_jerk_ratio", "object/hand jerk", "", 3, "the same for jerk");
  jitter("jitter_angular_acceleration_ratio", "object/hand angular accel.", "", 3,
         "mean angular acceleration of the object divided by that of the wrist");
  jitter("jitter_angular_jerk_ratio", "object/hand angular jerk", "", 3,
         "the same for angular jerk");
  jitter("object_acceleration_m_s2", "object acceleration", "m/s2", 3,
         "mean norm of the central second difference of the object's center at the clip's frame "
         "rate, over frames in which the hand holds the object");
  jitter("object_jerk_m_s3", "object jerk", "m/s3", 2,
         "mean norm of the central third difference over five frames");
  jitter("object_angular_acceleration_rad_s2", "object angular accel.", "rad/s2", 2,
         "mean norm of the difference of successive angular velocities");
  jitter("object_angular_jerk_rad_s3", "object angular jerk", "rad/s3", 1,
         "mean norm of the second difference of angular velocities");
  jitter("wrist_acceleration_m_s2", "wrist acceleration", "m/s2", 3,
         "the same for the wrist joint");
  jitter("wrist_jerk_m_s3", "wrist jerk", "m/s3", 2, "the same for the wrist joint");

  const std::string deeper =
      fmt::format("fraction of frames in which it is above {:g} mm", options.deep_mm);
  other(kBody, "object_in_body_frames_ratio", "object deep in the body", "%", 1, kHigher,
        ("maximum depth of the object's vertices and of 2,000 points on its surface, spread by "
         "area, inside the trunk, neck, head, legs and arms that never hold it: " +
         deeper)
            .c_str(),
        true);
  other(kBody, "object_in_body_max_mm", "object in the body, deepest", "mm", 2, kHigher,
        "maximum of this depth over frames", true);
  other(kBody, "object_in_body_mean_mm", "object in the body, mean", "mm", 2, kHigher,
        "mean of this depth over frames, 0 where nothing is inside", true);
  other(kBody, "self_penetration_frames_ratio", "arms deep in the body", "%", 1, kHigher,
        ("maximum depth of the vertices of both hands and forearms (from 8 cm off the elbow) "
         "inside the trunk, neck, head and legs: " +
         deeper)
            .c_str(),
        true);
  other(kBody, "self_penetration_max_mm", "arms in the body, deepest", "mm", 2, kHigher,
        "maximum of this depth over frames", true);
  other(kBody, "self_penetration_mean_mm", "arms in the body, mean", "mm", 2, kHigher,
        "mean of this depth over frames, 0 where nothing is inside", true);

  other(kBody, "object_in_table_frames_ratio", "object deep in the table", "%", 1, kHigher,
        ("maximum depth of the object in the clip's table: " + deeper).c_str(), true);
  other(kBody, "object_in_table_max_mm", "object in the table, deepest", "mm", 2, kHigher,
        "maximum of this depth over frames", true);
  other(kBody, "arms_in_table_frames_ratio", "arms deep in the table", "%", 1, kHigher,
        ("maximum depth of both hands and forearms in the clip's table: " + deeper).c_str(), true);
  other(kBody, "arms_in_table_max_mm", "arms in the table, deepest", "mm", 2, kHigher,
        "maximum of this depth over frames", true);

  other(kBody, "object_in_mid_air_frames_ratio", "object in mid-air", "%", 1, kHigher,
        "fraction of frames in which the object is still (below 2 cm/s), farther than 1 cm from "
        "the skin, and more than 2 cm above the ground and the clip's table",
        true);

  other(kBody, "off_balance_frames_ratio", "off balance", "%", 1, kHigher,
        "fraction of the frames in which the person stands still (pelvis below 0.1 m/s) where the "
        "center of mass, seen from above, is more than 3 cm outside of the feet on the ground");
  other(kBody, "off_balance_max_mm", "off balance, largest", "mm", 1, kHigher,
        "maximum distance of the center of mass from the feet in these frames");

  other(kStanding, "pelvis_range_mm", "pelvis, range", "mm", 0, kLower,
        "largest horizontal distance of two positions of the pelvis");
  other(kStanding, "free_wrist_range_mm", "free wrist, range", "mm", 0, kLower,
        "largest distance between two positions of the wrist of the hand that holds the object in "
        "fewer frames (if equal, of the wrist that moves less)");
  other(kStanding, "head_range_deg", "head, range", "deg", 1, kLower,
        "largest angle between two directions of the face");
  other(kStanding, "gaze_off_deg", "face from the object", "deg", 1, kHigher,
        "mean angle between the direction of the face and the line from the eyes to the object's "
        "center (without an object: to the other wrist), over frames in which it is more than 30 "
        "cm from the eyes");
  other(kStanding, "trunk_lean_start_deg", "lean at the start", "deg", 1, kHigher,
        "forward angle between the vertical and the line from pelvis to neck, in the first frame");
  other(kStanding, "head_down_start_deg", "face down at the start", "deg", 1, kHigher,
        "angle of the face's direction below the horizontal, in the first frame");
  other(kStanding, "end_speed_m_s", "speed at the end", "m/s", 3, kHigher,
        "displacement of the fastest body joint over the last 0.2 s, divided by that time");
  other(kStanding, "vessel_tilt_start_deg", "vessel's tilt, start", "deg", 1, kHigher,
        "angle between the direction of the object's opening and the vertical, in the first frame; "
        "undefined for an object without an opening");
  other(kStanding, "vessel_tilt_max_deg", "vessel's tilt, largest", "deg", 1, kHigher,
        "maximum of this angle over frames");

  other(kMotion, "joint_acceleration_m_s2", "joint acceleration", "m/s2", 3, kHigher,
        "mean over 22 body joints and frames of the second central difference");
  other(kMotion, "joint_jerk_m_s3", "joint jerk", "m/s3", 2, kHigher,
        "mean over 22 body joints and frames of the third central difference");
  other(kMotion, "foot_skate_mm_per_frame", "foot skate", "mm/frame", 3, kHigher,
        "mean over frames and feet of v (2 - 2^(h / 25 mm)) where h < 25 mm: v is the horizontal "
        "displacement of the ball of the foot, h its height above its minimum in the clip");
  other(kMotion, "foot_slide_max_mm_per_frame", "foot slide, largest", "mm/frame", 2, kHigher,
        "maximum horizontal displacement of the ball of a foot between frames while h < 5 mm in "
        "both");

  other(kReference, "mpjpe_mm", "MPJPE", "mm", 2, kHigher,
        "mean distance of the 22 body joints from those of the reference, in world coordinates");
  other(kReference, "mpjpe_root_aligned_mm", "MPJPE, pelvis aligned", "mm", 2, kHigher,
        "the same after aligning the pelvis positions; nothing is rotated or scaled");
  other(kReference, "mpjpe_right_hand_mm", "MPJPE, right hand", "mm", 2, kHigher,
        "mean distance of 21 points (wrist, 15 finger joints, 5 fingertip vertices) after aligning "
        "the wrist positions",
        true);
  other(kReference, "mpjpe_left_hand_mm", "MPJPE, left hand", "mm", 2, kHigher,
        "the same for the left hand", true);
  other(kReference, "object_translation_error_mm", "object, translation", "mm", 2, kHigher,
        "distance of the object's center (by surface area) from the reference's");
  other(kReference, "object_rotation_error_deg", "object, rotation", "deg", 2, kHigher,
        "angle between the rotations");
  other(kReference, "object_rotation_error_modulo_symmetry_deg", "  modulo symmetry", "deg", 2,
        kHigher, "smallest angle over the object's rotational symmetries (stated per clip)");
  other(kReference, "object_add_mm", "object, ADD", "mm", 2, kHigher,
        "mean over all mesh vertices of the distance between the same vertex in both poses");
  other(kReference, "object_add_s_mm", "object, ADD-S", "mm", 2, kHigher,
        "mean over all mesh vertices of the distance to the nearest vertex of the reference pose");
  other(kReference, "object_add_within_ratio", "  ADD < 0.1 diameter", "%", 1, kLower,
        "fraction of frames with ADD below a tenth of the greatest distance between two vertices");
  other(kReference, "object_add_s_within_ratio", "  ADD-S < 0.1 diameter", "%", 1, kLower,
        "the same for ADD-S");
  return list;
}

}  // namespace holdfast
