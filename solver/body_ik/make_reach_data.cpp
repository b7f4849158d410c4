// SPDX-License-Identifier: MIT
#include "solver/body_ik/make_reach_data.h"

#include <algorithm>
#include <array>
#include <mutex>
#include <set>

#include <fmt/format.h>

#include "generator/body/pose_builder.h"
#include "generator/matching/capture_set.h"
#include "geometry/io/container/json_file.h"
#include "geometry/parallel.h"
#include "geometry/seed.h"
#include "solver/body_ik/reach_clip.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kMaxAtOnce = 32;  // clips between manifest updates
constexpr int kMaxTries = 6;    // tries per requested clip before giving up

// Data shared by all clips.
struct ReachWorkshop {
  const CaptureSet& set;
  const ReachDataOptions& options;
  const fs::path& folder;
  ReachClipOptions making;
  JointPose hands = JointPose::Zero();
};

json QualityJson(const MotionQuality& quality) {
  return {{"frames", quality.frames},
          {"skate_ratio", quality.skate_ratio},
          {"lowest_sole_m", quality.lowest_sole_m},
          {"still_sole_m", quality.still_sole_m},
          {"airborne_ratio", quality.airborne_ratio},
          {"mean_acceleration_m_s2", quality.mean_acceleration},
          {"p99_acceleration_m_s2", quality.p99_acceleration},
          {"max_acceleration_m_s2", quality.max_acceleration},
          {"beyond_limits_ratio", quality.beyond_limits_ratio}};
}

json StatisticsJson(const MotionStatistics& statistics) {
  const auto shares = [](const auto& counts) {
    double total = 0.0;
    for (const long count : counts) total += static_cast<double>(count);
    json list = json::array();
    for (const long count : counts) {
      list.push_back(total > 0.0 ? static_cast<double>(count) / total : 0.0);
    }
    return list;
  };
  const double frames = static_cast<double>(std::max(1L, statistics.frames));
  return {{"minutes", static_cast<double>(statistics.frames) / MotionLibrary::kFrameRate / 60.0},
          {"skate_ratio", statistics.skating_frames / frames},
          {"pelvis_speed_shares_per_0.1_m_s", shares(statistics.pelvis_speed)},
          {"acceleration_shares_at_1_2_4_8_16_32_64_128_m_s2", shares(statistics.acceleration)}};
}

json CapturesJson(const std::vector<Capture>& captures) {
  json list = json::array();
  for (const Capture& capture : captures) {
    json entry = {{"file", capture.file},
                  {"subject", capture.subject},
                  {"category", capture.category},
                  {"split", capture.held_out ? "held_out" : "train"},
                  {"quality", QualityJson(capture.quality)}};
    if (!capture.fault.empty()) entry["dropped"] = capture.fault;
    list.push_back(std::move(entry));
  }
  return list;
}

json SourceJson(const LibraryClip& clip) {
  return clip.mirrored ? json(clip.name + "~mirrored") : json(clip.name);
}

json Provenance(const ReachWorkshop& shop, const ReachClip& made, std::uint64_t seed) {
  json segments = json::array(), reaches = json::array();
  for (const MotionSegment& segment : made.segments) {
    segments.push_back({{"frame", segment.begin},
                        {"source", SourceJson(shop.set.library.Clips()[segment.clip])},
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
                       {"source", SourceJson(shop.set.library.Clips()[label.source])}});
  }
  return {{"made_by", "holdfast make-reach-data " + shop.options.version},
          {"seed", seed},
          {"transitions_blended_s", shop.making.synthesis.blend_s},
          {"segments", segments},
          {"reaches", reaches}};
}

void WriteReachClip(const ReachWorkshop& shop, const ReachClip& made, const json& provenance,
                    const fs::path& path) {
  Clip clip =
      ToClip(made.frames, MotionLibrary::kFrameRate, shop.set.library.RestJoints(), shop.hands);
  clip.body_model = shop.set.body_model;
  clip.action = "reach";
  WriteGoalClip(std::move(clip), made.labels, provenance, path);
}

// Generates a clip, writes it unless it has a fault, and returns its manifest line.
json MakeReachLine(const ReachWorkshop& shop, int index) {
  const std::uint64_t seed = MixSeed(shop.options.seed, static_cast<std::uint64_t>(index));
  ReachClipOptions making = shop.making;
  if (shop.options.wrists == ReachWrists::kBoth && index % 2 == 1)
    making.synthesis.wrist = Side::kLeft;
  const ReachClip made = MakeReachClip(shop.set.library, making, seed);
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
  const std::string file = fmt::format("made/reach_{:05d}.npz", index);
  line["file"] = file;
  line["wrist"] = SideName(making.synthesis.wrist);
  line["reaches"] = provenance["reaches"];
  line["statistics"] = {{"skating_frames", made.statistics.skating_frames},
                        {"pelvis_speed", made.statistics.pelvis_speed},
                        {"acceleration", made.statistics.acceleration}};
  std::set<std::string> sources;
  for (const json& segment : provenance["segments"]) sources.insert(segment["source"]);
  line["sources"] = sources;
  WriteReachClip(shop, made, provenance, shop.folder / file);
  return line;
}

json HeadOf(const ReachWorkshop& shop) {
  constexpr std::array<const char*, 3> kWrists = {"right", "left", "both"};
  const ReachDataOptions& options = shop.options;
  return {{"schema", "holdfast/reach-data/1"},
          {"holdfast_version", options.version},
          {"seed", options.seed},
          {"options",
           {{"captures", shop.set.name},
            {"hours", options.hours},
            {"reaches", options.reaches},
            {"farthest_m", options.farthest_m},
            {"pace", options.pace},
            {"blend_s", options.blend_s},
            {"wrist", kWrists.at(static_cast<std::size_t>(options.wrists))},
            {"as_captured", options.as_captured}}},
          {"body", shop.set.body_model},
          {"captures", CapturesJson(shop.set.captures)}};
}

void SetMaking(ReachWorkshop& shop) {
  MatchedReachOptions& synthesis = shop.making.synthesis;
  synthesis.reaches = shop.options.reaches;
  synthesis.farthest_goal = shop.options.farthest_m;
  synthesis.pace = shop.options.pace;
  synthesis.blend_s = shop.options.blend_s;
  synthesis.wrist = shop.options.wrists == ReachWrists::kLeft ? Side::kLeft : Side::kRight;
  shop.making.warp.joint_limits = shop.set.joint_limits;
  shop.making.carry_to_goals = !shop.options.as_captured;
  for (const Side side : {Side::kLeft, Side::kRight}) {
    shop.hands.middleCols<kJointsPerHand>(HandBegin(side)) =
        RelaxedFingers(shop.set.library.RestJoints(), side).reshaped(3, kJointsPerHand);
  }
}

// Sums over the lines of accepted clips.
struct ReachSums {
  MotionStatistics statistics = {};
  double minutes = 0.0;
  int kept = 0, goals = 0, carried = 0;

  void Add(const json& line) {
    if (!line.contains("file")) return;
    ++kept;
    minutes += line.at("frames").get<double>() / MotionLibrary::kFrameRate / 60.0;
    const json& sums = line.at("statistics");
    statistics.Add({line.at("frames").get<long>(), sums.at("skating_frames").get<double>(),
                    sums.at("pelvis_speed").get<SpeedHistogram>(),
                    sums.at("acceleration").get<AccelerationHistogram>()});
    for (const json& reach : line.at("reaches")) {
      ++goals;
      carried += reach.at("how").get<std::string>() == "carried" ? 1 : 0;
    }
  }
};

// Generates the next clips in parallel and removes those beyond the requested minutes. Returns
// false, without adding any, if `go_on` returns false.
template <typename GoOn>
bool MakeBatch(const ReachWorkshop& shop, double wanted, const GoOn& go_on, ReachSums& made,
               ManifestLines& lines) {
  const int begin = static_cast<int>(lines.size());
  // About half a minute each; independent of the number of threads, for equal results.
  const int count = std::clamp(static_cast<int>(2.0 * (wanted - made.minutes)) + 1, 1, kMaxAtOnce);
  std::vector<json> batch(static_cast<std::size_t>(count));
  std::mutex lock;
  bool stopped = false;
  const auto stops = [&] {
    const std::scoped_lock guard(lock);
    return stopped = stopped || !go_on();
  };
  ParallelFor(count, shop.options.threads, [&](int k) {
    if (!stops()) batch[k] = MakeReachLine(shop, begin + k);
  });
  if (stops()) return false;
  std::error_code error;
  for (int k = 0; k < count; ++k) {
    json& line = batch[k];
    if (made.minutes >= wanted) {
      fs::remove(shop.folder / line.value("file", "made/none"), error);
      continue;
    }
    made.Add(line);
    lines.emplace(begin + k, std::move(line));
  }
  return true;
}

}  // namespace

ReachDataReport MakeReachData(const CaptureSet& set, const ReachDataOptions& options,
                              const fs::path& folder, const StagedProgress& progress) {
  ReachWorkshop shop{set, options, folder, {}};
  SetMaking(shop);
  ReachDataReport report;
  report.head = HeadOf(shop);
  std::error_code error;
  fs::create_directories(folder / "made", error);
  const fs::path manifest = folder / "manifest.json";
  ManifestLines lines =
      LinesBefore(manifest, report.head, "make-reach-data", "captures", options.replace);
  ReachSums made;
  UseJson(manifest, [&] {  // checked now, not after hours of work
    for (const auto& [index, line] : lines) made.Add(line);
  });
  report.had = static_cast<int>(lines.size());
  const double wanted = 60.0 * options.hours;
  const int most = std::max(200, static_cast<int>(kMaxTries * wanted / 0.3));
  const int total = static_cast<int>(wanted + 0.5);
  const auto tell = [&](int done) {
    return !progress || progress("minutes generated", done, total);
  };
  while (made.minutes < wanted && static_cast<int>(lines.size()) < most) {
    const auto go_on = [&] {
      return tell(std::clamp(total - 1, 0, static_cast<int>(made.minutes)));
    };
    if (!MakeBatch(shop, wanted, go_on, made, lines)) return report;
    report.head["complete"] = made.minutes >= wanted;
    WriteManifest(manifest, report.head, lines);
    if (!tell(static_cast<int>(std::min(made.minutes, wanted)))) return report;
  }
  report.stopped = false;
  report.minutes = made.minutes;
  report.tried = static_cast<int>(lines.size());
  if (made.minutes < wanted) return report;
  report.head["complete"] = true;
  report.head["statistics"] = {{"captured_train", StatisticsJson(set.train)},
                               {"captured_held_out", StatisticsJson(set.held_out)},
                               {"made", StatisticsJson(made.statistics)}};
  report.head["summary"] = {{"hours", made.minutes / 60.0},
                            {"clips", made.kept},
                            {"clips_dropped", report.tried - made.kept},
                            {"goals", made.goals},
                            {"goals_carried", made.carried},
                            {"captured_train_minutes", set.train_minutes},
                            {"captured_held_out_minutes", set.held_out_minutes},
                            {"captured_dropped", set.dropped}};
  WriteManifest(manifest, report.head, lines);
  return report;
}

}  // namespace holdfast
