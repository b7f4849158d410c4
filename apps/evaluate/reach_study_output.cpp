// SPDX-License-Identifier: MIT
#include "apps/evaluate/reach_study_output.h"

#include <filesystem>

#include <fmt/format.h>

#include "apps/motion/reach_network.h"
#include "geometry/io/container/atomic_file.h"

namespace holdfast::apps {

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

FitOutcome WriteStudy(StudyOutput output) {
  const std::filesystem::path folder = output.folder;
  WriteAtomically(folder / "results.json", output.results.dump(1) + "\n");
  WriteAtomically(folder / "results.md", output.table);
  WriteAtomically(folder / "report.html", output.page);
  FitOutcome outcome;
  outcome.summary = std::move(output.results);
  outcome.summary["output"] = output.folder;
  outcome.text = fmt::format("{} motions", output.motions);
  if (output.made > 0) {
    outcome.text += fmt::format(", {} of them made in {:.0f} s ({:.1f} ms each)", output.made,
                                output.seconds, 1e3 * output.seconds / output.made);
  }
  outcome.text += fmt::format("; results.json, results.md, report.html in {}\n", output.folder);
  outcome.text += output.text.notes[1] + "\n\n" + output.table;
  return outcome;
}

}  // namespace holdfast::apps
