// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "apps/common.h"
#include "apps/make/capture_set.h"
#include "apps/make/reach_manifest.h"
#include "generator/body/finger_pose.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/parallel.h"
#include "geometry/seed.h"
#include "solver/body_ik/reach_clip.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kMostAtOnce = 32;  // clips between two entries in the manifest
constexpr int kMostTries = 6;    // clips tried per clip wanted before giving up

struct MakeReachDataCommand {
  CommonOptions common;
  std::string captures;
  std::string output;
  std::string body;
  std::string wrist = "right";
  std::vector<std::string> held_out;
  double hours = 1.0;
  int reaches = 3;
  double farthest = 5.0;
  double pace = 1.0;
  double blend_s = 0.35;
  bool as_captured = false;
};

std::string ClipName(int index) { return fmt::format("reach_{:05d}", index); }

// All that is the same for every clip.
struct Workshop {
  const MakeReachDataCommand& options;
  fs::path folder;
  std::string body_name;
  MotionLibrary library;
  ReachClipOptions making;
  JointPose hands = JointPose::Zero();
};

json SourceJson(const LibraryClip& clip) {
  return clip.mirrored ? json(clip.name + "~mirrored") : json(clip.name);
}

json Provenance(const Workshop& shop, const ReachClip& made, std::uint64_t seed) {
  json segments = json::array(), reaches = json::array();
  for (const MotionSegment& segment : made.segments) {
    segments.push_back({{"frame", segment.begin},
                        {"source", SourceJson(shop.library.Clips()[segment.clip])},
                        {"source_frame", segment.source_frame},
                        {"rate", segment.rate}});
  }
  for (const ReachLabel& label : made.labels) {
    reaches.push_back({{"goal_m", {label.goal.x(), label.goal.y(), label.goal.z()}},
                       {"frame", label.frame},
                       {"wrist", SideName(label.wrist)},
                       {"how", label.warped ? "carried" : "as captured"},
                       {"carried_m", label.carried_m},
                       {"error_m", label.error_m},
                       {"source", SourceJson(shop.library.Clips()[label.source])}});
  }
  return {{"made_by", "holdfast make-reach-data " HOLDFAST_VERSION},
          {"seed", seed},
          {"transitions_blended_s", shop.making.synthesis.blend_s},
          {"segments", segments},
          {"reaches", reaches}};
}

void WriteReachClip(const Workshop& shop, const ReachClip& made, const json& provenance,
                    const fs::path& path) {
  Clip clip = ToClip(made.frames, MotionLibrary::kFrameRate, shop.library.RestJoints(), shop.hands);
  clip.body_model = shop.body_name;
  clip.action = "reach";
  RoundToFloat(clip);
  NpzWriter writer;
  AddArrays(clip, writer);
  const std::size_t count = made.labels.size();
  std::vector<double> goals;
  std::vector<std::int64_t> frames;
  std::vector<std::uint8_t> wrists;
  for (const ReachLabel& label : made.labels) {
    goals.insert(goals.end(), label.goal.begin(), label.goal.end());
    frames.push_back(label.frame);
    wrists.push_back(label.wrist == Side::kRight ? kHoldsRight : kHoldsLeft);
  }
  writer.AddFloat64("goal", {count, 3}, goals);
  writer.AddInt64("goal_frame", {count}, frames);
  writer.AddUint8("goal_wrist", {count}, wrists);
  writer.AddText("provenance", provenance.dump());
  writer.Write(path);
}

// The line of one clip in the manifest; the clip is written unless it has a fault.
json MakeOne(const Workshop& shop, int index) {
  const std::uint64_t seed = MixSeed(shop.options.common.seed, static_cast<std::uint64_t>(index));
  ReachClipOptions making = shop.making;
  if (shop.options.wrist == "both" && index % 2 == 1) making.synthesis.wrist = Side::kLeft;
  const ReachClip made = MakeReachClip(shop.library, making, seed);
  json line = {{"index", index},
               {"seed", seed},
               {"frames", made.frames.size()},
               {"transitions", made.transitions},
               {"quality", QualityJson(made.quality)},
               {"foot_correction_m", made.feet.max_correction_m},
               {"pelvis_sink_m", made.feet.max_sink_m}};
  if (!made.fault.empty()) {
    line["dropped"] = made.fault;
    return line;
  }
  const json provenance = Provenance(shop, made, seed);
  line["file"] = "made/" + ClipName(index) + ".npz";
  line["wrist"] = SideName(making.synthesis.wrist);
  line["reaches"] = provenance["reaches"];
  line["statistics"] = {{"skating_frames", made.statistics.skating_frames},
                        {"pelvis_speed", made.statistics.pelvis_speed},
                        {"acceleration", made.statistics.acceleration}};
  std::set<std::string> sources;
  for (const json& segment : provenance["segments"]) sources.insert(segment["source"]);
  line["sources"] = sources;
  WriteReachClip(shop, made, provenance, shop.folder / "made" / (ClipName(index) + ".npz"));
  return line;
}

json OptionsJson(const MakeReachDataCommand& options) {
  return {{"captures", fs::path(options.captures).filename().string()},
          {"hours", options.hours},
          {"reaches", options.reaches},
          {"farthest_m", options.farthest},
          {"pace", options.pace},
          {"blend_s", options.blend_s},
          {"wrist", options.wrist},
          {"as_captured", options.as_captured}};
}

// What was captured, and how much of it each split has.
struct CaptureSums {
  MotionStatistics train, held_out;
  double train_minutes = 0.0, held_minutes = 0.0;
  int dropped = 0, reach_sources = 0;
};

// Measures all captures that move, and adds those to learn from to the library.
CaptureSums FillLibrary(const std::vector<Capture>& captures, const RetargetBody& target,
                        Workshop& shop) {
  CaptureSums sums;
  std::vector<std::vector<BodyFrame>> moving;
  for (const Capture& capture : captures) {
    if (!capture.fault.empty()) {
      ++sums.dropped;
      continue;
    }
    const ClipUse use = UseOf(capture, target);
    const std::vector<BodyFrame> frames = BodyFrames(capture.clip, target.rest_joints);
    JointLimits none;
    none.fill(10.0);
    MotionStatistics* const statistics = capture.held_out ? &sums.held_out : &sums.train;
    (capture.held_out ? sums.held_minutes : sums.train_minutes) +=
        capture.clip.NumFrames() / MotionLibrary::kFrameRate / 60.0;
    if (!use.walking && !use.reach) continue;
    MeasureQuality(target.rest_joints, shop.library.SolesOfBody(), frames, none, statistics);
    if (capture.held_out) continue;
    moving.push_back(frames);
    shop.library.Add(capture.clip, capture.name, use);
    sums.reach_sources += use.reach.has_value() ? 1 : 0;
  }
  shop.library.Finish();
  shop.making.warp.joint_limits = LimitsOf(moving);
  return sums;
}

void SetMaking(const MakeReachDataCommand& options, const RetargetBody& target, Workshop& shop) {
  shop.making.synthesis.reaches = options.reaches;
  shop.making.synthesis.farthest_goal = options.farthest;
  shop.making.synthesis.pace = options.pace;
  shop.making.synthesis.blend_s = options.blend_s;
  shop.making.synthesis.wrist = options.wrist == "left" ? Side::kLeft : Side::kRight;
  shop.making.carry_to_goals = !options.as_captured;
  for (const Side side : {Side::kLeft, Side::kRight}) {
    shop.hands.middleCols<kJointsPerHand>(HandBegin(side)) =
        RelaxedFingers(target.rest_joints, side).reshaped(3, kJointsPerHand);
  }
}

// The lines of the manifest so far, and the motion in their clips.
struct MadeSoFar {
  std::vector<json> lines;
  double minutes = 0.0;
};

// The next clips in parallel; those beyond the minutes that are wanted are removed again. False
// when interrupted: nothing is added then.
bool MakeBatch(const Workshop& shop, double wanted, MadeSoFar& made) {
  const int begin = static_cast<int>(made.lines.size());
  // About half a minute each; never by the number of threads, so that results are the same.
  const int count = std::clamp(static_cast<int>(2.0 * (wanted - made.minutes)) + 1, 1, kMostAtOnce);
  std::vector<json> batch(static_cast<std::size_t>(count));
  ParallelFor(count, NumThreads(shop.options.common), [&](int k) {
    if (!Interrupted()) batch[static_cast<std::size_t>(k)] = MakeOne(shop, begin + k);
  });
  if (Interrupted()) return false;
  std::error_code error;
  for (json& line : batch) {
    if (made.minutes >= wanted) {
      fs::remove(shop.folder / line.value("file", "made/none"), error);
      continue;
    }
    made.minutes += MinutesOf(line);
    made.lines.push_back(std::move(line));
  }
  return true;
}

// Goes on until there are the minutes that are wanted, the manifest always up to date. Throws
// FitFailure when nearly all clips are dropped; false when interrupted.
bool MakeUntil(const Workshop& shop, double wanted, const fs::path& manifest, Progress& progress,
               json& head, MadeSoFar& made) {
  const int most = std::max(200, static_cast<int>(kMostTries * wanted / 0.3));
  while (made.minutes < wanted && static_cast<int>(made.lines.size()) < most && !Interrupted()) {
    if (!MakeBatch(shop, wanted, made)) return false;
    head["complete"] = made.minutes >= wanted;
    WriteAtomically(manifest, ManifestText(head, made.lines));
    progress.Update(static_cast<int>(std::min(made.minutes, wanted)),
                    static_cast<int>(wanted + 0.5));
  }
  if (Interrupted()) return false;
  if (made.minutes < wanted) {
    throw FitFailure(
        fmt::format("{:.1f} of {:.1f} minutes after {} clips: nearly all are dropped, "
                    "see {}",
                    made.minutes, wanted, made.lines.size(), manifest.string()));
  }
  return true;
}

// The complete manifest is written with its summary, which is then told; `had` clips of it were
// there before.
void FinishManifest(const Workshop& shop, const CaptureSums& captured, const MadeSoFar& made,
                    int had, const fs::path& manifest, json head) {
  MotionStatistics statistics;
  int kept = 0, goals = 0, carried = 0;
  for (const json& line : made.lines) {
    if (!line.contains("file")) continue;
    ++kept;
    statistics.Add(StatisticsOf(line));
    for (const json& reach : line["reaches"]) {
      ++goals;
      carried += reach["how"] == "carried" ? 1 : 0;
    }
  }
  head["complete"] = true;
  head["statistics"] = {{"captured_train", StatisticsJson(captured.train)},
                        {"captured_held_out", StatisticsJson(captured.held_out)},
                        {"made", StatisticsJson(statistics)}};
  head["summary"] = {{"hours", made.minutes / 60.0},
                     {"clips", kept},
                     {"clips_dropped", made.lines.size() - static_cast<std::size_t>(kept)},
                     {"goals", goals},
                     {"goals_carried", carried},
                     {"captured_train_minutes", captured.train_minutes},
                     {"captured_held_out_minutes", captured.held_minutes},
                     {"captured_dropped", captured.dropped}};
  WriteAtomically(manifest, ManifestText(head, made.lines));
  head.erase("captures");
  head["output"] = shop.options.output;
  PrintResult(shop.options.common, head,
              fmt::format("{}: {:.2f} hours in {} clips ({} dropped, {} of them there already), {} "
                          "goals, {} carried\n",
                          shop.options.output, made.minutes / 60.0, kept,
                          static_cast<int>(made.lines.size()) - kept, had, goals, carried));
}

int Run(const MakeReachDataCommand& options) {
  const CommonOptions& common = options.common;
  const fs::path folder = options.output;
  const auto body = LoadBody(options.body);
  const RetargetBody target = RetargetBodyOf(*body);

  std::vector<Capture> captures = ListCaptures(options.captures);
  if (!ImportCaptures(options.captures, folder / "captured", *body, common, captures)) {
    return kInterrupted;
  }
  HoldOut(captures, options.held_out);
  SortClips(folder / "captured", captures);

  Workshop shop{options,      folder,
                body->Name(), MotionLibrary(target.rest_joints, target.floor_y),
                {},           JointPose::Zero()};
  const CaptureSums captured = FillLibrary(captures, target, shop);
  SetMaking(options, target, shop);

  json head = JsonHead("holdfast/reach-data/1", common);
  head["options"] = OptionsJson(options);
  head["body"] = body->Name();
  head["captures"] = CapturesJson(captures);
  std::error_code error;
  fs::create_directories(folder / "made", error);
  const fs::path manifest = folder / "manifest.json";
  MadeSoFar made;
  made.lines = LinesBefore(manifest, head, common.force);
  for (const json& line : made.lines) made.minutes += MinutesOf(line);
  const int had = static_cast<int>(made.lines.size());

  Note(common,
       fmt::format("{} captured clips ({:.1f} min to learn from, {:.1f} min held out), {} dropped; "
                   "{} reaches to start from",
                   captures.size(), captured.train_minutes, captured.held_minutes, captured.dropped,
                   captured.reach_sources));
  Progress progress(common, "minutes made");
  if (!MakeUntil(shop, 60.0 * options.hours, manifest, progress, head, made)) return kInterrupted;
  FinishManifest(shop, captured, made, had, manifest, std::move(head));
  return kDone;
}

}  // namespace

void AddMakeReachDataCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MakeReachDataCommand>();
  CLI::App* command = app.add_subcommand(
      "make-reach-data", "Generate walking, turning and reaching with goals from captured clips");
  command
      ->add_option("captures", options->captures,
                   "Folder of captured motion (.bvh .amc .npz, .gz), with an optional index.csv")
      ->required();
  command
      ->add_option("-o,--output", options->output,
                   "Folder to write: captured/, made/, manifest.json; an unfinished one is resumed")
      ->required();
  command->add_option("--hours", options->hours, "Hours of motion to generate")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 200.0));
  command
      ->add_option(
          "--held-out", options->held_out,
          "Subjects, or clips by name (folder_file), kept away from training [the smallest "
          "subjects, a tenth of all]")
      ->delimiter(',');
  command->add_option("--wrist", options->wrist, "Wrist used for reaching")
      ->capture_default_str()
      ->check(CLI::IsMember({"right", "left", "both"}));
  command->add_option("--reaches", options->reaches, "Goals one after the other in a clip")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  command->add_option("--farthest", options->farthest, "Way to a goal, metres")
      ->capture_default_str()
      ->check(CLI::Range(0.5, 20.0));
  command
      ->add_option("--pace", options->pace,
                   "Multiplies the speeds of walking (1.0-1.8 m/s asked for) and playing (1.0-1.35 "
                   "times as captured); 0.8 strolls")
      ->capture_default_str()
      ->check(CLI::Range(0.6, 1.3));
  command->add_option("--blend", options->blend_s, "Length of a transition, seconds")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1.0));
  command->add_flag("--as-captured", options->as_captured,
                    "Leave reaches as they are: goals are where the wrists come to");
  command->add_option("--body", options->body, "SMPL-X .npz [the embedded body]");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast make-reach-data mocap -o reaches --hours 4\n"
                   "  holdfast make-reach-data mocap -o left --hours 0.5 --wrist left --seed 7 "
                   "--held-out cmu_08,cmu_39\n"
                   "made/*.npz are clips with arrays goal (K x 3, world, metres), goal_frame (K) "
                   "and goal_wrist (K):\nthe wrist joint is at the goal in its frame. A goal "
                   "begins where the one before is reached.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
