// SPDX-License-Identifier: MIT
#include "solver/markers/solve_markers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/import/world_frame.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kFewestMarkers = 3;
constexpr int kStaticFrames = 3;
constexpr int kMaxSteps = 30;            // of a solve of all frames
constexpr double kCoarseRate_hz = 12.5;  // of the subset of frames that is solved first

bool EverSeen(const MarkerRecording& recording, int marker) {
  for (int t = 0; t < recording.NumFrames(); ++t) {
    if (recording.Seen(marker, t)) return true;
  }
  return false;
}

bool OfObject(const std::string& name, const std::optional<ObjectMarkers>& object) {
  return object && std::ranges::any_of(object->names, [&](const std::string& other) {
           return EqualIgnoringCase(name, other);
         });
}

UnusedMarker Unused(const std::string& name, const MarkerTable& table) {
  const auto [site, letters] = table.Nearest(name);
  const auto length = static_cast<int>(std::max(name.size(), site->name.size()));
  return {name, letters <= std::max(1, length / 3) ? site->name : ""};
}

// "Nearest known names: RELB for RELBOW, LELB for LELBOW. ": the first few, however similar.
std::string NearestKnown(const MarkerReport& report, const MarkerTable& table) {
  constexpr std::size_t kNamed = 3;
  std::vector<std::string> pairs;
  for (const UnusedMarker& marker : report.unused) {
    if (pairs.size() == kNamed) break;
    pairs.push_back(fmt::format("{} for {}", table.Nearest(marker.name).first->name, marker.name));
  }
  if (pairs.empty()) return "";
  return fmt::format("Nearest known names: {}. ", fmt::join(pairs, ", "));
}

// Collects the sites of known names of the recordings, and reports unknown names.
std::vector<MarkerSite> SitesOf(const MarkerRecording& recording,
                                const MarkerRecording* static_trial,
                                const SolveMarkersOptions& options, const std::string& where,
                                MarkerReport& report) {
  const MarkerTable& table = options.table;
  std::vector<MarkerSite> sites;
  std::set<std::string> subjects, known;
  for (const MarkerRecording* const from : {&recording, static_trial}) {
    if (from == nullptr) continue;
    for (int m = 0; m < from->NumMarkers(); ++m) {
      const std::string& name = from->names[m];
      if (OfObject(name, options.object)) continue;
      const MarkerSite* const site = table.Find(name);
      const bool trial = from == &recording;
      if (site == nullptr) {
        if (trial) report.unused.push_back(Unused(name, table));
        continue;
      }
      if (trial) subjects.insert(from->subjects[m]);
      if (!EverSeen(*from, m)) {
        if (trial && !(static_trial && static_trial->Find(name))) report.never_seen.push_back(name);
        continue;
      }
      if (known.insert(site->name).second) sites.push_back(*site);
    }
  }
  if (subjects.size() > 1) {
    throw Error(where, fmt::format("has markers of {} people", subjects.size()),
                "Export each person to a file of its own");
  }
  if (subjects.empty()) {
    throw Error(where,
                fmt::format("no marker's name is known; the first is '{}'",
                            recording.names.empty() ? "" : recording.names[0]),
                NearestKnown(report, table) + "Give a table of names with --markers");
  }
  if (sites.empty()) {
    throw Error(where, "no known marker is seen in any frame", "Export it with its trajectories");
  }
  return sites;
}

// Column of the recording for each of the person's markers; -1 for none.
std::vector<int> ColumnsOf(const MarkedPerson& person, const MarkerRecording& recording) {
  std::vector<int> columns;
  for (const MarkerSite& site : person.sites) {
    columns.push_back(recording.Find(site.name).value_or(-1));
  }
  return columns;
}

SeenMarkers SeenIn(const MarkerRecording& recording, const std::vector<int>& columns, int frame,
                   const MarkerWorld& world) {
  SeenMarkers seen;
  seen.place.resize(3, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (columns[k] < 0 || !recording.Seen(columns[k], frame)) continue;
    seen.place.col(seen.Count()) =
        world.world_from_recording * (world.scale * recording.At(columns[k], frame));
    seen.marker.push_back(static_cast<int>(k));
    seen.sigma_m.push_back(1.0);
  }
  seen.place.conservativeResize(3, seen.Count());
  return seen;
}

// Returns `count` frames spread over those with most markers.
std::vector<int> SpreadFrames(const std::vector<SeenMarkers>& frames, int count) {
  int most = 0;
  for (const SeenMarkers& seen : frames) most = std::max(most, seen.Count());
  std::vector<int> good;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    if (10 * frames[t].Count() >= 7 * most) good.push_back(static_cast<int>(t));
  }
  std::vector<int> spread;
  const int n = static_cast<int>(good.size());
  for (int k = 0; k < std::min(count, n); ++k) {
    spread.push_back(
        good[n <= count ? k : std::lround(static_cast<double>(k) * (n - 1) / (count - 1))]);
  }
  return spread;
}

std::vector<SeenMarkers> At(const std::vector<SeenMarkers>& frames,
                            const std::vector<int>& chosen) {
  std::vector<SeenMarkers> some;
  for (const int t : chosen) some.push_back(frames[t]);
  return some;
}

// Interpolates between the solved frames.
MarkerTrack Interpolated(const std::vector<Eigen::VectorXd>& roots,
                         const std::vector<Eigen::VectorXd>& poses, const std::vector<int>& at,
                         int frames) {
  MarkerTrack track;
  track.roots.resize(6, frames);
  track.poses.resize(poses[0].size(), frames);
  std::size_t next = 0;
  for (int t = 0; t < frames; ++t) {
    while (next + 1 < at.size() && at[next] < t) ++next;
    const std::size_t before = at[next] > t && next > 0 ? next - 1 : next;
    const double s =
        before == next ? 0.0 : static_cast<double>(t - at[before]) / (at[next] - at[before]);
    track.roots.col(t) = (1.0 - s) * roots[before] + s * roots[next];
    track.poses.col(t) = (1.0 - s) * poses[before] + s * poses[next];
  }
  return track;
}

// Initializes the solve of all frames. From the few calibration frames it would spend most steps on
// recovering the motion in between; frames at kCoarseRate_hz suffice for that.
MarkerTrack CoarseTrack(const MarkedPerson& person, const MarkerCalibration& calibration,
                        const std::vector<SeenMarkers>& frames, double frame_rate,
                        const std::vector<int>& spread,
                        const std::function<bool(int, int)>& progress) {
  const auto count = static_cast<int>(frames.size());
  const int step = std::max(1, static_cast<int>(frame_rate / kCoarseRate_hz));
  MarkerTrack start = Interpolated(calibration.roots, calibration.poses, spread, count);
  std::vector<int> at;
  for (int t = 0; t < count; t += step) at.push_back(t);
  const std::vector<SeenMarkers> some_frames = At(frames, at);
  MarkerTrack some;
  some.roots = start.roots(Eigen::all, at);
  some.poses = start.poses(Eigen::all, at);
  some = FollowMarkers(person, calibration, some_frames, std::move(some));
  if (step < 2) return some;
  some = TrackMarkers(person, calibration, some_frames, frame_rate / step, std::move(some),
                      kMaxSteps, progress);
  std::vector<Eigen::VectorXd> roots, poses;
  for (Eigen::Index k = 0; k < some.poses.cols(); ++k) {
    roots.emplace_back(some.roots.col(k));
    poses.emplace_back(some.poses.col(k));
  }
  start = Interpolated(roots, poses, at, count);
  start.iterations = some.iterations;
  return start;
}

Clip ClipOf(const MarkedPerson& person, const MarkerCalibration& calibration,
            const MarkerTrack& track, double rate, MarkerReport& report) {
  Clip clip;
  clip.frame_rate = rate;
  clip.betas = calibration.betas;
  clip.body_model = person.model->Name();
  clip.trans = track.roots.topRows<3>();
  for (Eigen::Index t = 0; t < track.poses.cols(); ++t) {
    clip.pose.push_back(
        person.body.free.Pose(track.roots.col(t).data(), track.poses.col(t).data()));
  }
  const BodySurface surface(person.model, clip.betas);
  BodyState state;
  Forward(surface, clip.pose[0], clip.trans.col(0), state);
  const double lowest = state.vertices.row(2).minCoeff();
  if (!person.pelvis_marked || std::abs(lowest) > 0.15) report.lift_m = -lowest;
  clip.trans.row(2).array() += report.lift_m;
  return clip;
}

void Measure(const std::vector<SeenMarkers>& frames, const Eigen::MatrixXd& carried,
             MarkerReport& report) {
  std::vector<double> sum(report.markers.size(), 0.0);
  std::vector<int> used(report.markers.size(), 0);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    for (int k = 0; k < frames[t].Count(); ++k) {
      const std::size_t m = static_cast<std::size_t>(frames[t].marker[k]);
      sum[m] +=
          (frames[t].place.col(k) - carried.block<3, 1>(3 * frames[t].marker[k], t)).squaredNorm();
      ++used[m];
    }
  }
  double total = 0.0;
  int count = 0;
  for (std::size_t m = 0; m < sum.size(); ++m) {
    total += sum[m];
    count += used[m];
    if (used[m] == 0) continue;
    report.markers[m].rms_mm = 1e3 * std::sqrt(sum[m] / used[m]);
    if (report.markers[m].rms_mm > report.worst_rms_mm) {
      report.worst_rms_mm = report.markers[m].rms_mm;
      report.worst_marker = report.markers[m].site.name;
    }
  }
  report.rms_mm = count > 0 ? 1e3 * std::sqrt(total / count) : 0.0;
}

void DescribeMarkers(const MarkedPerson& person, const MarkerRecording& recording,
                     const std::vector<int>& columns, const MarkerRecording* static_trial,
                     const MarkerCalibration& calibration, MarkerReport& report) {
  const std::vector<SkinPlace> skin = PlacesOnSkin(person, calibration);
  for (std::size_t k = 0; k < person.sites.size(); ++k) {
    SolvedMarker marker;
    marker.site = person.sites[k];
    marker.place = calibration.places.col(k);
    marker.skin = skin[k];
    marker.in_static = static_trial != nullptr && static_trial->Find(marker.site.name).has_value();
    int gap = 0;
    for (int t = 0; columns[k] >= 0 && t < recording.NumFrames(); ++t) {
      const bool seen = recording.Seen(columns[k], t);
      marker.seen += seen ? 1 : 0;
      gap = seen ? 0 : gap + 1;
      marker.longest_gap = std::max(marker.longest_gap, gap);
    }
    report.markers.push_back(std::move(marker));
  }
  report.unmarked = person.Unmarked();
}

// Frames of a recording as the person's markers, in the world.
struct Prepared {
  MarkerWorld world;
  std::vector<int> columns;
  std::vector<SeenMarkers> frames;
};

Prepared Prepare(const MarkedPerson& person, const MarkerRecording& recording,
                 const SolveMarkersOptions& options, const std::string& where) {
  Prepared prepared;
  prepared.columns = ColumnsOf(person, recording);
  prepared.world = FindWorld(person, recording, prepared.columns, options.up, where);
  prepared.world.scale = ScaleBySize(recording);
  for (int t = 0; t < recording.NumFrames(); ++t) {
    prepared.frames.push_back(SeenIn(recording, prepared.columns, t, prepared.world));
  }
  return prepared;
}

// (3 M x T); NaN for markers missing in a frame.
Eigen::MatrixXd Positions(const std::vector<SeenMarkers>& frames, std::size_t markers) {
  Eigen::MatrixXd positions = Eigen::MatrixXd::Constant(static_cast<Eigen::Index>(3 * markers),
                                                        static_cast<Eigen::Index>(frames.size()),
                                                        std::numeric_limits<double>::quiet_NaN());
  for (std::size_t t = 0; t < frames.size(); ++t) {
    for (int k = 0; k < frames[t].Count(); ++k) {
      positions.block<3, 1>(3 * frames[t].marker[k], t) = frames[t].place.col(k);
    }
  }
  return positions;
}

// Converts world positions (3 M x T) before lifting to the axes and units of the recording.
Eigen::MatrixXd InRecording(Eigen::MatrixXd positions, const MarkerWorld& world) {
  const Eigen::Matrix3d back = world.world_from_recording.transpose() / world.scale;
  Eigen::Map<Eigen::Matrix3Xd> points(positions.data(), 3, positions.size() / 3);
  points = (back * points).eval();
  return positions;
}

// Adds the object to a solved clip, from its markers in the clip's world.
void AddObject(const MarkerRecording& recording, const ObjectMarkers& markers,
               const std::string& where, SolvedRecording& solved) {
  MarkerReport& report = solved.report;
  TrackedObject tracked =
      TrackObject(InWorld(recording, report.world, report.lift_m), markers, where);
  solved.clip.object = std::move(tracked.track);
  report.object = std::move(tracked.report);
}

}  // namespace

OptionTable OptionsOf(SolveMarkersOptions& options) {
  OptionTable table;
  table.Choice("up", options.up, UpAxisChoices(),
               "Up axis of the recording; auto: detected from trunk and shoulders");
  table.Choice("posture", options.posture,
               {{"seated", RestPosture::kSeated}, {"standing", RestPosture::kStanding}},
               "Leg posture if the legs have no markers");
  return table;
}

SolvedRecording SolveMarkers(const MarkerRecording& recording, const MarkerRecording* static_trial,
                             std::shared_ptr<const BodyModel> model,
                             const SolveMarkersOptions& options, const std::string& where,
                             const StagedProgress& progress) {
  const auto tell = [&](const char* stage, int done, int total) {
    if (progress && !progress(stage, done, total)) throw WorkStopped();
  };
  SolvedRecording solved;
  MarkerReport& report = solved.report;
  MarkedPerson person = MakeMarkedPerson(
      model, SitesOf(recording, static_trial, options, where, report), options.posture);
  Prepared trial = Prepare(person, recording, options, where);
  const std::vector<int> spread = SpreadFrames(trial.frames, options.calibration_frames);
  if (spread.empty() || trial.frames[spread[0]].Count() < kFewestMarkers) {
    std::vector<std::string> seen;
    for (const MarkerSite& site : person.sites) {
      if (recording.Find(site.name)) seen.push_back(site.name);
    }
    throw Error(where,
                fmt::format("no frame shows at least {} known markers; {} known: {}",
                            kFewestMarkers, seen.size(), fmt::join(seen, " ")),
                NearestKnown(report, options.table) +
                    "Give the whole recording, or a table of its other names with --markers");
  }
  std::vector<SeenMarkers> still;
  double still_facing = 0.0;
  if (static_trial != nullptr) {
    SolveMarkersOptions same = options;  // same axes as the trial, whatever the arms do
    same.up = trial.world.up;
    const Prepared prepared = Prepare(person, *static_trial, same, where + " (static trial)");
    still = At(prepared.frames, SpreadFrames(prepared.frames, kStaticFrames));
    still_facing = prepared.world.facing_rad;
  }
  tell("calibrate", 0, 1);
  const MarkerCalibration calibration = CalibrateMarkers(person, still, At(trial.frames, spread),
                                                         still_facing, trial.world.facing_rad);
  tell("calibrate", 1, 1);

  const std::function<bool(int, int)> track_progress = [&](int done, int total) {
    return !progress || progress("track", done, total);
  };
  MarkerTrack track =
      CoarseTrack(person, calibration, trial.frames, recording.rate_hz, spread, track_progress);
  Eigen::MatrixXd carried;
  for (int pass = 0; pass < 3; ++pass) {
    track = TrackMarkers(person, calibration, trial.frames, recording.rate_hz, std::move(track),
                         kMaxSteps, track_progress);
    tell("track", 1, 1);
    carried = CarriedMarkers(person, calibration, track);
    const MarkerFaults faults = RepairMarkers(carried, trial.frames);
    report.faults.swaps.insert(report.faults.swaps.end(), faults.swaps.begin(), faults.swaps.end());
    report.faults.outliers.insert(report.faults.outliers.end(), faults.outliers.begin(),
                                  faults.outliers.end());
    if (faults.swaps.empty() && faults.outliers.empty()) break;
  }
  report.world = trial.world;
  report.iterations = calibration.iterations + track.iterations;
  report.converged = track.converged;
  DescribeMarkers(person, recording, trial.columns, static_trial, calibration, report);
  Measure(trial.frames, carried, report);
  for (const auto& outlier : report.faults.outliers) ++report.markers[outlier.marker].outliers;
  for (const auto& swap : report.faults.swaps) {
    ++report.markers[swap.a].swapped;
    ++report.markers[swap.b].swapped;
  }
  solved.clip = ClipOf(person, calibration, track, recording.rate_hz, report);
  if (options.object) AddObject(recording, *options.object, where, solved);
  if (std::ranges::count(report.unmarked, kHead) > 0) {
    report.head = PoseUnmarkedHead(model, solved.clip.betas, {}, solved.clip);
  }
  solved.carried = InRecording(std::move(carried), trial.world);
  solved.used = InRecording(Positions(trial.frames, person.sites.size()), trial.world);
  return solved;
}

}  // namespace holdfast
