// SPDX-License-Identifier: MIT
#include "solver/actions/action_shelf.h"

#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "geometry/io/container/json_file.h"
#include "geometry/object/load_object.h"
#include "geometry/seed.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t kGraspSeed = 0x6AA5;

json StoredGrasp(const Grasp& grasp) {
  const Eigen::Matrix<double, 3, 4> pose = grasp.wrist_from_object.matrix().topRows<3>();
  return {{"style", StyleName(grasp.style)},
          {"fingers", std::vector<double>(grasp.fingers.begin(), grasp.fingers.end())},
          {"wrist_from_object", std::vector<double>(pose.data(), pose.data() + pose.size())},
          {"below_bottom_mm", grasp.below_bottom_mm},
          {"score", grasp.score}};
}

// Returns nothing if the entry is not a grasp.
std::optional<Grasp> GraspOf(const json& entry) {
  const auto numbers = [&](const char* name, std::size_t count) {
    return entry.contains(name) && entry[name].is_array() && entry[name].size() == count;
  };
  const bool is_grasp = entry.is_object() && numbers("fingers", kHandDofs) &&
                        numbers("wrist_from_object", 12) && entry.contains("below_bottom_mm") &&
                        entry.contains("score") && entry.contains("style") &&
                        entry["style"].is_string();
  const auto style = is_grasp ? StyleByName(entry["style"].get<std::string>()) : std::nullopt;
  if (!style) return std::nullopt;
  const auto fingers = entry["fingers"].get<std::vector<double>>();
  const auto pose = entry["wrist_from_object"].get<std::vector<double>>();
  Grasp grasp;
  grasp.style = *style;
  grasp.fingers = Eigen::Map<const FingerPose>(fingers.data());
  grasp.wrist_from_object.matrix().topRows<3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 4>>(pose.data());
  grasp.below_bottom_mm = entry["below_bottom_mm"].get<double>();
  grasp.score = entry["score"].get<double>();
  return grasp;
}

// Returns the grasps of a file with this key, in groups of `together`; nothing if the file is
// missing or has another key.
std::optional<std::vector<Grasp>> ReadGrasps(const fs::path& path, const json& key,
                                             std::size_t together) {
  const json file = ReadJson(path);
  if (!file.is_object() || !file.contains("of") || file["of"] != key) return std::nullopt;
  if (!file.contains("grasps") || !file["grasps"].is_array()) return std::nullopt;
  return UseJson(path, [&]() -> std::optional<std::vector<Grasp>> {
    std::vector<Grasp> grasps;
    for (const json& entry : file["grasps"]) {
      const std::optional<Grasp> grasp = GraspOf(entry);
      if (!grasp) return std::nullopt;
      grasps.push_back(*grasp);
    }
    if (grasps.size() % together != 0) return std::nullopt;
    return grasps;
  });
}

// Grasps cached in a file, exact to the last bit; `key` identifies them. If they are missing,
// `make` creates them and they are written.
template <typename Make>
std::vector<Grasp> KeptGrasps(const fs::path& path, const json& key, std::size_t together,
                              const Make& make) {
  if (std::optional<std::vector<Grasp>> kept = ReadGrasps(path, key, together)) return *kept;
  std::vector<Grasp> grasps = make();
  json list = json::array();
  for (const Grasp& grasp : grasps) list.push_back(StoredGrasp(grasp));
  WriteAtomically(path, JsonText(json{{"of", key}, {"grasps", list}}) + "\n");
  return grasps;
}

json GraspKey(const ActionActor& actor, const std::string& object,
              const ActionSetOptions& options) {
  return {{"version", options.version},
          {"body", actor.Model().Name()},
          {"betas", std::vector<double>(actor.Betas().begin(), actor.Betas().end())},
          {"object", object},
          {"seed", MixSeed(options.seed, kGraspSeed)},
          {"most", kGraspChoice}};
}

}  // namespace

const ActionActor& ActionShelf::Actor(int subject) {
  return actors_.Get(subject, [&] {
    return std::make_unique<const ActionActor>(
        body_, SubjectBetas(subject, body_->NumShape(), options_.seed));
  });
}

const ActionProp& ActionShelf::Prop(const std::string& object, bool mirrored) {
  return props_.Get(std::pair(object, mirrored), [&] {
    const LoadedObject loaded = LoadObject(object);
    return std::make_unique<const ActionProp>(MakeActionProp(
        object, loaded.mesh, ForFitting(loaded, kPairVertices, nullptr), mirrored, 1));
  });
}

const PreparedObject& ActionShelf::Prepared(const std::string& object) {
  return prepared_.Get(object, [&] {
    return std::make_unique<const PreparedObject>(PrepareObject(LoadObject(object), kPairVertices));
  });
}

ActionGrasps ActionShelf::GraspsOf(const ActionJob& job, bool both) {
  const ActionActor& actor = Actor(job.subject);
  const std::uint64_t seed = MixSeed(options_.seed, kGraspSeed);
  json key = GraspKey(actor, job.object, options_);
  key["mirrored"] = job.left;
  const fs::path stem =
      folder_ / "grasps" /
      fmt::format("s{}_{}{}", job.subject + 1, job.object, job.left ? "_left" : "");
  std::vector<Grasp> right = KeptGrasps(stem.string() + ".json", key, 1, [&] {
    return FindActionGrasps(actor.Hand(Side::kRight), Prop(job.object, job.left), seed,
                            kGraspChoice);
  });
  AddTurnedOver(Prop(job.object, job.left).marks, right);
  std::vector<std::pair<Grasp, Grasp>> pairs;
  if (both) {
    key["pairs_tried"] = kPairTries;
    // Stored alternately: right, left.
    const std::vector<Grasp> flat = KeptGrasps(stem.string() + "_pairs.json", key, 2, [&] {
      std::vector<Grasp> in_turn;
      for (const auto& [giving, taking] :
           FindGraspPairs(actor.Hand(Side::kRight), actor.Hand(Side::kLeft),
                          Prop(job.object, job.left), right, seed, kPairTries)) {
        in_turn.push_back(giving);
        in_turn.push_back(taking);
      }
      return in_turn;
    });
    for (std::size_t k = 0; k < flat.size(); k += 2) pairs.emplace_back(flat[k], flat[k + 1]);
  }
  return ActionGrasps(actor, right, pairs);
}

std::vector<Grasp> ActionShelf::GraspsOf(int subject, const std::string& object, Side side) {
  const ActionActor& actor = Actor(subject);
  json key = GraspKey(actor, object, options_);
  key["side"] = SideName(side);
  const fs::path path =
      folder_ / "grasps" / fmt::format("s{}_{}_{}_hand.json", subject + 1, object, SideName(side));
  return KeptGrasps(path, key, 1, [&] {
    return FindActionGrasps(actor.Hand(side), Prop(object, false),
                            MixSeed(options_.seed, kGraspSeed), kGraspChoice);
  });
}

}  // namespace holdfast
