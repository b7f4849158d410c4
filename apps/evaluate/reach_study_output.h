// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "apps/evaluate/reach_study_page.h"
#include "apps/fit/fit_job.h"
#include "solver/evaluation/reach_study.h"

namespace holdfast::apps {

/// The beginning of a study's results: network, starts and notes.
nlohmann::json StudyHead(const std::string& schema, const CommonOptions& common,
                         const ReachNetwork& network, const std::vector<wandr::ReachStart>& starts,
                         bool captured, const StudyText& text);

/// What a study came to.
struct StudyOutput {
  std::string folder;
  StudyText text;
  nlohmann::json results;
  std::string table, page;  ///< Markdown, HTML
  int motions = 0;
  int made = 0;  ///< of them, by this run
  double seconds = 0.0;
};

/// Writes results.json, results.md and report.html.
FitOutcome WriteStudy(StudyOutput output);

}  // namespace holdfast::apps
