// SPDX-License-Identifier: MIT
#include "solver/score/score_output.h"

namespace holdfast {
namespace {

using Json = nlohmann::json;

Json Value(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json Values(const MetricValues& values) {
  Json json = Json::object();
  for (const auto& [key, value] : values) json[key] = Value(value);
  return json;
}

template <typename Items, typename Get>
Json Series(const Items& items, const Get& get) {
  Json series = Json::array();
  for (const auto& item : items) series.push_back(get(item));
  return series;
}

Json PerFrame(const HandObjectScore& hand, const ScoreOptions& options) {
  using F = HandObjectFrame;
  const std::vector<F>& frames = hand.frames;
  Json json = {
      {"hand_in_object_mm", Series(frames, [](const F& f) { return f.hand.max_penetration_mm; })},
      {"hand_in_object_mean_mm",
       Series(frames, [](const F& f) { return f.hand.mean_penetration_mm; })},
      {"object_in_hand_mm", Series(frames, [](const F& f) { return f.object_max_penetration_mm; })},
      {"object_in_hand_mean_mm",
       Series(frames, [](const F& f) { return f.object_mean_penetration_mm; })},
      {"object_vertices_in_hand",
       Series(frames, [](const F& f) { return f.object_vertices_inside; })},
      {"contact_ratio", Series(frames, [](const F& f) { return f.hand.contact_ratio; })},
      {"in_contact", Series(frames, [](const F& f) { return f.hand.in_contact; })},
      {"min_distance_mm", Series(frames, [](const F& f) { return f.hand.min_distance_mm; })},
      {"contact_iou", Series(hand.track.steps, [](const ContactStep& s) { return Value(s.iou); })},
      {"contact_slip_mm",
       Series(hand.track.steps, [](const ContactStep& s) { return Value(s.slip_mm); })},
      {"contact_drift_mm",
       Series(hand.track.drift_mm, [](const std::optional<double>& d) { return Value(d); })}};
  if (options.hand_object.measure_exact) {
    json["intersection_volume_exact_cm3"] = Series(frames, [](const F& f) {
      return f.exact_volume.Known() ? Json(1e6 * f.exact_volume.volume_m3) : Json(nullptr);
    });
    json["intersection_volume_exact_status"] =
        Series(frames, [](const F& f) { return Describe(f.exact_volume.status); });
  }
  if (options.hand_object.measure_voxels) {
    json["intersection_volume_voxel_cm3"] =
        Series(frames, [](const F& f) { return f.hand.intersection_volume_cm3; });
  }
  return json;
}

Json PerFrame(const ReferenceScore& reference) {
  using J = JointError;
  using O = ObjectPoseError;
  Json json = {
      {"mpjpe_mm", Series(reference.joints, [](const J& j) { return j.global; })},
      {"mpjpe_root_aligned_mm",
       Series(reference.joints, [](const J& j) { return j.root_aligned; })},
      {"mpjpe_right_hand_mm", Series(reference.joints, [](const J& j) { return j.right_hand; })},
      {"mpjpe_left_hand_mm", Series(reference.joints, [](const J& j) { return j.left_hand; })}};
  if (reference.object.empty()) return json;
  json["object_translation_error_mm"] =
      Series(reference.object, [](const O& o) { return o.translation_mm; });
  json["object_rotation_error_deg"] =
      Series(reference.object, [](const O& o) { return o.rotation_deg; });
  json["object_rotation_error_modulo_symmetry_deg"] =
      Series(reference.object, [](const O& o) { return o.rotation_modulo_deg; });
  json["object_add_mm"] = Series(reference.object, [](const O& o) { return o.add_mm; });
  json["object_add_s_mm"] = Series(reference.object, [](const O& o) { return o.add_s_mm; });
  return json;
}

Json SymmetryJson(const ObjectSymmetry& symmetry) {
  Json json = {{"found", Describe(symmetry)},
               {"rotations", symmetry.rotations.size()},
               {"deviation_mm", symmetry.deviation_mm},
               {"center_m", {symmetry.center.x(), symmetry.center.y(), symmetry.center.z()}}};
  if (symmetry.axis) {
    json["axis"] = {symmetry.axis->x(), symmetry.axis->y(), symmetry.axis->z()};
  }
  return json;
}

Json ClipJson(const ClipScore& score, const ScoreOptions& options, bool per_frame) {
  Json json = {{"source", score.source},
               {"frames", score.frames},
               {"frame_rate_hz", score.frame_rate},
               {"body", score.body},
               {"foreign_body", score.foreign_body},
               {"notes", score.notes},
               {"values", Values(ClipValues(score, options))},
               {"hands", Json::array()}};
  if (!score.hands.empty()) {
    json["protocol"] = {
        {"object", score.object_source},      {"object_vertices", score.object_vertices},
        {"object_faces", score.object_faces}, {"hand_vertices", score.hand_vertices},
        {"hand_faces", score.hand_faces},     {"inside_by", score.inside_by},
        {"hands_by", score.hands_by}};
  }
  for (std::size_t h = 0; h < score.hands.size(); ++h) {
    Json hand = {{"side", SideName(score.hands[h].side)},
                 {"values", Values(HandValues(score, h, options))}};
    if (per_frame) {
      hand["per_frame"] = PerFrame(score.hands[h], options);
      if (!score.hands[h].holds.empty()) hand["per_frame"]["holds"] = score.hands[h].holds;
    }
    json["hands"].push_back(std::move(hand));
  }
  if (score.own_body) {
    const OwnBodyScore& body = *score.own_body;
    Json& own = json["own_body"] = {{"self_penetration_worst_frame", body.arms.worst_frame}};
    if (per_frame) own["per_frame"]["self_penetration_mm"] = body.arms.depth_mm;
    if (body.object) {
      own["object_points"] = body.object_points;
      own["object_in_body_worst_frame"] = body.object->worst_frame;
      if (per_frame) own["per_frame"]["object_in_body_mm"] = body.object->depth_mm;
    }
  }
  if (score.reference) {
    json["reference"] = {{"source", score.reference->source},
                         {"frames_compared", score.reference->frames}};
    if (!score.reference->object.empty()) {
      json["reference"]["object_diameter_mm"] = score.reference->diameter_mm;
      json["reference"]["object_symmetry"] = SymmetryJson(score.reference->symmetry);
    }
    if (per_frame) json["reference"]["per_frame"] = PerFrame(*score.reference);
  }
  return json;
}

}  // namespace

void AddScores(std::span<const ClipScore> scores, const ScoreOptions& options, bool per_frame,
               Json& json) {
  const std::vector<MetricDefinition> metrics = MetricDefinitions(options);
  Json& protocol = json["protocol"];
  const ContactProtocol& contact = options.hand_object.contact;
  protocol = {{"contact_threshold_mm", contact.contact_threshold_mm},
              {"depth_threshold_mm", options.deep_mm},
              {"voxel_mm", options.hand_object.measure_voxels ? Json(contact.voxel_mm) : Json()},
              {"exact_volume", options.exact == ExactMode::kOff    ? "off"
                               : options.exact == ExactMode::kAuto ? "auto"
                                                                   : "on"},
              {"meshes",
               "full resolution of object and hand; the hand is closed at the wrist by a "
               "fan around its rim's mean point where a volume is needed"},
              {"hands_combined",
               "deepest of both, volumes added, in contact when a holding hand is; consistency, "
               "slip, drift and jitter are means weighted by the frames held, maxima the larger"}};
  for (const MetricDefinition& metric : metrics) {
    protocol["metrics"][metric.key] = {
        {"definition", metric.definition},
        {"unit", metric.unit == "%"    ? "share of 1"
                 : metric.unit.empty() ? "ratio"
                                       : metric.unit},
        {"worse", metric.worse == MetricDefinition::Worse::kHigher ? "higher" : "lower"},
        {"depends_on_hand_surface", metric.hand_surface}};
  }
  std::vector<MetricValues> values;
  json["clips"] = Json::array();
  for (const ClipScore& score : scores) {
    json["clips"].push_back(ClipJson(score, options, per_frame));
    values.push_back(ClipValues(score, options));
  }
  if (scores.size() < 2) return;
  for (const MetricDefinition& metric : metrics) {
    const auto summary = SummarizeMetric(metric, values);
    if (!summary) continue;
    json["summary"][metric.key] = {{"clips", summary->count},
                                   {"mean", summary->mean},
                                   {"median", summary->median},
                                   {"worst", summary->worst},
                                   {"worst_clip", scores[summary->worst_clip].source}};
  }
}

}  // namespace holdfast
