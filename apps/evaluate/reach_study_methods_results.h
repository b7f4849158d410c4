// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/evaluate/reach_study_page.h"
#include "solver/evaluation/captured_reaches.h"
#include "solver/evaluation/reach_method_study.h"

namespace holdfast::apps {

/// One method on some cases of the protocol.
struct MethodRun {
  ReachMethod method;
  std::vector<MethodMotion> motions;
  MethodSummary summary;
  StudyRun plain;  ///< protocol, cases, and what all studies say of the motions
};

/// Share of motions within 10 cm at any time of the motion that a method had after so many
/// iterations, or seconds of one core: a motion that stopped keeps its last iterate.
struct SuccessCurve {
  std::vector<double> x, success;
};
SuccessCurve SuccessByIteration(const MethodRun& run);
SuccessCurve SuccessBySeconds(const MethodRun& run);

/// What the paper reports of its methods.
struct PaperRow {
  const char* label;
  double success, skating, distance_m;
};
std::span<const PaperRow> PaperRows();

/// Captured clips as a row: all of them, and those that walk. None without clips.
struct CapturedGroup {
  const char* key;    ///< "all" or "walking"
  std::string label;  ///< for people
  MethodSummary summary;
};
std::vector<CapturedGroup> GroupsOf(const std::vector<CapturedMotion>& captured);

/// All of it as numbers: {"methods": [...], "captured": {...}, "paper": [...]}.
nlohmann::json MethodsJson(const std::vector<MethodRun>& runs,
                           const std::vector<CapturedMotion>& captured);

/// The table, in Markdown, with the paper's rows and that of captured clips.
std::string MethodsTable(const std::vector<MethodRun>& runs,
                         const std::vector<CapturedMotion>& captured);
/// A line per method, for the terminal: wall time of one core per motion.
std::string MethodsTimes(const std::vector<MethodRun>& runs);
/// One page without scripts: success by seconds of one core per motion.
std::string MethodsTimingPage(const std::vector<MethodRun>& runs);
/// One page without scripts: the table, success by iterations, by tolerance, and by place of the
/// goal.
std::string MethodsPage(const StudyText& text, const std::vector<MethodRun>& runs,
                        const std::vector<CapturedMotion>& captured);

}  // namespace holdfast::apps
