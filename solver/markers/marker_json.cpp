// SPDX-License-Identifier: MIT
#include "solver/markers/marker_json.h"

#include <string>
#include <string_view>
#include <vector>

#include "geometry/body/skeleton.h"
#include "geometry/error.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

std::vector<std::string_view> JointNames(const std::vector<int>& joints) {
  std::vector<std::string_view> names;
  for (const int joint : joints) names.push_back(kJointNames[static_cast<std::size_t>(joint)]);
  return names;
}

nlohmann::json MarkerJson(const SolvedMarker& marker) {
  return {{"name", marker.site.name},
          {"tie", MarkerTieName(marker.site.tie)},
          {"joint", kJointNames[static_cast<std::size_t>(marker.site.joint)]},
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

}  // namespace

nlohmann::json HeadReportJson(const HeadReport& head) {
  return {{"hand_deep_frames_before", head.deep_before},
          {"hand_deep_frames", head.deep},
          {"hand_deepest_before_mm", 1e3 * head.worst_before_m},
          {"hand_deepest_mm", 1e3 * head.worst_m},
          {"frames_moved", head.moved},
          {"turned_deg", head.turned_rad / kDegree}};
}

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
      {"up", MarkerUpName(report.world.up)},
      {"scale", report.world.scale},
      {"rotation",
       {{R(0, 0), R(0, 1), R(0, 2)}, {R(1, 0), R(1, 1), R(1, 2)}, {R(2, 0), R(2, 1), R(2, 2)}}},
      {"lift_m", report.lift_m},
      {"facing_deg", report.world.facing_rad / kDegree}};
  json["head"] = HeadReportJson(report.head);
  return json;
}

Eigen::MatrixXd MeasuredMarkers(const std::filesystem::path& solved) {
  const std::filesystem::path path = solved / "metrics.json";
  const nlohmann::json metrics = ReadJson(path);
  if (!metrics.is_object() || metrics.value("schema", "") != "holdfast/solve/1") {
    throw Error(solved.string(), "is no folder that 'holdfast solve' made",
                "Give one with its metrics.json");
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

}  // namespace holdfast
