// SPDX-License-Identifier: MIT
#include "apps/make/grasp_file.h"

#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/read_json.h"

namespace holdfast::apps {
namespace {

using nlohmann::json;

json StoredGrasp(const Grasp& grasp) {
  const Eigen::Matrix<double, 3, 4> pose = grasp.wrist_from_object.matrix().topRows<3>();
  return {{"style", StyleName(grasp.style)},
          {"fingers", std::vector<double>(grasp.fingers.begin(), grasp.fingers.end())},
          {"wrist_from_object", std::vector<double>(pose.data(), pose.data() + pose.size())},
          {"below_bottom_mm", grasp.below_bottom_mm},
          {"score", grasp.score}};
}

Grasp GraspOf(const json& entry) {
  Grasp grasp;
  grasp.style = StyleByName(entry.at("style").get<std::string>()).value();
  const auto fingers = entry.at("fingers").get<std::vector<double>>();
  const auto pose = entry.at("wrist_from_object").get<std::vector<double>>();
  grasp.fingers = Eigen::Map<const FingerPose>(fingers.data());
  grasp.wrist_from_object.matrix().topRows<3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 4>>(pose.data());
  grasp.below_bottom_mm = entry.at("below_bottom_mm").get<double>();
  grasp.score = entry.at("score").get<double>();
  return grasp;
}

bool IsGrasp(const json& entry) {
  const auto numbers = [&](const char* name, std::size_t count) {
    return entry.contains(name) && entry[name].is_array() && entry[name].size() == count;
  };
  return entry.is_object() && numbers("fingers", kHandDofs) && numbers("wrist_from_object", 12) &&
         entry.contains("below_bottom_mm") && entry.contains("score") && entry.contains("style") &&
         entry["style"].is_string() && StyleByName(entry["style"].get<std::string>());
}

}  // namespace

void WriteGrasps(const std::vector<Grasp>& grasps, const json& key,
                 const std::filesystem::path& path) {
  json list = json::array();
  for (const Grasp& grasp : grasps) list.push_back(StoredGrasp(grasp));
  WriteAtomically(path, json{{"of", key}, {"grasps", list}}.dump() + "\n");
}

std::optional<std::vector<Grasp>> ReadGrasps(const json& key, const std::filesystem::path& path) {
  const json file = ReadJson(path);
  if (!file.is_object() || !file.contains("of") || file["of"] != key) return std::nullopt;
  if (!file.contains("grasps") || !file["grasps"].is_array()) return std::nullopt;
  return UseJson(path, [&]() -> std::optional<std::vector<Grasp>> {
    std::vector<Grasp> grasps;
    for (const json& entry : file["grasps"]) {
      if (!IsGrasp(entry)) return std::nullopt;
      grasps.push_back(GraspOf(entry));
    }
    return grasps;
  });
}

}  // namespace holdfast::apps
