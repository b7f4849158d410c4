// SPDX-License-Identifier: MIT
#include "solver/markers/marker_json.h"

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

std::vector<std::string_view> JointNames(const std::vector<int>& joints) {
  std::vector<std::string_view> names;
  for (const int joint : joints) names.push_back(kJointNames[joint]);
  return names;
}

nlohmann::json MarkerJson(const SolvedMarker& marker) {
  return {{"name", marker.site.name},
          {"tie", MarkerTieName(marker.site.tie)},
          {"joint", kJointNames[marker.site.joint]},
          {"place_in_joint_m", {marker.place.x(), marker.place.y(), marker.place.z()}},
          {"skin_vertex", marker.skin.vertex},
          {"skin_height_mm", 1e3 * marker.skin.height_m},
          {"in_static", marker.in_static},
          {"frames_seen", marker.seen},
          {"longest_gap_frames", marker.longest_gap},
          {"outlier_frames", marker.outliers},
          {"swapped_frames", marker.swapped},
          {"rms_mm", marker.seen > 0 ? nlohmann::json(marker.rms_mm) : nlohmann::json()}};
}

template <typename Markers>
void AddFaultsJson(const MarkerFaults& faults, const Markers& name, nlohmann::json& json) {
  json["swaps"] = nlohmann::json::array();
  for (const auto& swap : faults.swaps) {
    json["swaps"].push_back({{"frame", swap.frame}, {"markers", {name(swap.a), name(swap.b)}}});
  }
  json["outliers"] = nlohmann::json::array();
  for (const auto& outlier : faults.outliers) {
    json["outliers"].push_back({{"frame", outlier.frame},
                                {"marker", name(outlier.marker)},
                                {"off_mm", 1e3 * outlier.off_m}});
  }
}

nlohmann::json ObjectJson(const ObjectMarkerReport& report) {
  nlohmann::json json;
  json["rms_mm"] = report.rms_mm;
  json["places_from_table_rms_mm"] =
      report.table_rms_mm ? nlohmann::json(*report.table_rms_mm) : nlohmann::json();
  json["markers"] = nlohmann::json::array();
  for (const auto& marker : report.markers) {
    json["markers"].push_back(
        {{"name", marker.name},
         {"place_in_object_m", {marker.place.x(), marker.place.y(), marker.place.z()}},
         {"frames_seen", marker.seen},
         {"longest_gap_frames", marker.longest_gap},
         {"outlier_frames", marker.outliers},
         {"swapped_frames", marker.swapped},
         {"rms_mm", marker.seen > 0 ? nlohmann::json(marker.rms_mm) : nlohmann::json()}});
  }
  json["filled_frames"] = report.gaps;
  AddFaultsJson(
      report.faults, [&](int k) { return report.markers[k].name; }, json);
  return json;
}

nlohmann::json HeadReportJson(const HeadReport& head) {
  return {{"hand_deep_frames_before", head.deep_before},
          {"hand_deep_frames", head.deep},
          {"hand_deepest_before_mm", 1e3 * head.worst_before_m},
          {"hand_deepest_mm", 1e3 * head.worst_m},
          {"frames_moved", head.moved},
          {"turned_deg", head.turned_rad / kDegree}};
}

}  // namespace

nlohmann::json MarkerReportJson(const MarkerReport& report) {
  nlohmann::json json;
  json["rms_mm"] = report.rms_mm;
  json["worst_marker"] = {{"name", report.worst_marker}, {"rms_mm", report.worst_rms_mm}};
  json["markers"] = nlohmann::json::array();
  for (const SolvedMarker& marker : report.markers) {
    json["markers"].push_back(MarkerJson(marker));
  }
  json["unused_names"] = nlohmann::json::array();
  json["nearest_known_names"] = nlohmann::json::object();
  for (const UnusedMarker& marker : report.unused) {
    json["unused_names"].push_back(marker.name);
    if (!marker.nearest.empty()) json["nearest_known_names"][marker.name] = marker.nearest;
  }
  json["never_seen"] = report.never_seen;
  json["unmarked_joints"] = JointNames(report.unmarked);
  AddFaultsJson(
      report.faults, [&](int k) { return report.markers[k].site.name; }, json);
  if (report.object) json["object"] = ObjectJson(*report.object);
  const Eigen::Matrix3d R = report.world.world_from_recording;
  json["world"] = {
      {"up", UpAxisName(report.world.up)},
      {"scale", report.world.scale},
      {"rotation",
       {{R(0, 0), R(0, 1), R(0, 2)}, {R(1, 0), R(1, 1), R(1, 2)}, {R(2, 0), R(2, 1), R(2, 2)}}},
      {"lift_m", report.lift_m},
      {"facing_deg", report.world.facing_rad / kDegree}};
  json["head"] = HeadReportJson(report.head);
  return json;
}

nlohmann::json KeypointReportJson(const KeypointReport& report) {
  return {{"hand", SideName(report.side)},
          {"order", report.order},
          {"meters_per_unit", report.meters_per_unit},
          {"size_ratio", report.size_ratio},
          {"rms_mm", report.rms_mm},
          {"next_best_rms_mm", report.other_rms_mm},
          {"frames_without_hand", report.gaps}};
}

Eigen::MatrixXd MeasuredMarkers(const std::filesystem::path& solved) {
  const std::filesystem::path path = solved / "metrics.json";
  const nlohmann::json metrics = ReadJson(path);
  if (!metrics.is_object() || metrics.value("schema", "") != "holdfast/solve/1") {
    throw Error(solved.string(), "is not a folder written by 'holdfast solve'",
                "Give a folder that contains its metrics.json");
  }
  return UseJson(path, [&] {
    const nlohmann::json& world = metrics.at("world");
    Eigen::Matrix3d R;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) R(i, j) = world.at("rotation").at(i).at(j).get<double>();
    }
    R *= world.at("scale").get<double>();
    const Eigen::Vector3d lift(0.0, 0.0, world.at("lift_m").get<double>());
    MarkerRecording recording =
        ReadMarkers(metrics.at("options").at("recording").get<std::string>());
    Eigen::Map<Eigen::Matrix3Xd> points(recording.positions.data(), 3,
                                        recording.positions.size() / 3);
    points = ((R * points).colwise() + lift).eval();
    return recording.positions;
  });
}

namespace {

// Fills gaps of `used` with `carried` plus the interpolated deviation at the adjacent frames.
Eigen::Matrix3Xd Filled(const Eigen::Matrix3Xd& used, const Eigen::Matrix3Xd& carried) {
  Eigen::Matrix3Xd filled = used;
  std::optional<Eigen::Index> before;
  for (Eigen::Index t = 0; t < used.cols();) {
    if (!used.col(t).hasNaN()) {
      before = t++;
      continue;
    }
    Eigen::Index after = t;
    while (after < used.cols() && used.col(after).hasNaN()) ++after;
    const auto off = [&](Eigen::Index at) -> Eigen::Vector3d {
      return used.col(at) - carried.col(at);
    };
    const bool ends = after == used.cols();
    const Eigen::Vector3d first = before ? off(*before)
                                  : ends ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                         : off(after);
    const Eigen::Vector3d last = ends ? first : off(after);
    const Eigen::Index begin = before.value_or(-1);
    for (; t < after; ++t) {
      const double s = static_cast<double>(t - begin) / static_cast<double>(after - begin);
      filled.col(t) = carried.col(t) + (1.0 - s) * first + s * last;
    }
  }
  return filled;
}

Eigen::Matrix3Xd PathOf(const Eigen::MatrixXd& positions, int marker) {
  return positions.middleRows(3 * marker, 3);
}

void RepairBody(const SolvedRecording& solved, MarkerRecording& recording) {
  for (std::size_t k = 0; k < solved.report.markers.size(); ++k) {
    const std::optional<int> column = recording.Find(solved.report.markers[k].site.name);
    if (!column) continue;  // only in the static trial
    const auto marker = static_cast<int>(k);
    recording.positions.middleRows(3 * *column, 3) =
        Filled(PathOf(solved.used, marker), PathOf(solved.carried, marker));
  }
}

void RepairObject(const SolvedRecording& solved, MarkerRecording& recording) {
  if (!solved.report.object || !solved.clip.object) return;
  const ObjectMarkerReport& report = *solved.report.object;
  const ObjectTrack& track = *solved.clip.object;
  const MarkerWorld& world = solved.report.world;
  const Eigen::Vector3d lift(0.0, 0.0, solved.report.lift_m);
  std::vector<int> columns;
  for (const auto& marker : report.markers) columns.push_back(*recording.Find(marker.name));
  for (const auto& swap : report.faults.swaps) {
    recording.positions.block<3, 1>(3 * columns[swap.a], swap.frame)
        .swap(recording.positions.block<3, 1>(3 * columns[swap.b], swap.frame));
  }
  for (const auto& outlier : report.faults.outliers) {
    recording.positions.block<3, 1>(3 * columns[outlier.marker], outlier.frame)
        .setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  for (std::size_t k = 0; k < columns.size(); ++k) {
    Eigen::Matrix3Xd carried(3, recording.NumFrames());
    for (Eigen::Index t = 0; t < carried.cols(); ++t) {
      const Eigen::Vector3d at = track.Pose(t) * report.markers[k].place;
      carried.col(t) = world.world_from_recording.transpose() * (at - lift) / world.scale;
    }
    recording.positions.middleRows(3 * columns[k], 3) =
        Filled(PathOf(recording.positions, columns[k]), carried);
  }
}

}  // namespace

MarkerRecording RepairedMarkers(const MarkerRecording& recording, const SolvedRecording& solved) {
  MarkerRecording repaired = recording;
  RepairBody(solved, repaired);
  RepairObject(solved, repaired);
  repaired.positions *= solved.report.world.scale;
  return repaired;
}

}  // namespace holdfast
