// SPDX-License-Identifier: MIT
#include "apps/evaluate/reach_study_output.h"

#include <filesystem>

#include <fmt/format.h>

#include "apps/reach_network.h"
#include "generator/wandr/motion_states.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"

namespace holdfast::apps {

StudyScene::StudyScene(const std::vector<std::string>& starts)
    : body(MeasureBody(*BodyModel::Default(), {})),
      bones(wandr::BoneOffsetsOf(body.rest_joints).Cast<float>()),
      lowest(BodySurface(BodyModel::Default())),
      captured(ReadCapturedClips(starts)) {}

std::vector<wandr::ReachStart> StudyScene::StartsFor(const ReachNetwork& network) const {
  const wandr::Normalizer<double> normalizer(network.weights.statistics);
  return captured.clips.empty() ? wandr::ComposedStarts(body, normalizer)
                                : StartsFrom(captured, normalizer);
}

std::vector<std::string> StudyNotes(const std::string& protocol,
                                    const std::vector<wandr::ReachStart>& starts, bool captured,
                                    const std::string& measures) {
  std::string names;
  for (const wandr::ReachStart& start : starts) {
    names += fmt::format("{}{}", names.empty() ? "" : "; ", start.name);
  }
  return {
      "Protocol of WANDR (Diomataris et al., CVPR 2024): " + protocol,
      captured ? fmt::format("Start poses: held-out captured motion ({}).", names)
               : fmt::format("Start poses: six of Holdfast's own, none captured ({}).", names),
      "SR: the right wrist is within 10 cm of the goal in any frame (at end: in the last). DTG: "
      "its closest approach. FS: share of frames whose lowest vertex of the body's surface moves "
      "horizontally by more than 2/3 cm to the next; by joints: the same of the lowest of ankles "
      "and balls of the feet. " +
          measures};
}

nlohmann::json StudyHead(const std::string& schema, const CommonOptions& common,
                         const ReachNetwork& network, const std::vector<wandr::ReachStart>& starts,
                         bool captured, const StudyText& text) {
  nlohmann::json head = JsonHead(schema, common);
  head["network"] = NetworkJson(network);
  head["starts"] = {{"captured", captured}};
  for (const wandr::ReachStart& start : starts) head["starts"]["poses"].push_back(start.name);
  head["notes"] = text.notes;
  return head;
}

Outcome WriteStudy(StudyOutput output) {
  const std::filesystem::path folder = output.folder;
  WriteWithoutWallTimes(output.results, folder / "results.json", folder / "timing.json");
  WriteAtomically(folder / "results.md", output.table);
  WriteAtomically(folder / "report.html", output.page);
  if (!output.timing_page.empty()) WriteAtomically(folder / "timing.html", output.timing_page);
  Outcome outcome;
  outcome.summary = std::move(output.results);
  outcome.summary["output"] = output.folder;
  outcome.text = fmt::format("{} motions", output.motions);
  if (output.made > 0) {
    outcome.text += fmt::format(", {} of them made in {:.0f} s ({:.1f} ms each)", output.made,
                                output.seconds, 1e3 * output.seconds / output.made);
  }
  outcome.text += fmt::format("; results.json, results.md, report.html in {}\n", output.folder);
  outcome.text += output.text.notes[1] + "\n\n" + output.table + output.times;
  return outcome;
}

}  // namespace holdfast::apps
