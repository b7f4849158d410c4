// SPDX-License-Identifier: MIT
#include "solver/actions/make_action_set.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <numbers>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "generator/imos/vocabulary.h"
#include "generator/matching/random_draws.h"
#include "generator/matching/set_manifest.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/io/container/read_json.h"
#include "geometry/io/mesh/load_object.h"
#include "geometry/parallel.h"
#include "geometry/seed.h"
#include "solver/actions/action_clip.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kClipTries = 4;  // of a clip, before it is given up
constexpr std::uint64_t kStartSeed = 0x57A7, kGraspSeed = 0x6AA5;

json ActionQualityJson(const ActionQuality& quality) {
  const double degree = std::numbers::pi / 180.0;
  return {{"worst_key", quality.worst_key},
          {"hand_error_deg", quality.hand_error_rad / degree},
          {"lack_mm", 1000.0 * quality.shortfall_m},
          {"penetrating", quality.penetrating},
          {"deepest_mm", quality.deepest_mm},
          {"contact", quality.contact},
          {"object_in_body_mm", quality.object_in_body_mm},
          {"hand_in_head_mm", quality.hand_in_head_mm},
          {"arm_in_trunk_mm", quality.arm_in_trunk_mm},
          {"beyond_limits", quality.beyond_limits},
          {"skate", quality.skate},
          {"max_acceleration", quality.max_acceleration},
          {"slipped_mm", quality.slipped_mm}};
}

// What was kept and dropped, and why.
json SummaryOf(const ManifestLines& lines) {
  std::map<std::string, std::map<std::string, int>> actions;
  std::map<std::string, int> reasons, subjects;
  long frames = 0;
  int kept = 0, tries = 0;
  for (const auto& [index, line] : lines) {
    std::map<std::string, int>& action = actions[line.at("action").get<std::string>()];
    const bool is_kept = line.contains("file");
    ++action[is_kept ? "kept" : "given_up"];
    tries += is_kept ? 1 : 0;
    if (is_kept) {
      ++kept;
      ++subjects[line.at("subject").get<std::string>()];
      frames += line.at("frames").get<long>();
    }
    for (const json& dropped : line.value("tries_dropped", json::array())) {
      ++action["tries_dropped"];
      ++reasons[dropped.at("reason").get<std::string>()];
      ++tries;
    }
  }
  return {{"clips", kept},
          {"given_up", lines.size() - static_cast<std::size_t>(kept)},
          {"tries", tries},
          {"hours", static_cast<double>(frames) / 30.0 / 3600.0},
          {"by_action", actions},
          {"by_subject", subjects},
          {"tries_dropped_because", reasons}};
}

// Jobs that share subject, object and hand; in an order in which a set grows evenly.
std::vector<std::vector<ActionJob>> GroupsOf(const std::vector<ActionJob>& jobs,
                                             const ManifestLines& done, std::uint64_t seed) {
  std::map<std::tuple<int, std::string, bool>, std::vector<ActionJob>> groups;
  for (const ActionJob& job : jobs) {
    if (!done.contains(job.index)) groups[{job.subject, job.object, job.left}].push_back(job);
  }
  std::vector<std::vector<ActionJob>> list;
  for (auto& [key, group] : groups) list.push_back(std::move(group));
  std::ranges::sort(list, {}, [&](const std::vector<ActionJob>& group) {
    return MixSeed(seed, static_cast<std::uint64_t>(group.front().index));
  });
  return list;
}

// What clips share, each made when it is first asked for. Threads may ask at the same time.
template <typename Key, typename Value>
class Shelf {
 public:
  template <typename Make>
  const Value& Get(const Key& key, const Make& make) {
    Place* place = nullptr;
    {
      const std::scoped_lock guard(lock_);
      place = &places_[key];
    }
    const std::scoped_lock guard(place->lock);
    if (!place->value) place->value = make();
    return *place->value;
  }

 private:
  struct Place {
    std::mutex lock;
    std::unique_ptr<const Value> value;
  };
  std::mutex lock_;
  std::map<Key, Place> places_;
};

json StoredGrasp(const Grasp& grasp) {
  const Eigen::Matrix<double, 3, 4> pose = grasp.wrist_from_object.matrix().topRows<3>();
  return {{"style", StyleName(grasp.style)},
          {"fingers", std::vector<double>(grasp.fingers.begin(), grasp.fingers.end())},
          {"wrist_from_object", std::vector<double>(pose.data(), pose.data() + pose.size())},
          {"below_bottom_mm", grasp.below_bottom_mm},
          {"score", grasp.score}};
}

// Nothing where the entry is not a grasp.
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

// The grasps of a file with this key, a multiple of `together`; nothing where there is no such
// file, or another's.
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

// Grasps that are kept in a file, to the last bit; `key` says what they are of. Where they are not
// there, `make` gives them and they are written.
template <typename Make>
std::vector<Grasp> KeptGrasps(const fs::path& path, const json& key, std::size_t together,
                              const Make& make) {
  if (std::optional<std::vector<Grasp>> kept = ReadGrasps(path, key, together)) return *kept;
  std::vector<Grasp> grasps = make();
  json list = json::array();
  for (const Grasp& grasp : grasps) list.push_back(StoredGrasp(grasp));
  WriteAtomically(path, json{{"of", key}, {"grasps", list}}.dump() + "\n");
  return grasps;
}

// A person first, then a moment: who was captured for longer is not seen the oftener.
const StandingStart& DrawStart(const std::vector<StandingStart>& starts, std::uint64_t seed) {
  RandomDraws draws(MixSeed(seed, kStartSeed));
  std::map<std::string, std::vector<const StandingStart*>> people;
  for (const StandingStart& start : starts) people[start.person].push_back(&start);
  const auto& moments =
      std::next(people.begin(), draws.Index(static_cast<int>(people.size())))->second;
  return *moments[static_cast<std::size_t>(draws.Index(static_cast<int>(moments.size())))];
}

// Makes the clips of a set, from any number of threads.
class ActionSetMaker {
 public:
  ActionSetMaker(const std::shared_ptr<const BodyModel>& body, const ActionStarts& starts,
                 const fs::path& folder, const ActionSetOptions& options)
      : body_(body), starts_(starts), folder_(folder), options_(options) {}

  // How the subject of a job holds its prop with the right hand, and with both where `both`.
  // Grasps are kept in FOLDER/grasps, and taken from there by a later run with the same body, shape
  // and seed.
  ActionGrasps GraspsOf(const ActionJob& job, bool both) {
    const ActionActor& actor = Actor(job.subject);
    const std::uint64_t seed = MixSeed(options_.seed, kGraspSeed);
    json key = {{"version", options_.version},
                {"body", body_->Name()},
                {"betas", std::vector<double>(actor.Betas().begin(), actor.Betas().end())},
                {"object", job.object},
                {"mirrored", job.left},
                {"seed", seed},
                {"most", kGraspChoice}};
    const fs::path stem =
        folder_ / "grasps" /
        fmt::format("s{}_{}{}", job.subject + 1, job.object, job.left ? "_left" : "");
    std::vector<Grasp> right = KeptGrasps(stem.string() + ".json", key, 1, [&] {
      const ActionProp& prop = Prop(job);
      return FindActionGrasps(actor.Hand(Side::kRight),
                              {prop.mesh, prop.surface, *prop.fit.distance}, seed, kGraspChoice);
    });
    std::vector<GraspPair> pairs;
    if (both) {
      key["pairs_tried"] = kPairTries;
      // In the file, a right and a left one in turn.
      const std::vector<Grasp> flat = KeptGrasps(stem.string() + "_pairs.json", key, 2, [&] {
        const ActionProp& prop = Prop(job);
        std::vector<Grasp> in_turn;
        for (const GraspPair& pair : FindGraspPairs(
                 actor.Hand(Side::kRight), actor.Hand(Side::kLeft),
                 {prop.mesh, prop.surface, *prop.fit.distance}, right, seed, kPairTries)) {
          in_turn.push_back(pair.right);
          in_turn.push_back(pair.left);
        }
        return in_turn;
      });
      for (std::size_t k = 0; k < flat.size(); k += 2) pairs.push_back({flat[k], flat[k + 1]});
    }
    return ActionGrasps(actor, std::move(right), std::move(pairs));
  }

  // Writes the clip unless all tries have a fault; its line of the manifest.
  json Make(const ActionJob& job, const ActionGrasps& grasps) {
    const bool held_out = IsHeldOut(job.subject, options_.subjects);
    json line = {{"index", job.index},
                 {"name", job.name},
                 {"action", job.action},
                 {"object", imos::VocabularyName(job.object)},
                 {"subject", fmt::format("s{}", job.subject + 1)},
                 {"split", held_out ? "held_out" : "train"},
                 {"hand", job.left ? "left" : "right"}};
    json dropped = json::array();
    for (int attempt = 0; attempt < kClipTries; ++attempt) {
      const std::uint64_t seed = MixSeed(job.seed, static_cast<std::uint64_t>(attempt));
      const StandingStart& start = DrawStart(held_out ? starts_.held_out : starts_.train, seed);
      ActionClip made = MakeActionClip(
          {job.action, Actor(job.subject), Prop(job), grasps, start, job.left, seed});
      if (!made.fault.empty()) {
        dropped.push_back({{"reason", made.fault}, {"detail", made.detail}});
        continue;
      }
      made.clip.subject = fmt::format("s{}", job.subject + 1);
      made.clip.object->mesh = job.object;
      RoundToFloat(made.clip);
      const fs::path file = job.name + ".npz";
      WriteClip(made.clip, folder_ / file);
      line["file"] = file.string();
      line["frames"] = made.clip.NumFrames();
      line["person"] = start.person;
      line["start"] = start.source;
      line["start_frame"] = start.source_frame;
      line["quality"] = ActionQualityJson(made.quality);
      break;
    }
    if (!dropped.empty()) line["tries_dropped"] = std::move(dropped);
    return line;
  }

 private:
  const ActionActor& Actor(int subject) {
    return actors_.Get(subject, [&] {
      return std::make_unique<const ActionActor>(
          body_, SubjectBetas(subject, body_->NumShape(), options_.seed));
    });
  }
  const ActionProp& Prop(const ActionJob& job) {
    return props_.Get(std::pair(job.object, job.left), [&] {
      const LoadedObject loaded = LoadObject(job.object);
      return std::make_unique<const ActionProp>(MakeActionProp(
          job.object, loaded.mesh, ForFitting(loaded, kPairVertices, nullptr), job.left, 1));
    });
  }

  const std::shared_ptr<const BodyModel>& body_;
  const ActionStarts& starts_;
  const fs::path& folder_;
  const ActionSetOptions& options_;
  Shelf<int, ActionActor> actors_;
  Shelf<std::pair<std::string, bool>, ActionProp> props_;
};

// The lines of an earlier run whose clips are still there; `had` counts all. `head` of the manifest
// is filled in, and folders are made.
ManifestLines BeginSet(const BodyModel& body, const ActionStarts& starts, const fs::path& folder,
                       const ActionSetOptions& options, json& head, int& had) {
  head = {{"schema", "holdfast/actions/1"},
          {"holdfast_version", options.version},
          {"seed", options.seed},
          {"options",
           {{"subjects", options.subjects},
            {"left_share", options.left_share},
            {"actions", options.actions},
            {"objects", options.objects},
            {"starts", starts.name},
            {"held_out", starts.asked_held_out}}},
          {"body", body.Name()},
          {"people", {{"train", starts.train_people}, {"held_out", starts.held_out_people}}}};
  const fs::path manifest = folder / "manifest.json";
  ManifestLines lines = LinesBefore(manifest, head, "make-actions", "starts", options.replace);
  had = static_cast<int>(lines.size());
  UseJson(manifest, [&] {
    SummaryOf(lines);  // all is there
    std::erase_if(lines, [&](const ManifestLines::value_type& line) {
      return line.second.contains("file") &&
             !fs::exists(folder / line.second.at("file").get<std::string>());
    });
  });
  head["note"] = "Synthetic: made by holdfast make-actions, no capture of anybody who acts";
  std::error_code error;
  fs::create_directories(folder / "grasps", error);
  for (int s = 0; s < options.subjects; ++s) {
    const std::string name = fmt::format("s{}", s + 1);
    const Eigen::VectorXd betas = SubjectBetas(s, body.NumShape(), options.seed);
    head["subjects"][name] = {{"split", IsHeldOut(s, options.subjects) ? "held_out" : "train"},
                              {"betas", std::vector<double>(betas.begin(), betas.end())}};
    fs::create_directories(folder / name, error);
  }
  if (!fs::is_directory(folder / "grasps")) {
    throw Error(folder.string(), "is not a folder that can be created", "Choose another place");
  }
  return lines;
}

}  // namespace

ActionSetReport MakeActionSet(const std::shared_ptr<const BodyModel>& body,
                              const ActionStarts& starts, const fs::path& folder,
                              const ActionSetOptions& options, const StagedProgress& progress) {
  const std::vector<ActionJob> jobs = PlanActions(options);
  ActionSetReport report;
  ManifestLines lines = BeginSet(*body, starts, folder, options, report.head, report.had);
  ActionSetMaker maker(body, starts, folder, options);
  const std::vector<std::vector<ActionJob>> groups = GroupsOf(jobs, lines, options.seed);
  const auto begin = std::chrono::steady_clock::now();
  int waiting = 0;
  for (const std::vector<ActionJob>& group : groups) waiting += static_cast<int>(group.size());
  std::recursive_mutex lock;
  bool stopped = false;
  const auto go_on = [&] {
    const std::scoped_lock guard(lock);
    stopped = stopped || (progress && !progress("clips", report.made, waiting));
    return !stopped;
  };
  const auto write = [&](bool complete) {
    report.head["complete"] = complete;
    report.head["summary"] = SummaryOf(lines);
    WriteManifest(folder / "manifest.json", report.head, lines);
  };
  ParallelFor(static_cast<int>(groups.size()), options.threads, [&](int g) {
    if (!go_on()) return;
    const std::vector<ActionJob>& group = groups[static_cast<std::size_t>(g)];
    const bool both = std::ranges::find(group, "offhand", &ActionJob::action) != group.end();
    const ActionGrasps grasps = maker.GraspsOf(group.front(), both);
    std::vector<json> some;
    for (const ActionJob& job : group) {
      if (!go_on()) break;
      some.push_back(maker.Make(job, grasps));
    }
    const std::scoped_lock guard(lock);
    for (const json& line : some) lines[line["index"].get<int>()] = line;
    report.made += static_cast<int>(some.size());
    write(false);
    go_on();
  });
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() *
                   std::min(options.threads, std::max(1, static_cast<int>(groups.size())));
  report.complete = !stopped;
  if (report.complete) write(true);
  return report;
}

}  // namespace holdfast
