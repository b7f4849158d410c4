// SPDX-License-Identifier: MIT
#include "apps/make/action_set.h"

#include <numbers>
#include <set>

#include <fmt/format.h>

#include "apps/make/grasp_file.h"
#include "generator/imos/vocabulary.h"
#include "generator/matching/random_draws.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/seed.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kTries = 4;    // of a clip, before it is given up
constexpr int kGrasps = 14;  // that a hand may choose from
constexpr int kPairVertices = 300;
constexpr int kPairTries = 5;  // grasps of a giving hand that a receiving one is found for
constexpr std::uint64_t kStart = 0x57A7, kGraspSeed = 0x6AA5;

json ActionQualityJson(const ActionQuality& quality) {
  const double degree = std::numbers::pi / 180.0;
  return {{"worst_key", quality.worst_key},
          {"hand_error_deg", quality.hand_error_rad / degree},
          {"lack_mm", 1000.0 * quality.lack_m},
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

}  // namespace

ActionWorkshop::ActionWorkshop(std::shared_ptr<const BodyModel> body, ActionStarts starts,
                               const ActionSetOptions& options, fs::path folder, std::uint64_t seed)
    : body_(std::move(body)),
      starts_(std::move(starts)),
      options_(options),
      folder_(std::move(folder)),
      seed_(seed) {}

template <typename Key, typename Value>
ActionWorkshop::Shelf<Value>& ActionWorkshop::ShelfOf(
    std::map<Key, std::unique_ptr<Shelf<Value>>>& shelves, const Key& key) {
  const std::scoped_lock guard(lock_);
  std::unique_ptr<Shelf<Value>>& shelf = shelves[key];
  if (!shelf) shelf = std::make_unique<Shelf<Value>>();
  return *shelf;
}

const ActionActor& ActionWorkshop::Actor(int subject) {
  Shelf<ActionActor>& shelf = ShelfOf(actors_, subject);
  const std::scoped_lock guard(shelf.lock);
  if (!shelf.value) {
    shelf.value =
        std::make_unique<const ActionActor>(body_, SubjectBetas(subject, body_->NumShape(), seed_));
  }
  return *shelf.value;
}

const ActionProp& ActionWorkshop::Prop(const std::string& object, bool mirrored) {
  Shelf<ActionProp>& shelf = ShelfOf(props_, std::pair(object, mirrored));
  const std::scoped_lock guard(shelf.lock);
  if (!shelf.value) {
    const LoadedObject loaded = LoadObjectInput(object);
    shelf.value = std::make_unique<const ActionProp>(MakeActionProp(
        object, loaded.mesh, ForFitting(loaded, kPairVertices, nullptr), mirrored, 1));
  }
  return *shelf.value;
}

json ActionWorkshop::GraspKey(int subject, const std::string& object, bool mirrored) {
  const Eigen::VectorXd& betas = Actor(subject).Betas();
  return {{"version", HOLDFAST_VERSION},
          {"body", body_->Name()},
          {"betas", std::vector<double>(betas.begin(), betas.end())},
          {"object", object},
          {"mirrored", mirrored},
          {"seed", MixSeed(seed_, kGraspSeed)},
          {"most", kGrasps}};
}

std::vector<Grasp> ActionWorkshop::GraspsOf(int subject, const std::string& object, bool mirrored) {
  const json key = GraspKey(subject, object, mirrored);
  const fs::path path = folder_ / "grasps" /
                        fmt::format("s{}_{}{}.json", subject + 1, object, mirrored ? "_left" : "");
  if (std::optional<std::vector<Grasp>> kept = ReadGrasps(key, path)) return *kept;
  const ActionProp& prop = Prop(object, mirrored);
  const std::vector<Grasp> grasps =
      FindActionGrasps(Actor(subject).Hand(Side::kRight),
                       {prop.mesh, prop.surface, *prop.fit.distance}, key["seed"], kGrasps);
  WriteGrasps(grasps, key, path);
  return grasps;
}

std::vector<GraspPair> ActionWorkshop::PairsOf(int subject, const std::string& object,
                                               bool mirrored, const std::vector<Grasp>& right) {
  json key = GraspKey(subject, object, mirrored);
  key["pairs_tried"] = kPairTries;
  const fs::path path =
      folder_ / "grasps" /
      fmt::format("s{}_{}{}_pairs.json", subject + 1, object, mirrored ? "_left" : "");
  std::vector<GraspPair> pairs;
  // In the file, a right and a left one in turn.
  if (const std::optional<std::vector<Grasp>> kept = ReadGrasps(key, path);
      kept && kept->size() % 2 == 0) {
    for (std::size_t k = 0; k < kept->size(); k += 2) pairs.push_back({(*kept)[k], (*kept)[k + 1]});
    return pairs;
  }
  const ActionProp& prop = Prop(object, mirrored);
  const ActionActor& actor = Actor(subject);
  pairs =
      FindGraspPairs(actor.Hand(Side::kRight), actor.Hand(Side::kLeft),
                     {prop.mesh, prop.surface, *prop.fit.distance}, right, key["seed"], kPairTries);
  std::vector<Grasp> flat;
  for (const GraspPair& pair : pairs) {
    flat.push_back(pair.right);
    flat.push_back(pair.left);
  }
  WriteGrasps(flat, key, path);
  return pairs;
}

std::unique_ptr<const ActionGrips> ActionWorkshop::Grips(int subject, const std::string& object,
                                                         bool mirrored, bool both) {
  std::vector<Grasp> right = GraspsOf(subject, object, mirrored);
  std::vector<GraspPair> pairs;
  if (both) pairs = PairsOf(subject, object, mirrored, right);
  return std::make_unique<const ActionGrips>(Actor(subject), std::move(right), std::move(pairs));
}

std::vector<json> ActionWorkshop::Make(const std::vector<ActionJob>& jobs) {
  std::vector<json> lines;
  if (jobs.empty()) return lines;
  bool both = false;
  for (const ActionJob& job : jobs) both |= job.action == "offhand";
  const ActionJob& first = jobs.front();
  const std::unique_ptr<const ActionGrips> grips =
      Grips(first.subject, first.object, first.left, both);
  for (const ActionJob& job : jobs) {
    if (Interrupted()) break;
    lines.push_back(MakeOne(job, *grips));
  }
  return lines;
}

json ActionWorkshop::MakeOne(const ActionJob& job, const ActionGrips& grips) {
  const bool held_out = IsHeldOut(job.subject, options_.subjects);
  const std::vector<StandingStart>& starts = held_out ? starts_.held_out : starts_.train;
  json line = {{"index", job.index},
               {"name", job.name},
               {"action", job.action},
               {"object", imos::VocabularyName(job.object)},
               {"subject", fmt::format("s{}", job.subject + 1)},
               {"split", held_out ? "held_out" : "train"},
               {"hand", job.left ? "left" : "right"}};
  json dropped = json::array();
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const std::uint64_t seed = MixSeed(job.seed, static_cast<std::uint64_t>(attempt));
    // A person first, then a moment: who was captured for longer is not seen the oftener.
    RandomDraws draws(MixSeed(seed, kStart));
    std::set<std::string> people;
    for (const StandingStart& start : starts) people.insert(start.person);
    const std::string person =
        *std::next(people.begin(), draws.Index(static_cast<int>(people.size())));
    std::vector<const StandingStart*> moments;
    for (const StandingStart& start : starts) {
      if (start.person == person) moments.push_back(&start);
    }
    const StandingStart& start =
        *moments[static_cast<std::size_t>(draws.Index(static_cast<int>(moments.size())))];
    ActionClip made = MakeActionClip(
        {job.action, Actor(job.subject), Prop(job.object, job.left), grips, start, job.left, seed});
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

}  // namespace holdfast::apps
