// SPDX-License-Identifier: MIT
#include "solver/actions/make_action_set.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <tuple>

#include <fmt/format.h>

#include "generator/actions/action_catalog.h"
#include "generator/imos/vocabulary.h"
#include "generator/matching/capture_set.h"
#include "generator/nn/random_stream.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/io/container/json_file.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "geometry/seed.h"
#include "solver/actions/action_clip.h"
#include "solver/actions/action_shelf.h"
#include "solver/actions/captured_clip.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kClipTries = 4;  // per clip, before it is given up
constexpr std::uint64_t kStartSeed = 0x57A7;

json ActionQualityJson(const ActionQuality& quality) {
  return {{"worst_key", quality.worst_key},
          {"hand_error_deg", quality.hand_error_rad / kDegree},
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

// Counts of kept and dropped clips, with reasons.
json SummaryOf(const ManifestLines& lines) {
  std::map<std::string, std::map<std::string, int>> actions;
  std::map<std::string, int> reasons, subjects;
  long frames = 0;
  int kept = 0, tries = 0, captured = 0, captured_kept = 0;
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
    const bool is_captured = line.value("source", "scripted") == "captured";
    captured_kept += is_captured && is_kept ? 1 : 0;
    captured += is_captured ? 1 : 0;
    for (const json& dropped : line.value("tries_dropped", json::array())) {
      ++action["tries_dropped"];
      ++reasons[dropped.at("reason").get<std::string>()];
      ++tries;
    }
  }
  json summary = {{"clips", kept},
                  {"given_up", lines.size() - static_cast<std::size_t>(kept)},
                  {"tries", tries},
                  {"hours", static_cast<double>(frames) / 30.0 / 3600.0},
                  {"by_action", actions},
                  {"by_subject", subjects},
                  {"tries_dropped_because", reasons}};
  if (captured > 0) summary["captured"] = {{"clips", captured_kept}, {"of", captured}};
  return summary;
}

// Groups jobs by subject, object and hand, in an order in which a set grows evenly.
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

// Groups the remaining jobs by trial.
std::vector<std::vector<CapturedJob>> TrialsOf(const std::vector<CapturedJob>& jobs,
                                               const ManifestLines& done) {
  std::vector<std::vector<CapturedJob>> trials;
  for (const CapturedJob& job : jobs) {
    if (done.contains(job.index)) continue;
    const bool same =
        !trials.empty() && trials.back().front().files.recording == job.files.recording;
    if (!same) trials.emplace_back();
    trials.back().push_back(job);
  }
  return trials;
}

// Draws a person first, then a frame, so that longer captures are not overrepresented.
const StandingStart& DrawStart(const std::vector<StandingStart>& starts, std::uint64_t seed) {
  RandomDraws draws(MixSeed(seed, kStartSeed));
  std::map<std::string, std::vector<const StandingStart*>> people;
  for (const StandingStart& start : starts) people[start.person].push_back(&start);
  const auto& moments =
      std::next(people.begin(), draws.Index(static_cast<int>(people.size())))->second;
  return *moments[draws.Index(static_cast<int>(moments.size()))];
}

// Synthesizes the clips of a set; thread-safe.
class ActionSetMaker {
 public:
  ActionSetMaker(const std::shared_ptr<const BodyModel>& body, const ActionStarts& starts,
                 const fs::path& folder, const ActionSetOptions& options)
      : body_(body),
        starts_(starts),
        folder_(folder),
        options_(options),
        shelf_(body, folder, options) {}

  ActionShelf& Things() { return shelf_; }

  // Writes the clip unless all tries are rejected; returns its manifest line.
  json Make(const ActionJob& job, const ActionGrasps& grasps) {
    const bool held_out = IsHeldOut(job.subject, options_.subjects);
    json line = {{"index", job.index},
                 {"name", job.name},
                 {"action", job.action},
                 {"object", imos::VocabularyName(job.object)},
                 {"subject", fmt::format("s{}", job.subject + 1)},
                 {"split", held_out ? "held_out" : "train"},
                 {"hand", job.left ? "left" : "right"},
                 {"source", "scripted"}};
    json dropped = json::array();
    for (int attempt = 0; attempt < kClipTries; ++attempt) {
      const std::uint64_t seed = MixSeed(job.seed, static_cast<std::uint64_t>(attempt));
      const StandingStart& start = DrawStart(held_out ? starts_.held_out : starts_.train, seed);
      ActionClip made =
          MakeActionClip({job.action, shelf_.Actor(job.subject), shelf_.Prop(job.object, job.left),
                          grasps, start, job.left, seed, options_.wrist_blows});
      if (!made.fault.empty()) {
        dropped.push_back({{"reason", made.fault}, {"detail", made.detail}});
        continue;
      }
      Write(made.clip, job.object, made.quality, line);
      line["person"] = start.person;
      line["start"] = start.source;
      line["start_frame"] = start.source_frame;
      break;
    }
    if (!dropped.empty()) line["tries_dropped"] = std::move(dropped);
    return line;
  }

  // Writes the clips of one trial; returns a line for each.
  std::vector<json> Make(std::span<const CapturedJob> jobs) {
    std::vector<json> lines;
    std::optional<CapturedTrial> trial;
    std::string why;
    try {
      trial = ReadCapturedTrial(jobs.front().files, body_);
    } catch (const Error& error) {
      why = error.what();
    }
    for (const CapturedJob& job : jobs) {
      json line = {{"index", job.index},
                   {"action", trial ? trial->action.action : "unknown"},
                   {"subject", fmt::format("s{}", job.subject + 1)},
                   {"split", job.held_out ? "held_out" : "train"},
                   {"source", "captured"},
                   {"trial", job.files.name},
                   {"person", job.files.Person()},
                   {"posture", job.posture == RestPosture::kSeated ? "seated" : "standing"}};
      if (trial) {
        MakeOne(job, *trial, line);
      } else {
        Drop("trial cannot be used", why, line);
      }
      lines.push_back(std::move(line));
    }
    return lines;
  }

 private:
  static void Drop(const std::string& reason, const std::string& detail, json& line) {
    line["tries_dropped"] = json::array({{{"reason", reason}, {"detail", detail}}});
  }

  // Writes the clip of a line that has subject and name.
  void Write(Clip& clip, const std::string& object, const ActionQuality& quality,
             json& line) const {
    clip.subject = line["subject"].get<std::string>();
    clip.object->mesh = object;
    RoundToFloat(clip);
    const std::string file = line["name"].get<std::string>() + ".npz";
    WriteClip(clip, folder_ / file);
    line["file"] = file;
    line["frames"] = clip.NumFrames();
    line["quality"] = ActionQualityJson(quality);
  }

  // First requested object of a requested action; otherwise empty.
  std::string ObjectFor(const std::string& action) const {
    const auto asked = [](const std::vector<std::string>& list, std::string_view name) {
      return list.empty() || std::ranges::find(list, name) != list.end();
    };
    if (!asked(options_.actions, action)) return {};
    for (const std::string_view object : FindScriptedAction(action).objects) {
      if (asked(options_.objects, object)) return std::string(object);
    }
    return {};
  }

  void MakeOne(const CapturedJob& job, const CapturedTrial& trial, json& line) {
    const std::string object = ObjectFor(trial.action.action);
    if (object.empty()) return Drop("not requested", "see actions and objects", line);
    const std::vector<Grasp> grasps = trial.action.action == "brush"
                                          ? shelf_.GraspsOf(job.subject, object, trial.action.side)
                                          : std::vector<Grasp>();
    const StandingStart& start =
        DrawStart(job.held_out ? starts_.held_out : starts_.train, job.seed);
    CapturedClip made =
        MakeCapturedClip({trial, body_, shelf_.Actor(job.subject), shelf_.Prop(object, false),
                          shelf_.Prepared(object), grasps, job.posture, start, job.seed});
    line["object"] = imos::VocabularyName(object);
    line["hand"] = SideName(trial.action.side);
    line["name"] = fmt::format("{}/{}_{}_{}_{}", line["subject"].get<std::string>(),
                               imos::VocabularyName(object), trial.action.action, job.files.name,
                               line["posture"].get<std::string>());
    if (!made.fault.empty()) return Drop(made.fault, made.detail, line);
    Write(made.clip, object, made.quality, line);
    line["captured"] = trial.parts;
    line["act_frame"] = made.action.act;
    line["key_frame"] = made.action.key;
    line["return_frame"] = made.action.back;
    line["key_mean_mm"] = 1e3 * made.key_mean_m;
    line["key_worst_mm"] = 1e3 * made.key_worst_m;
    line["in_object_frames"] = made.in_object_frames;
    line["in_body_frames"] = made.in_body_frames;
    if (job.posture == RestPosture::kStanding) line["start"] = start.source;
  }

  const std::shared_ptr<const BodyModel>& body_;
  const ActionStarts& starts_;
  const fs::path& folder_;
  const ActionSetOptions& options_;
  ActionShelf shelf_;
};

// Name of a folder, independent of how its path is written.
std::string CapturedName(const std::string& folder) {
  const fs::path path = fs::path(folder).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

// Returns the lines of an earlier run whose clips still exist; `had` counts all of them. Fills in
// `head` of the manifest and creates the folders.
ManifestLines BeginSet(const BodyModel& body, const ActionStarts& starts, const fs::path& folder,
                       const ActionSetOptions& options, std::size_t captured_clips, json& head,
                       int& had) {
  head = {{"schema", "holdfast/actions/1"},
          {"holdfast_version", options.version},
          {"seed", options.seed},
          {"options",
           {{"subjects", options.subjects},
            {"left_share", options.left_share},
            {"blows", options.wrist_blows ? "wrist" : "arm"},
            {"actions", options.actions},
            {"objects", options.objects},
            {"starts", starts.name},
            {"held_out", starts.asked_held_out}}},
          {"body", body.Name()},
          {"people", {{"train", starts.train_people}, {"held_out", starts.held_out_people}}}};
  if (!options.captured.empty()) {
    head["options"]["captured"] = {{"folder", CapturedName(options.captured)},
                                   {"clips", captured_clips}};
  }
  const fs::path manifest = folder / "manifest.json";
  ManifestLines lines = LinesBefore(manifest, head, "make-actions", "starts", options.replace);
  had = static_cast<int>(lines.size());
  UseJson(manifest, [&] {
    SummaryOf(lines);  // throws if an entry is missing
    DropLost(lines, folder);
  });
  head["note"] = options.captured.empty()
                     ? "Synthetic: generated by holdfast make-actions, without captured actions"
                     : "Synthetic: generated by holdfast make-actions. Clips whose source is "
                       "'captured' take their timing, and the parts listed in 'captured', from a "
                       "captured action; object, fingers, head and legs are fitted";
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
    throw Error(folder.string(), "cannot be created as a folder", "Choose another folder");
  }
  return lines;
}

}  // namespace

ActionSetReport MakeActionSet(const std::shared_ptr<const BodyModel>& body,
                              const ActionStarts& starts, const fs::path& folder,
                              const ActionSetOptions& options, const StagedProgress& progress) {
  const std::vector<ActionJob> jobs = PlanActions(options);
  const std::vector<CapturedJob> captured = PlanCaptured(options);
  ActionSetReport report;
  ManifestLines lines =
      BeginSet(*body, starts, folder, options, captured.size(), report.head, report.had);
  ActionSetMaker maker(body, starts, folder, options);
  const std::vector<std::vector<ActionJob>> groups = GroupsOf(jobs, lines, options.seed);
  const std::vector<std::vector<CapturedJob>> trials = TrialsOf(captured, lines);
  const auto begin = std::chrono::steady_clock::now();
  int waiting = 0;
  for (const std::vector<ActionJob>& group : groups) waiting += static_cast<int>(group.size());
  for (const std::vector<CapturedJob>& trial : trials) waiting += static_cast<int>(trial.size());
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
  const auto make_group = [&](const std::vector<ActionJob>& group) {
    const bool both = std::ranges::find(group, "offhand", &ActionJob::action) != group.end();
    const ActionGrasps grasps = maker.Things().GraspsOf(group.front(), both);
    std::vector<json> some;
    for (const ActionJob& job : group) {
      if (!go_on()) break;
      some.push_back(maker.Make(job, grasps));
    }
    return some;
  };
  const auto num_groups = static_cast<int>(groups.size());
  const int parts = num_groups + static_cast<int>(trials.size());
  ParallelFor(parts, options.threads, [&](int g) {
    if (!go_on()) return;
    const std::vector<json> some =
        g < num_groups ? make_group(groups[g]) : maker.Make(trials[g - num_groups]);
    const std::scoped_lock guard(lock);
    for (const json& line : some) lines[line["index"].get<int>()] = line;
    report.made += static_cast<int>(some.size());
    write(false);
    go_on();
  });
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() *
                   std::min(options.threads, std::max(1, parts));
  report.complete = !stopped;
  if (report.complete) write(true);
  return report;
}

}  // namespace holdfast
