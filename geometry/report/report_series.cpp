// SPDX-License-Identifier: MIT
#include "geometry/report/report_facts.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

namespace holdfast {
namespace {

struct HandContact {
  std::vector<double> ratio;     ///< share of the hand's vertices in contact
  std::vector<double> depth_mm;  ///< of the deepest vertex inside
  bool meets = false;            ///< the object, in any frame
};

HandContact ContactOf(const std::vector<Eigen::VectorXd>& distance, Eigen::Index begin,
                      Eigen::Index count, double threshold_m) {
  HandContact contact;
  for (const Eigen::VectorXd& frame : distance) {
    const auto hand = frame.segment(begin, count);
    const auto touching = (hand.array().abs() < threshold_m).count();
    const double depth = std::max(0.0, -hand.minCoeff());
    contact.ratio.push_back(static_cast<double>(touching) / static_cast<double>(count));
    contact.depth_mm.push_back(1e3 * depth);
    contact.meets = contact.meets || touching > 0 || depth > 0.0;
  }
  return contact;
}

// Length of the derivative by central differences, one-sided at the ends.
template <typename PointAt>
std::vector<double> SpeedOf(int frames, double frame_rate, const PointAt& point_at) {
  std::vector<double> speed;
  for (int t = 0; t < frames; ++t) {
    const int a = std::max(0, t - 1);
    const int b = std::min(frames - 1, t + 1);
    const double length = (point_at(b) - point_at(a)).norm();
    speed.push_back(b > a ? length * frame_rate / (b - a) : 0.0);
  }
  return speed;
}

// Numbers (booleans as 0 and 1) of one value per frame; anything else in a file is no curve.
bool IsCurve(const nlohmann::json& values, int frames) {
  return values.is_array() && static_cast<int>(values.size()) == frames &&
         std::ranges::all_of(values, [](const nlohmann::json& value) {
           return value.is_number() || value.is_boolean() || value.is_null();
         });
}

// Frames that were given were not solved: no iterations would be a claim.
void LeaveOutGiven(const nlohmann::json& per_frame, nlohmann::json& series) {
  const auto stop = per_frame.find("stop");
  if (stop == per_frame.end() || !stop->is_array() || !series.contains("iterations")) return;
  nlohmann::json& iterations = series["iterations"];
  for (std::size_t t = 0; t < std::min(stop->size(), iterations.size()); ++t) {
    if ((*stop)[t] == "given") iterations[t] = nullptr;
  }
}

}  // namespace

nlohmann::json SeriesOf(const ReportInput& input, const std::vector<Eigen::Matrix3Xd>& joints,
                        const std::vector<Eigen::VectorXd>& distance, int right_hand_vertices,
                        double contact_threshold_mm) {
  const Clip& clip = input.clip;
  const int frames = clip.NumFrames();
  nlohmann::json series = nlohmann::json::object();
  if (input.metrics.is_object() && input.metrics.contains("per_frame") &&
      input.metrics["per_frame"].is_object()) {
    for (const auto& [name, values] : input.metrics["per_frame"].items()) {
      if (IsCurve(values, frames)) series[name] = values;
    }
    LeaveOutGiven(input.metrics["per_frame"], series);
  }
  if (!distance.empty() && distance[0].size() > 0 && !series.contains("contact_ratio")) {
    const double threshold = 1e-3 * contact_threshold_mm;
    const Eigen::Index left = distance[0].size() - right_hand_vertices;
    const HandContact hands[] = {ContactOf(distance, 0, right_hand_vertices, threshold),
                                 ContactOf(distance, right_hand_vertices, left, threshold)};
    // One hand: the names that a fit's metrics use. Two: each its own.
    const bool both = hands[0].meets && hands[1].meets;
    for (int k = 0; k < 2; ++k) {
      if (!hands[k].meets && (k == 1 || hands[1].meets)) continue;
      const std::string side = !both ? "" : k == 0 ? "right_" : "left_";
      series[both ? side + "hand_contact_ratio" : "contact_ratio"] = hands[k].ratio;
      series[side + "hand_in_object_mm"] = hands[k].depth_mm;  // one way
    }
  }
  const auto add_motion = [&](const std::string& name, const auto& point_at) {
    series[name + "_speed_m_s"] = SpeedOf(frames, clip.frame_rate, point_at);
    for (int t = 0; t < frames; ++t) series[name + "_height_m"].push_back(point_at(t).z());
  };
  const auto joint = [&](int j) {
    return [&joints, j](int t) -> Eigen::Vector3d { return joints[t].col(j); };
  };
  const std::optional<Side> lone = input.body->LoneHand();
  if (lone != Side::kLeft) add_motion("right_wrist", joint(WristJoint(Side::kRight)));
  if (lone != Side::kRight) add_motion("left_wrist", joint(WristJoint(Side::kLeft)));
  if (!lone) add_motion("hips", joint(0));
  if (clip.object) {
    add_motion("object", [&](int t) -> Eigen::Vector3d { return clip.object->trans.col(t); });
  }
  return series;
}

}  // namespace holdfast
