// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <span>

#include "apps/common.h"
#include "geometry/report/report_page.h"

namespace holdfast::apps {

/// Writes the clips' page (MakeReportPage) atomically; nothing after Ctrl-C.
ReportPage WriteReport(std::span<const ReportInput> clips, const std::filesystem::path& path,
                       ReportPageOptions options, const CommonOptions& common);

/// For commands that make clips: the same into their result's folder. Without the player there is a
/// note instead of a report, as there is after Ctrl-C: what was made until then is kept.
void WriteReportBeside(std::span<const ReportInput> clips, const std::filesystem::path& path,
                       const CommonOptions& common);

}  // namespace holdfast::apps
