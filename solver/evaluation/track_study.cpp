// SPDX-License-Identifier: MIT
#include "solver/evaluation/track_study.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <numbers>

#include "generator/nn/random_stream.h"
#include "generator/wandr/reach_outcome.h"
#include "geometry/parallel.h"

namespace holdfast {
namespace {

constexpr std::array<TrackKind, 3> kTrackKinds = {TrackKind::kTurns, TrackKind::kJumps,
                                                  TrackKind::kPushes};
constexpr double kTrackRate = wandr::kFramesPerSecond;
constexpr int kEventEvery = 150, kRecoversIn = 120;  // frames

bool Recovers(const FollowReport& report, int event) {
  const auto first = report.distance_m.begin() + event + 1;
  const auto last = report.distance_m.begin() +
                    std::min(event + kRecoversIn, static_cast<int>(report.distance_m.size()));
  // Close, after the disturbance has had its half second.
  return std::any_of(std::min(first + 15, last), last,
                     [](double d) { return d < wandr::kReachedWithin; });
}

TrackSummary SummarizeTracks(TrackKind kind, std::span<const FollowReport> reports,
                             std::span<const DrawnTrack> tracks) {
  TrackSummary sum;
  sum.kind = kind;
  sum.tracks = static_cast<int>(reports.size());
  sum.lowest_pelvis_m = sum.lowest_foot_m = INFINITY;
  const double share = 1.0 / sum.tracks;
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const FollowReport& report = reports[i];
    sum.mean_m += share * report.mean_m;
    sum.worst_mean_m = std::max(sum.worst_mean_m, report.mean_m);
    sum.skating += share * report.skating;
    sum.airborne += share * report.airborne;
    sum.acceleration_m_s2 += share * report.acceleration_m_s2;
    sum.lowest_pelvis_m = std::min(sum.lowest_pelvis_m, report.lowest_pelvis_m);
    sum.lowest_foot_m = std::min(sum.lowest_foot_m, report.lowest_foot_m);
    sum.ms_per_frame +=
        share * 1000.0 * report.seconds / static_cast<double>(report.distance_m.size());
    sum.ms_slowest = std::max(sum.ms_slowest, 1000.0 * report.slowest_frame_s);
    for (const int event : tracks[i].events) {
      ++sum.events;
      sum.recovered += Recovers(report, event) ? 1 : 0;
    }
  }
  return sum;
}

}  // namespace

std::string_view TrackKindName(TrackKind kind) {
  constexpr std::array<std::string_view, 3> kNames = {"turns", "jumps", "pushes"};
  return kNames[static_cast<std::size_t>(kind)];
}

DrawnTrack DrawTrack(TrackKind kind, const ReachPerson& person, std::uint64_t seed, int frames) {
  nn::RandomStream random(seed, 7 + static_cast<std::uint64_t>(kind));
  const auto between = [&](double low, double high) {
    return low + (high - low) * random.Uniform();
  };
  const wandr::Pose<double> pose = wandr::PoseOf<double>(person.states.rightCols<1>());
  const Eigen::Vector3d forward = wandr::HeadingOf<double>(pose.rotation[0]).Forward();
  double azimuth = std::atan2(forward.y(), forward.x());
  Eigen::Vector3d goal = person.Pelvis() + 0.5 * forward;
  goal.z() = between(0.7, 1.5);
  const double speed = kind == TrackKind::kTurns ? 1.0 : 0.5;
  double turn = 0.0, height = goal.z();
  DrawnTrack track;
  for (int t = 0; t < frames; ++t) {
    if (t % 60 == 0) {
      turn = between(-0.5, 0.5) * std::numbers::pi;
      height = between(0.7, 1.5);
    }
    azimuth += turn / kTrackRate;
    goal += speed / kTrackRate * Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0.0);
    goal.z() += std::clamp(height - goal.z(), -0.4 / kTrackRate, 0.4 / kTrackRate);
    if (kind != TrackKind::kTurns && t > 0 && t % kEventEvery == 0) {
      const double way = between(0.0, 2.0 * std::numbers::pi);
      const Eigen::Vector3d by(std::cos(way), std::sin(way), 0.0);
      if (kind == TrackKind::kJumps) goal += by;
      if (kind == TrackKind::kPushes) track.pushes.push_back({t, 0.3 * by});
      if (t + kRecoversIn <= frames) track.events.push_back(t);
    }
    track.goals.push_back(goal);
  }
  return track;
}

std::vector<TrackSummary> RunTrackStudy(std::span<const ReachPerson> persons,
                                        const wandr::NetworkWeights& network,
                                        const TrackStudyOptions& options) {
  const int each = options.tracks, all = each * static_cast<int>(kTrackKinds.size());
  std::vector<DrawnTrack> tracks(static_cast<std::size_t>(all));
  std::vector<FollowReport> reports(tracks.size());
  std::mutex mutex;
  ParallelFor(all, options.threads, [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    const ReachPerson& person = persons[static_cast<std::size_t>(i % each) % persons.size()];
    FollowOptions follow = options.follow;
    follow.seed += static_cast<std::uint64_t>(i % each);
    tracks[at] = DrawTrack(kTrackKinds[static_cast<std::size_t>(i / each)], person, follow.seed,
                           options.frames);
    reports[at] = FollowTrack(person, network, tracks[at].goals, tracks[at].pushes, follow);
    const std::lock_guard lock(mutex);
    if (options.progress) options.progress();
  });
  std::vector<TrackSummary> summaries;
  for (std::size_t k = 0; k < kTrackKinds.size(); ++k) {
    const std::size_t first = k * static_cast<std::size_t>(each);
    const auto count = static_cast<std::size_t>(each);
    summaries.push_back(SummarizeTracks(kTrackKinds[k], std::span(reports).subspan(first, count),
                                        std::span(tracks).subspan(first, count)));
  }
  return summaries;
}

}  // namespace holdfast
