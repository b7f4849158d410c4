// SPDX-License-Identifier: MIT
#include "solver/reach/goal_track.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "generator/wandr/motion_states.h"
#include "generator/wandr/reach_outcome.h"
#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/options.h"
#include "geometry/parallel.h"

namespace holdfast {
namespace {

constexpr std::size_t kMaxTrackBytes = 64u << 20;
constexpr double kMaxTrackSeconds = 3600.0;

std::vector<std::string_view> Cells(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const std::size_t comma = line.find(',');
    std::string_view cell = line.substr(0, comma);
    const std::size_t first = cell.find_first_not_of(" \t\r\"");
    const std::size_t last = cell.find_last_not_of(" \t\r\"");
    cells.push_back(first == std::string_view::npos ? std::string_view()
                                                    : cell.substr(first, last - first + 1));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

// Columns of x, y, z and time; -1 for no time.
using TrackColumns = std::array<int, 4>;

std::optional<TrackColumns> NamedColumns(const std::vector<std::string_view>& cells,
                                         const std::string& where) {
  double ignored = 0.0;
  if (ParseNumber(cells[0], ignored)) return std::nullopt;
  constexpr std::array<std::string_view, 4> kNames = {"x", "y", "z", "time"};
  TrackColumns columns = {-1, -1, -1, -1};
  for (std::size_t k = 0; k < kNames.size(); ++k) {
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (EqualIgnoringCase(cells[c], kNames[k])) columns[k] = static_cast<int>(c);
    }
    if (k < 3 && columns[k] < 0) {
      throw Error(where, fmt::format("has no column {}", kNames[k]),
                  "Name the columns x,y,z, or time,x,y,z (meters and seconds), or none of them");
    }
  }
  return columns;
}

struct TimedGoal {
  double time_s;
  Eigen::Vector3d goal;
};

TimedGoal GoalOf(const std::vector<std::string_view>& cells, const TrackColumns& columns,
                 const std::string& where) {
  TimedGoal timed{0.0, Eigen::Vector3d::Zero()};
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (columns[k] < 0) continue;
    const auto c = static_cast<std::size_t>(columns[k]);
    double value = 0.0;
    if (c >= cells.size() || !ParseNumber(cells[c], value) || !std::isfinite(value)) {
      throw Error(where,
                  fmt::format("column {} is not a number: '{}'", c + 1,
                              c < cells.size() ? std::string(cells[c]) : std::string()),
                  "Give a line x,y,z or time,x,y,z for each goal, in meters and seconds");
    }
    (k < 3 ? timed.goal[static_cast<Eigen::Index>(k)] : timed.time_s) = value;
  }
  if (timed.goal.z() < 0.0) {
    throw Error(where, fmt::format("the goal is {:.2f} m below the ground z = 0", -timed.goal.z()),
                "Give a height of 0 or more: x and y are on the ground, z is up, meters");
  }
  if (timed.goal.cwiseAbs().maxCoeff() > kMaxMeters) {
    throw Error(where, "the goal is too far away", kMetersRemedy);
  }
  return timed;
}

// The latest goal for each thirtieth of a second.
std::vector<Eigen::Vector3d> AtFrames(const std::vector<TimedGoal>& timed, double last_for_s,
                                      const std::string& name) {
  const double seconds = timed.back().time_s - timed.front().time_s + last_for_s;
  if (!(seconds <= kMaxTrackSeconds)) {
    throw Error(name, fmt::format("lasts {:.0f} s; the maximum is an hour", seconds),
                "Give times in seconds, or the rate of the goals with --rate");
  }
  const int count =
      std::max(1, static_cast<int>(std::floor(seconds * wandr::kFramesPerSecond + 1e-6)));
  std::vector<Eigen::Vector3d> goals;
  std::size_t at = 0;
  for (int t = 0; t < count; ++t) {
    const double now = timed.front().time_s + t / wandr::kFramesPerSecond + 1e-6;
    while (at + 1 < timed.size() && timed[at + 1].time_s <= now) ++at;
    goals.push_back(timed[at].goal);
  }
  return goals;
}

void MeasureFollow(const ReachPerson& person, Side side, FollowReport& report) {
  const Eigen::MatrixXf& joints = report.track.joints;
  const auto frames = static_cast<int>(joints.cols());
  const wandr::LowestPoint lowest(BodySurface(person.body, person.betas));
  report.skating = wandr::SkatingOfLowestVertex(lowest, report.track.states);
  const wandr::ReachOutcome outcome = wandr::MeasureReach(joints, Eigen::Vector3d::Zero(), side);
  report.airborne = outcome.airborne_share;
  report.acceleration_m_s2 = outcome.mean_acceleration_m_s2;
  report.lowest_pelvis_m = joints.row(2).minCoeff();
  report.lowest_foot_m = INFINITY;
  for (const int joint : {kLeftAnkle, kRightAnkle, kLeftFoot, kRightFoot}) {
    report.lowest_foot_m =
        std::min(report.lowest_foot_m, static_cast<double>(joints.row(3 * joint + 2).minCoeff()));
  }
  const int first = std::min(static_cast<int>(wandr::kFramesPerSecond), frames - 2);
  for (int t = first; t < frames - 1; ++t) {
    const double distance = report.distance_m[t];
    report.mean_m += distance / (frames - 1 - first);
    report.worst_m = std::max(report.worst_m, distance);
  }
}

}  // namespace

std::vector<Eigen::Vector3d> ReadGoalTrack(const std::filesystem::path& path,
                                           std::optional<double> rate_hz) {
  const std::string text = ByteSource(path).Text(kMaxTrackBytes), name = path.string();
  std::optional<TrackColumns> columns;
  std::vector<TimedGoal> timed;
  int number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view line = std::string_view(text).substr(at, end - at);
    at = end + 1;
    const std::string where = fmt::format("{}:{}", name, ++number);
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    const std::vector<std::string_view> cells = Cells(line);
    if (!columns) {
      columns = NamedColumns(cells, where);
      if (columns) continue;
      columns = cells.size() >= 4 ? TrackColumns{1, 2, 3, 0} : TrackColumns{0, 1, 2, -1};
    }
    TimedGoal goal = GoalOf(cells, *columns, where);
    const bool has_time = (*columns)[3] >= 0 && !rate_hz;
    if (!has_time) {
      goal.time_s = static_cast<double>(timed.size()) / rate_hz.value_or(wandr::kFramesPerSecond);
    } else if (!timed.empty() && goal.time_s <= timed.back().time_s) {
      throw Error(
          where,
          fmt::format("its time {:g} s is not after {:g} s", goal.time_s, timed.back().time_s),
          "Sort the goals by time");
    }
    timed.push_back(goal);
  }
  if (timed.empty()) {
    throw Error(name, "has no goals", "Give a line x,y,z or time,x,y,z for each goal");
  }
  const double step = timed.size() < 2 ? 1.0 / wandr::kFramesPerSecond
                                       : (timed.back().time_s - timed.front().time_s) /
                                             static_cast<double>(timed.size() - 1);
  return AtFrames(timed, step, name);
}

TrackPush ParsePush(const std::string& text) {
  const std::vector<std::string_view> cells = Cells(text);
  std::array<double, 4> numbers = {};
  bool good = cells.size() == 4;
  for (std::size_t k = 0; good && k < 4; ++k) {
    good = ParseNumber(cells[k], numbers[k]) && std::isfinite(numbers[k]);
  }
  if (!good || numbers[0] < 0.0 || numbers[0] > 1e6 || numbers[0] != std::floor(numbers[0])) {
    throw Error("--push " + text, "is not a frame and three numbers",
                "Give FRAME,DX,DY,DZ: a frame from 0 and meters, as in 90,0.2,0,0");
  }
  return {static_cast<int>(numbers[0]), {numbers[1], numbers[2], numbers[3]}};
}

FollowReport FollowTrack(const ReachPerson& person, const wandr::NetworkWeights& network,
                         std::span<const Eigen::Vector3d> goals, std::span<const TrackPush> pushes,
                         const FollowOptions& options,
                         const std::function<bool(int, int)>& progress) {
  const auto count = static_cast<int>(goals.size());
  if (count == 0) throw Error("track", "has no goals", "Give a goal for each frame");
  for (const TrackPush& push : pushes) {
    if (push.frame >= 0 && push.frame < count) continue;
    throw Error("push",
                fmt::format("frame {} does not exist: the track has {} goals", push.frame, count),
                "Give a frame of the track, counted from 0");
  }
  GoalFollower follower(person, network, options);
  wandr::StateMatrix<double> states(wandr::kStateSize, count + 1);
  states.col(0) = person.states.rightCols<1>();
  FollowReport report;
  int done = 0;
  for (int t = 0; t < count; ++t) {
    if (progress && !progress(t, count)) {
      report.stopped = true;
      break;
    }
    for (const TrackPush& push : pushes) {
      if (push.frame == t) follower.Push(push.by);
    }
    const double began = CoreSeconds();
    states.col(t + 1) = wandr::StateOf(follower.Step(goals[t]));
    const double took = CoreSeconds() - began;
    report.seconds += took;
    report.slowest_frame_s = std::max(report.slowest_frame_s, took);
    ++done;
  }
  if (done == 0) return report;
  report.track.states = states.leftCols(done + 1).cast<float>();
  report.track.joints = wandr::JointsOfStates(report.track.states, person.bones.Cast<float>());
  for (int t = 0; t < done; ++t) {
    const Eigen::Vector3d wrist =
        report.track.joints.block<3, 1>(3 * WristJoint(options.side), t + 1).cast<double>();
    report.distance_m.push_back((wrist - goals[t]).norm());
  }
  MeasureFollow(person, options.side, report);
  return report;
}

}  // namespace holdfast
