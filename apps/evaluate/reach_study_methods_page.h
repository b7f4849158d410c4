// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "apps/evaluate/reach_study_methods_results.h"
#include "apps/evaluate/reach_study_page.h"

namespace holdfast::apps {

/// The table, in Markdown, with the paper's rows and that of captured clips.
std::string MethodsTable(const std::vector<MethodRun>& runs,
                         const std::vector<CapturedMotion>& captured);
/// One page without scripts: the table, success by iterations and by seconds, by tolerance, and by
/// place of the goal.
std::string MethodsPage(const StudyText& text, const std::vector<MethodRun>& runs,
                        const std::vector<CapturedMotion>& captured);

}  // namespace holdfast::apps
