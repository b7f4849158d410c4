// SPDX-License-Identifier: MIT
#include "solver/markers/object_markers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include <ceres/loss_function.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/conventions/hand_evidence.h"
#include "geometry/error.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/rotation.h"
#include "geometry/suggestion.h"
#include "solver/terms/hand/paper_terms.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast {
namespace {

constexpr double kAgree_m = 0.010;         // tolerance for consistent distances within a cluster
constexpr double kRobustObject_m = 0.005;  // markers beyond this count little
constexpr double kSame_m = 1e-9;
constexpr double kLine_m = 0.005;       // markers closer to a line do not determine a rotation
constexpr double kOtherTable_m = 0.03;  // given positions farther off belong to another object
constexpr double kJump_rad = 0.5;       // rotation between frames that suggests label errors
constexpr int kSlopeFrames = 5;         // before and after a gap

std::vector<std::string> SplitAtCommas(const std::string& line) {
  std::vector<std::string> words(1);
  for (const char c : line) {
    if (c == ',') {
      words.emplace_back();
    } else if (c != '\r' && c != ' ') {
      words.back() += c;
    }
  }
  return words;
}

// Used markers of one frame.
struct SeenCluster {
  std::vector<int> marker;
  Eigen::Matrix3Xd points;  // (3 x marker.size())
};

class ObjectTracker {
 public:
  ObjectTracker(const MarkerRecording& recording, const std::vector<int>& columns,
                const ObjectMarkers& markers, const std::string& where)
      : recording_(recording), columns_(columns), markers_(markers), where_(where) {}

  TrackedObject Run() {
    FindPlaces();
    poses_.assign(static_cast<std::size_t>(recording_.NumFrames()), std::nullopt);
    used_.assign(poses_.size(), {});
    for (int t = 0; t < recording_.NumFrames(); ++t) SolveFrame(t, true);
    std::vector<Eigen::Isometry3d> poses = Filled();
    Measure(poses);
    const Eigen::Isometry3d places_from_object = PlacesFromObject(poses);
    ObjectTrack& track = tracked_.track;
    track.name = "object";
    track.trans.resize(3, recording_.NumFrames());
    track.orient.setZero(3, recording_.NumFrames());
    for (int t = 0; t < recording_.NumFrames(); ++t) {
      track.SetPose(t, poses[t] * places_from_object);
    }
    return std::move(tracked_);
  }

 private:
  int Count() const { return static_cast<int>(columns_.size()); }
  bool Seen(int k, int t) const { return recording_.Seen(columns_[k], t); }
  Eigen::Vector3d At(int k, int t) const { return recording_.At(columns_[k], t); }
  int NumSeen(int t) const {
    int seen = 0;
    for (int k = 0; k < Count(); ++k) seen += Seen(k, t) ? 1 : 0;
    return seen;
  }
  [[noreturn]] void TooFew(const std::string& problem) const {
    throw Error(where_, fmt::format("{} ({})", problem, fmt::join(markers_.names, ", ")),
                "Give at least three markers that are not on a line");
  }

  // Medians of the distances between markers; NaN if two are never seen together.
  Eigen::MatrixXd UsualDistances() const {
    Eigen::MatrixXd usual = Eigen::MatrixXd::Zero(Count(), Count());
    for (int i = 0; i < Count(); ++i) {
      for (int j = 0; j < i; ++j) {
        std::vector<double> all;
        for (int t = 0; t < recording_.NumFrames(); ++t) {
          if (Seen(i, t) && Seen(j, t)) all.push_back((At(i, t) - At(j, t)).norm());
        }
        usual(i, j) = usual(j, i) =
            all.empty() ? std::numeric_limits<double>::quiet_NaN() : Median(std::move(all));
      }
    }
    return usual;
  }

  // The frame with most markers and the most typical distances.
  int UsualFrame() const {
    const Eigen::MatrixXd usual = UsualDistances();
    int best = -1, most = 0;
    double least = 0.0;
    for (int t = 0; t < recording_.NumFrames(); ++t) {
      const int seen = NumSeen(t);
      if (seen < std::max(most, 3)) continue;
      double off = 0.0;
      for (int i = 0; i < Count(); ++i) {
        for (int j = 0; j < i; ++j) {
          if (!Seen(i, t) || !Seen(j, t)) continue;
          off = std::max(off, std::abs((At(i, t) - At(j, t)).norm() - usual(i, j)));
        }
      }
      // The first of equally good frames, independent of rounding.
      if (seen > most || off < least - kSame_m) {
        best = t;
        most = seen;
        least = off;
      }
    }
    if (best < 0) TooFew("fewer than three of the object's markers are seen at a time");
    return best;
  }

  void FindPlaces() {
    const int first = UsualFrame();
    places_.setConstant(3, Count(), std::numeric_limits<double>::quiet_NaN());
    for (int k = 0; k < Count(); ++k) {
      if (Seen(k, first)) places_.col(k) = At(k, first);
    }
    // Center at the markers: gaps interpolate the origin's path, which would curve under rotation
    // for a distant origin.
    places_.colwise() -= Middle();
    RequireSpread();
    constexpr int kFitRounds = 3;
    for (int round = 0; round < kFitRounds; ++round) {
      poses_.assign(static_cast<std::size_t>(recording_.NumFrames()), std::nullopt);
      used_.assign(poses_.size(), {});
      for (int t = 0; t < recording_.NumFrames(); ++t) SolveFrame(t, false);
      for (int k = 0; k < Count(); ++k) {
        std::array<std::vector<double>, 3> seen;
        for (int t = 0; t < recording_.NumFrames(); ++t) {
          if (!poses_[t] || !Seen(k, t)) continue;
          const Eigen::Vector3d place = poses_[t]->inverse() * At(k, t);
          for (int c = 0; c < 3; ++c) seen[c].push_back(place[c]);
        }
        for (int c = 0; c < 3 && !seen[0].empty(); ++c) places_(c, k) = Median(seen[c]);
      }
    }
  }

  void RequireSpread() const {
    Eigen::Matrix3Xd known(3, Count());
    Eigen::Index n = 0;
    for (int k = 0; k < Count(); ++k) {
      if (places_.col(k).allFinite()) known.col(n++) = places_.col(k);
    }
    known.conservativeResize(3, n);
    known.colwise() -= known.rowwise().mean().eval();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> extent(known * known.transpose(),
                                                                Eigen::EigenvaluesOnly);
    if (extent.eigenvalues()(1) < kLine_m * kLine_m) {
      TooFew("the object's markers are on a line");
    }
  }

  double Disagreement(const SeenCluster& seen, int i, int j) const {
    return std::abs((seen.points.col(i) - seen.points.col(j)).norm() -
                    (places_.col(seen.marker[i]) - places_.col(seen.marker[j])).norm());
  }

  // Removes markers with inconsistent distances, the worst first.
  SeenCluster Agreeing(SeenCluster seen) const {
    while (seen.marker.size() > 1) {
      const int n = static_cast<int>(seen.marker.size());
      double worst = 0.0;
      Eigen::VectorXd sum = Eigen::VectorXd::Zero(n);
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < i; ++j) {
          const double off = Disagreement(seen, i, j);
          worst = std::max(worst, off);
          sum(i) += off;
          sum(j) += off;
        }
      }
      if (worst < kAgree_m) break;
      Eigen::Index out = 0;
      sum.maxCoeff(&out);
      Eigen::Matrix3Xd kept(3, n - 1);
      kept << seen.points.leftCols(out), seen.points.rightCols(n - 1 - out);
      seen.points = kept;
      seen.marker.erase(seen.marker.begin() + out);
      if (n == 2) return {};  // of two inconsistent markers neither is known to be right
    }
    return seen;
  }

  Eigen::Isometry3d PoseOf(const SeenCluster& seen) const {
    const Eigen::Index n = seen.points.cols();
    Eigen::Matrix3Xd places(3, n);
    for (Eigen::Index k = 0; k < n; ++k) places.col(k) = places_.col(seen.marker[k]);
    return Moved(Kabsch(places, seen.points), seen, 1.0, new ceres::CauchyLoss(kRobustObject_m),
                 0.0);
  }

  // Returns the pose near `start` that aligns the markers. Poses are about the center.
  Eigen::Isometry3d Moved(const Eigen::Isometry3d& start, const SeenCluster& seen, double weight,
                          ceres::LossFunction* loss, double start_weight) const {
    const Eigen::Vector3d middle = Middle();
    const ObjectPose before(start * Eigen::Translation3d(middle));
    ObjectPose pose = before;
    double* const q = pose.orientation.coeffs().data();
    ceres::Problem problem;
    problem.AddParameterBlock(q, 4, new RotationManifold);
    problem.AddResidualBlock(new ObjectData(before, start_weight), nullptr, q,
                             pose.translation.data());
    for (Eigen::Index k = 0; k < seen.points.cols(); ++k) {
      const ObjectPose place(Eigen::Quaterniond::Identity(), places_.col(seen.marker[k]) - middle);
      const ObjectPose at(Eigen::Quaterniond::Identity(), seen.points.col(k));
      problem.AddResidualBlock(new ObjectData(at, weight, place, 0.0), loss, q,
                               pose.translation.data());
    }
    SolveQuietly(SparseOptions(20, 1e-10), problem);
    return pose.Transform() * Eigen::Translation3d(-middle);
  }

  // Solves with labels as given, or with two exchanged if then more markers agree or, for equal
  // numbers, if the object would otherwise jump.
  void SolveFrame(int t, bool report) {
    SeenCluster seen;
    seen.points.resize(3, Count());
    for (int k = 0; k < Count(); ++k) {
      if (!Seen(k, t) || !places_.col(k).allFinite()) continue;
      seen.points.col(seen.marker.size()) = At(k, t);
      seen.marker.push_back(k);
    }
    const int n = static_cast<int>(seen.marker.size());
    seen.points.conservativeResize(3, n);
    SeenCluster best = Agreeing(seen);
    const auto leap = [&](const SeenCluster& cluster) {
      if (cluster.marker.size() < 3 || t == 0 || !poses_[t - 1]) return 0.0;
      return AngleBetween(PoseOf(cluster).linear(), poses_[t - 1]->linear());
    };
    double turn = leap(best);
    std::pair<int, int> swapped(-1, -1);
    if (static_cast<int>(best.marker.size()) < n || turn > kJump_rad) {
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < i; ++j) {
          SeenCluster other = seen;
          other.points.col(i).swap(other.points.col(j));
          other = Agreeing(std::move(other));
          const double other_turn = leap(other);
          const bool more = other.marker.size() > best.marker.size();
          if (other.marker.size() < 3 || other.marker.size() < best.marker.size() ||
              (!more && (turn < kJump_rad || other_turn > 0.5 * turn))) {
            continue;
          }
          best = other;
          turn = other_turn;
          swapped = {seen.marker[j], seen.marker[i]};
        }
      }
    }
    if (best.marker.size() >= 3) poses_[t] = PoseOf(best);
    if (report) Report(t, seen, best, swapped);
    used_[t] = std::move(best);
  }

  void Report(int t, const SeenCluster& seen, const SeenCluster& used,
              std::pair<int, int> swapped) {
    MarkerFaults& faults = tracked_.report.faults;
    if (swapped.first >= 0) faults.swaps.push_back({t, swapped.first, swapped.second});
    for (std::size_t k = 0; k < seen.marker.size(); ++k) {
      const int marker = seen.marker[k];
      if (std::ranges::find(used.marker, marker) != used.marker.end()) continue;
      const Eigen::Vector3d x = seen.points.col(k);
      const double off =
          poses_[t] ? (*poses_[t] * Eigen::Vector3d(places_.col(marker)) - x).norm() : 0.0;
      faults.outliers.push_back({t, marker, off});
    }
  }

  // Motion per frame at frame `at`, from solved frames on one side of it.
  std::pair<Eigen::Vector3d, Eigen::Vector3d> Slope(int at, int step) const {
    int k = 0;
    while (k < kSlopeFrames && at + step * (k + 1) >= 0 &&
           at + step * (k + 1) < recording_.NumFrames() && poses_[at + step * (k + 1)]) {
      ++k;
    }
    if (k == 0) return {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    const Eigen::Isometry3d &here = *poses_[at], &there = *poses_[at + step * k];
    const double frames = step * k;
    return {(there.translation() - here.translation()) / frames,
            LogSO3(here.linear().transpose() * there.linear()) / frames};
  }

  // Cubic Hermite interpolation between two solved frames, with limited overshoot.
  Eigen::Isometry3d Between(int a, int b, int t) const {
    const Eigen::Isometry3d &from = *poses_[a], &to = *poses_[b];
    const double length = b - a, s = (t - a) / length, s2 = s * s, s3 = s2 * s;
    const auto curve = [&](const Eigen::Vector3d& way, Eigen::Vector3d begin, Eigen::Vector3d end) {
      for (Eigen::Vector3d* const slope : {&begin, &end}) {
        *slope *= length;
        const double most = 3.0 * way.norm();
        if (slope->norm() > most) *slope *= most / slope->norm();
      }
      return Eigen::Vector3d((3.0 * s2 - 2.0 * s3) * way + (s3 - 2.0 * s2 + s) * begin +
                             (s3 - s2) * end);
    };
    const auto [shift_a, turn_a] = Slope(a, -1);
    const auto [shift_b, turn_b] = Slope(b, 1);
    const Eigen::Vector3d turn = LogSO3(from.linear().transpose() * to.linear());
    Eigen::Isometry3d pose;
    pose.setIdentity();
    pose.translation() =
        from.translation() + curve(to.translation() - from.translation(), shift_a, shift_b);
    pose.linear() = from.linear() *
                    ExpSO3(curve(turn, turn_a, InverseLeftJacobianSO3(turn).transpose() * turn_b));
    return pose;
  }

  Eigen::Vector3d Middle() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (int k = 0; k < Count(); ++k) {
      if (!places_.col(k).allFinite()) continue;
      sum += places_.col(k);
      ++count;
    }
    return sum / count;
  }

  std::vector<Eigen::Isometry3d> Filled() {
    const int frames = recording_.NumFrames();
    std::vector<Eigen::Isometry3d> poses(static_cast<std::size_t>(frames));
    std::vector<int> solved;
    for (int t = 0; t < frames; ++t) {
      if (poses_[t]) solved.push_back(t);
    }
    for (int t = 0; t < frames; ++t) {
      if (poses_[t]) {
        poses[t] = *poses_[t];
        continue;
      }
      const auto after = std::ranges::upper_bound(solved, t);
      poses[t] = after == solved.begin() ? *poses_[solved.front()]
                 : after == solved.end() ? *poses_[solved.back()]
                                         : Between(*(after - 1), *after, t);
      // One or two markers to 2 mm, the interpolation to 5 cm and 0.5 rad.
      if (!used_[t].marker.empty()) poses[t] = Moved(poses[t], used_[t], 25e4, nullptr, 400.0);
      auto& gaps = tracked_.report.gaps;
      if (gaps.empty() || gaps.back().second != t) gaps.emplace_back(t, t);
      gaps.back().second = t + 1;
    }
    return poses;
  }

  void Measure(const std::vector<Eigen::Isometry3d>& poses) {
    ObjectMarkerReport& report = tracked_.report;
    report.markers.resize(static_cast<std::size_t>(Count()));
    std::vector<double> sum(report.markers.size(), 0.0);
    std::vector<int> used(report.markers.size(), 0);
    for (int k = 0; k < Count(); ++k) {
      ObjectMarkerReport::Marker& marker = report.markers[k];
      marker.name = markers_.names[k];
      int gap = 0;
      for (int t = 0; t < recording_.NumFrames(); ++t) {
        marker.seen += Seen(k, t) ? 1 : 0;
        gap = Seen(k, t) ? 0 : gap + 1;
        marker.longest_gap = std::max(marker.longest_gap, gap);
      }
    }
    for (std::size_t t = 0; t < used_.size(); ++t) {
      for (std::size_t k = 0; k < used_[t].marker.size(); ++k) {
        const int marker = used_[t].marker[k];
        sum[marker] += (poses[t] * Eigen::Vector3d(places_.col(marker)) - used_[t].points.col(k))
                           .squaredNorm();
        ++used[marker];
      }
    }
    double total = 0.0;
    int count = 0;
    for (std::size_t k = 0; k < sum.size(); ++k) {
      if (used[k] > 0) report.markers[k].rms_mm = 1e3 * std::sqrt(sum[k] / used[k]);
      total += sum[k];
      count += used[k];
    }
    report.rms_mm = count > 0 ? 1e3 * std::sqrt(total / count) : 0.0;
    for (const auto& outlier : report.faults.outliers) ++report.markers[outlier.marker].outliers;
    for (const auto& swap : report.faults.swaps) {
      ++report.markers[swap.a].swapped;
      ++report.markers[swap.b].swapped;
    }
  }

  // From the object's frame to that of the estimated places; sets the report's places.
  Eigen::Isometry3d PlacesFromObject(const std::vector<Eigen::Isometry3d>& poses) {
    Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
    ObjectMarkerReport& report = tracked_.report;
    if (markers_.places.cols() == 0) {
      const auto first = std::ranges::find_if(poses_, [](const auto& pose) { return bool(pose); });
      frame.linear() = poses[first - poses_.begin()].linear().transpose();
      frame.translation() = Middle();
    } else {
      Eigen::Matrix3Xd told(3, Count()), found(3, Count());
      Eigen::Index n = 0;
      for (int k = 0; k < Count(); ++k) {
        if (!places_.col(k).allFinite()) continue;
        told.col(n) = markers_.places.col(k);
        found.col(n++) = places_.col(k);
      }
      told.conservativeResize(3, n);
      found.conservativeResize(3, n);
      frame = Kabsch(told, found);
      const double off = std::sqrt((frame * told - found).squaredNorm() / static_cast<double>(n));
      if (off > kOtherTable_m) {
        throw Error(
            where_,
            fmt::format(
                "the object's markers are {:.0f} mm (root mean square) from their given positions",
                1e3 * off),
            "Give positions in meters, in the mesh's frame, under the names of their markers");
      }
      report.table_rms_mm = 1e3 * off;
    }
    for (std::size_t k = 0; k < report.markers.size(); ++k) {
      report.markers[k].place = frame.inverse() * Eigen::Vector3d(places_.col(k));
    }
    return frame;
  }

  const MarkerRecording& recording_;
  std::vector<int> columns_;
  const ObjectMarkers& markers_;
  const std::string& where_;
  Eigen::Matrix3Xd places_;  // in their own frame; NaN if never seen
  std::vector<std::optional<Eigen::Isometry3d>> poses_;
  std::vector<SeenCluster> used_;
  TrackedObject tracked_;
};

// Recording column of each of the object's markers.
std::vector<int> ColumnsOfObject(const MarkerRecording& recording, const ObjectMarkers& markers,
                                 const std::string& where) {
  std::vector<int> columns;
  for (const std::string& name : markers.names) {
    const std::optional<int> column = recording.Find(name);
    if (!column) {
      throw Error(where, fmt::format("has no marker '{}' of the object", name),
                  Suggestion(name, recording.names) + "Give names of markers in the recording");
    }
    if (std::ranges::find(columns, *column) != columns.end()) {
      throw Error(where, fmt::format("the object's marker '{}' is listed twice", name),
                  "List each marker once");
    }
    columns.push_back(*column);
  }
  return columns;
}

ObjectMarkers ReadObjectMarkers(const std::filesystem::path& path) {
  std::ifstream in(path);
  if (!in) throw Error(path.string(), "cannot be read", "Check the path");
  const char* const remedy =
      "Write name,x,y,z, then one row per marker: meters, in the mesh's frame";
  ObjectMarkers markers;
  std::vector<double> places;
  int number = 0;
  bool head = false;
  for (std::string line; std::getline(in, line);) {
    const std::string where = fmt::format("{}:{}", path.string(), ++number);
    if (line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    const std::vector<std::string> words = SplitAtCommas(line);
    if (words.size() == 1 && words[0].empty()) continue;
    if (!head) {
      head = words.size() == 4 && EqualIgnoringCase(words[0], "name") &&
             EqualIgnoringCase(words[1], "x") && EqualIgnoringCase(words[2], "y") &&
             EqualIgnoringCase(words[3], "z");
      if (!head) throw Error(where, "its first line does not name the columns", remedy);
      continue;
    }
    if (words.size() != 4 || words[0].empty()) {
      throw Error(where, fmt::format("{} fields instead of a name and three numbers", words.size()),
                  remedy);
    }
    markers.names.push_back(words[0]);
    for (int c = 1; c < 4; ++c) {
      double value = 0.0;
      if (!ParseNumber(words[c], value) || !(std::abs(value) < 10.0)) {
        throw Error(where, fmt::format("'{}' is not a coordinate in meters", words[c]), remedy);
      }
      places.push_back(value);
    }
  }
  if (markers.names.empty()) throw Error(path.string(), "lists no markers", remedy);
  markers.places = Eigen::Map<const Eigen::Matrix3Xd>(
      places.data(), 3, static_cast<Eigen::Index>(markers.names.size()));
  return markers;
}

}  // namespace

Eigen::Isometry3d Kabsch(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& goals) {
  const Eigen::Vector3d from = points.rowwise().mean(), to = goals.rowwise().mean();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = NearestRotation((goals.colwise() - to) * (points.colwise() - from).transpose());
  pose.translation() = to - pose.linear() * from;
  return pose;
}

ObjectMarkers ObjectMarkersOf(const std::string& table_or_names, const MarkerRecording& recording,
                              const std::string& where) {
  ObjectMarkers markers;
  if (table_or_names.ends_with(".csv")) {
    markers = ReadObjectMarkers(table_or_names);
  } else {
    for (const std::string& name : SplitAtCommas(table_or_names)) {
      if (!name.ends_with('*')) {
        markers.names.push_back(name);
        continue;
      }
      const std::size_t before = markers.names.size(), length = name.size() - 1;
      for (const std::string& known : recording.names) {
        if (known.size() >= length &&
            EqualIgnoringCase(known.substr(0, length), name.substr(0, length))) {
          markers.names.push_back(known);
        }
      }
      if (markers.names.size() == before) {
        throw Error(where, fmt::format("no marker's name matches '{}'", name),
                    fmt::format("Its markers are {}", fmt::join(recording.names, " ")));
      }
    }
  }
  ColumnsOfObject(recording, markers, where);
  return markers;
}

TrackedObject TrackObject(const MarkerRecording& recording, const ObjectMarkers& markers,
                          const std::string& where) {
  const std::vector<int> columns = ColumnsOfObject(recording, markers, where);
  return ObjectTracker(recording, columns, markers, where).Run();
}

}  // namespace holdfast
