// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "apps/common.h"
#include "apps/evaluate/reach_study_page.h"
#include "solver/evaluation/reach_study.h"

namespace holdfast::apps {

/// What any study needs besides a network: the embedded body, and captured clips to start from.
struct StudyScene {
  /// `starts` as ReadCapturedClips takes them; none: six composed poses.
  explicit StudyScene(const std::vector<std::string>& starts);
  std::vector<wandr::ReachStart> StartsFor(const ReachNetwork& network) const;

  BodyMeasures body;
  wandr::BoneOffsets<float> bones;
  wandr::LowestPoint lowest;
  CapturedClips captured;
};

/// What a reader must know of any study: the protocol, where motions start, and what is measured.
std::vector<std::string> StudyNotes(const std::string& protocol,
                                    const std::vector<wandr::ReachStart>& starts, bool captured,
                                    const std::string& measures);

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
  std::string times = {};        ///< for the terminal: differs from run to run
  std::string timing_page = {};  ///< HTML; empty: none
};

/// Writes results.json, results.md and report.html, which have the same bytes in every run; wall
/// times go to timing.json, and to timing.html where there is a page of them.
Outcome WriteStudy(StudyOutput output);

}  // namespace holdfast::apps
