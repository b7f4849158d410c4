// SPDX-License-Identifier: MIT
#include "geometry/score/contact_track.h"

#include <algorithm>
#include <map>

#include "geometry/error.h"

namespace holdfast {
namespace {

// Mean and maximum of the values added; none if no value was added.
struct Spread {
  double sum = 0.0;
  double max = 0.0;
  int count = 0;

  void Add(double value) {
    sum += value;
    max = count == 0 ? value : std::max(max, value);
    ++count;
  }
  std::optional<double> Mean() const {
    return count > 0 ? std::optional(sum / count) : std::nullopt;
  }
  std::optional<double> Max() const { return count > 0 ? std::optional(max) : std::nullopt; }
};

struct Place {
  Eigen::Vector3d at, on;
};

double Travel_mm(const Place& from, const Place& to) {
  return 1e3 * std::min((to.at - from.at).norm(), (to.on - from.on).norm());
}

struct Contact {
  Place began, last;
  int last_frame = -1;
};

}  // namespace

Touch FindTouch(const Eigen::Matrix3Xd& hand_vertices_in_object,
                std::span<const SignedDistance::Result> queries, double threshold_m) {
  Touch touch;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (queries[i].distance < threshold_m) touch.vertices.push_back(static_cast<int>(i));
  }
  const auto n = static_cast<Eigen::Index>(touch.vertices.size());
  touch.at.resize(3, n);
  touch.on.resize(3, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const int vertex = touch.vertices[k];
    touch.at.col(k) = hand_vertices_in_object.col(vertex);
    touch.on.col(k) = queries[vertex].closest;
  }
  return touch;
}

ContactTrack TrackContact(std::span<const Touch> frames, std::span<const std::uint8_t> counts) {
  if (!counts.empty() && counts.size() != frames.size()) {
    throw Error("contact", "has another number of frames than the flags that count them",
                "Give one flag per frame, or none");
  }
  ContactTrack track;
  track.steps.resize(frames.size());
  track.drift_mm.resize(frames.size());
  std::map<int, Contact> contacts;  // by vertex
  std::map<int, double> drift;      // by vertex, maximum over its contacts
  Spread iou, slip_means, slip_all;
  for (int t = 0; t < static_cast<int>(frames.size()); ++t) {
    if (!counts.empty() && !counts[t]) continue;
    const Touch& touch = frames[t];
    const bool has_step = t > 0 && (counts.empty() || counts[t - 1]);
    int kept = 0;
    Spread slip, drift_now;
    for (std::size_t k = 0; k < touch.vertices.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      const Place place{touch.at.col(column), touch.on.col(column)};
      Contact& contact = contacts[touch.vertices[k]];
      if (has_step && contact.last_frame == t - 1) {
        ++kept;
        const double travel = Travel_mm(contact.last, place);
        slip.Add(travel);
        slip_all.Add(travel);
        const double from_begin = Travel_mm(contact.began, place);
        drift_now.Add(from_begin);
        double& most = drift.try_emplace(touch.vertices[k], 0.0).first->second;
        most = std::max(most, from_begin);
      } else {
        contact.began = place;
        drift_now.Add(0.0);
      }
      contact.last = place;
      contact.last_frame = t;
    }
    track.drift_mm[t] = drift_now.Mean();
    if (!has_step) continue;
    ContactStep& step = track.steps[t];
    const std::size_t either = touch.vertices.size() + frames[t - 1].vertices.size() - kept;
    if (either > 0) {
      step.iou = static_cast<double>(kept) / static_cast<double>(either);
      iou.Add(*step.iou);
    }
    step.slip_mm = slip.Mean();
    if (step.slip_mm) slip_means.Add(*step.slip_mm);
  }
  track.mean_iou = iou.Mean();
  track.mean_slip = slip_means.Mean();
  track.max_slip = slip_all.Max();
  Spread drifts;
  for (const auto& [vertex, most] : drift) drifts.Add(most);
  track.mean_drift = drifts.Mean();
  track.max_drift = drifts.Max();
  return track;
}

}  // namespace holdfast
