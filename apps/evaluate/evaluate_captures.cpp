// SPDX-License-Identifier: MIT
#include "apps/evaluate/evaluate_captures.h"

#include <cstdlib>
#include <filesystem>

#include <fmt/format.h>

#include "geometry/io/container/atomic_file.h"
#include "geometry/parallel.h"
#include "solver/carry/follow.h"
#include "solver/evaluation/capture_study.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct CapturesCommand {
  CommonOptions common;
  std::string folder, body, table;
  int every = 1;
};

double PartPercent(int part, int whole) { return whole > 0 ? 100.0 * part / whole : 0.0; }

std::string Table(const std::vector<CaptureRow>& rows, const CaptureSums& sums) {
  std::string text;
  for (const CaptureRow& row : rows) {
    if (!row.fault.empty()) text += fmt::format("{}: {}\n", row.name, row.fault);
  }
  if (sums.refined == 0) return text + "no clip was refined\n";
  const CaptureRow &all = sums.all, &depth = rows[*sums.worst_depth],
                   &contact = rows[*sums.worst_contact];
  const auto line = [&](const char* name, double before, double after, const char* unit) {
    text += fmt::format("{:<40s}{:9.1f}{:9.1f}   {}\n", name, before, after, unit);
  };
  text +=
      fmt::format("{} clips refined, {:.1f} minutes, {} frames; in {} of them no finger moves\n",
                  sums.refined, all.seconds / 60.0, all.frames, sums.flat);
  text += fmt::format("{:40s}{:>9s}{:>9s}\n", "", "before", "after");
  line("frames with a finger's jump", all.before.jump_frames, all.after.jump_frames, "");
  line("deeper than 2 mm", PartPercent(all.before.deep_frames, all.frames),
       PartPercent(all.after.deep_frames, all.frames), "% of frames");
  line("deepest", all.before.deepest_mm, all.after.deepest_mm, "mm");
  line("in contact", PartPercent(all.before.hand_frames_in_contact, all.hand_frames),
       PartPercent(all.after.hand_frames_in_contact, all.hand_frames),
       "% of frames in which the object follows the hand");
  const auto tips = [&](const char* name, int FingertipCounts::*count) {
    line(name, PartPercent(all.before.tips.*count, 5 * all.hand_frames),
         PartPercent(all.after.tips.*count, 5 * all.hand_frames), "% of fingertips in these");
  };
  tips("  fingertips touch", &FingertipCounts::touch);
  tips("  fingertips beside it: do not touch", &FingertipCounts::beside);
  tips("  fingertips inside it", &FingertipCounts::inside);
  text += fmt::format(
      "deepest {} {:.1f} mm ({} frames); least contact {} {:.1f} %\n"
      "{} finger rotations replaced; wrists moved {:.1f} mm (root mean square; up to {:.0f}), "
      "objects {:.1f} mm\n"
      "{:.1f} frames a second on one core\n",
      depth.name, depth.after.deepest_mm, depth.after.deep_frames, contact.name,
      100.0 * contact.ContactShare(), all.replaced, all.wrist_rms_mm, all.wrist_max_mm,
      all.object_rms_mm, all.frames / all.core_s);
  return text;
}

nlohmann::json NumbersJson(const CaptureNumbers& numbers) {
  return {{"frames_with_finger_jumps", numbers.jump_frames},
          {"frames_deeper_than_2_mm", numbers.deep_frames},
          {"max_penetration_depth_mm", numbers.deepest_mm},
          {"hand_frames_in_contact", numbers.hand_frames_in_contact},
          {"fingertips_touch", numbers.tips.touch},
          {"fingertips_beside", numbers.tips.beside},
          {"fingertips_inside", numbers.tips.inside}};
}

nlohmann::json RowJson(const CaptureRow& row) {
  return {{"clip", row.name},
          {"fault", row.fault},
          {"frames", row.frames},
          {"fingers_move", row.fingers_move},
          {"finger_rotations_replaced", row.replaced},
          {"hand_frames_followed", row.hand_frames},
          {"before", NumbersJson(row.before)},
          {"after", NumbersJson(row.after)},
          {"wrist_rms_mm", row.wrist_rms_mm},
          {"wrist_max_mm", row.wrist_max_mm},
          {"object_rms_mm", row.object_rms_mm},
          {"core_s", row.core_s}};
}

std::string Csv(const std::vector<CaptureRow>& rows) {
  std::string text = "clip,frames,fingers_move,finger_rotations_replaced,hand_frames_followed";
  for (const char* when : {"before", "after"}) {
    for (const char* what :
         {"frames_with_finger_jumps", "frames_deeper_than_2_mm", "max_penetration_depth_mm",
          "hand_frames_in_contact", "fingertips_touch", "fingertips_beside", "fingertips_inside"}) {
      text += fmt::format(",{}_{}", what, when);
    }
  }
  text += ",wrist_rms_mm,wrist_max_mm,object_rms_mm,fault\n";
  for (const CaptureRow& row : rows) {
    text += fmt::format("{},{},{},{},{}", row.name, row.frames, row.fingers_move ? 1 : 0,
                        row.replaced, row.hand_frames);
    for (const CaptureNumbers* numbers : {&row.before, &row.after}) {
      text += fmt::format(",{},{},{:.2f},{},{},{},{}", numbers->jump_frames, numbers->deep_frames,
                          numbers->deepest_mm, numbers->hand_frames_in_contact, numbers->tips.touch,
                          numbers->tips.beside, numbers->tips.inside);
    }
    text += fmt::format(",{:.2f},{:.1f},{:.2f},\"{}\"\n", row.wrist_rms_mm, row.wrist_max_mm,
                        row.object_rms_mm, row.fault);
  }
  return text;
}

int Run(CapturesCommand options) {
  const CommonOptions& common = options.common;
  if (!options.table.empty()) RequireNew(options.table, common);
  if (options.folder.empty()) {
    const char* const data = std::getenv("HOLDFAST_DATA");
    options.folder = (fs::path(data != nullptr ? data : "../shared/data") / "skillmimic").string();
  }
  const std::vector<ObjectCapture> captures =
      FindCaptures(options.folder, LoadBody(options.body), options.every, NumThreads(common));
  Progress progress(common, "captures");
  std::vector<CaptureRow> rows;
  try {
    rows = StudyCaptures(captures, NumThreads(common), [&](int done, int total) {
      progress.Update(done, total);
      return !Interrupted();
    });
  } catch (const WorkStopped&) {
    return kInterrupted;
  }
  const CaptureSums sums = SumsOf(rows);
  const FollowProtocol follow;
  nlohmann::json json = JsonHead("holdfast/evaluate-captures/1", common);
  json["protocol"] = {{"finger_jump_deg", kFingerJump / kDegree},
                      {"contact_threshold_mm", ContactProtocol().contact_threshold_mm},
                      {"follows_within_m", follow.gap_m},
                      {"follows_slower_than_m_s", follow.speed_m_s},
                      {"speed_window_s", follow.window_s},
                      {"follows_at_least_s", follow.least_s}};
  json["refined"] = sums.refined;
  json["without_moving_fingers"] = sums.flat;
  json["all"] = RowJson(sums.all);
  json["clips"] = nlohmann::json::array();
  for (const CaptureRow& row : rows) json["clips"].push_back(RowJson(row));
  if (!options.table.empty()) WriteAtomically(options.table, Csv(rows));
  PrintResult(common, json, Table(rows, sums));
  return sums.refined == 0 ? kFitFault : kDone;
}

}  // namespace

void AddEvaluateCaptures(CLI::App& evaluate, int& exit_code) {
  auto options = std::make_shared<CapturesCommand>();
  CLI::App* command = evaluate.add_subcommand(
      "captures", "Refine captured clips with their objects: fingers, depth, contact");
  command->add_option("folder", options->folder,
                      "Clips with an object (.pt, .npz, .glb), here and in folders below it "
                      "[HOLDFAST_DATA/skillmimic]");
  command->add_option("--body", options->body, "Body model in place of the embedded one");
  command->add_option("-o,--output", options->table, "A row a clip, to this file (.csv)");
  AddOption(*command, "--every", options->every, "Only every n-th file", CLI::Range(1, 100'000));
  AddCommonOptions(*command, options->common, true,
                   "  holdfast evaluate captures held -o captures.csv\n"
                   "  holdfast evaluate captures held --every 2 --json\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
