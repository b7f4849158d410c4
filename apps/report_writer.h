// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "apps/clip_input.h"

namespace holdfast::apps {

struct ReportOptions {
  std::string title;                  ///< empty: made of the names of object and motion
  double contact_threshold_mm = 5.0;  ///< skin closer than this to the object counts as contact
};

struct ReportSize {
  std::size_t bytes = 0;          ///< of the file
  int directions = 0;             ///< of pose correctives, of the clip that needs most
  double surface_error_mm = 0.0;  ///< largest distance of a drawn vertex from the body model's
};

/// Whether this program was built with the player (HOLDFAST_BUILD_PLAYER): without it there are no
/// reports.
bool HasReportPlayer();

/// Writes one self-contained page for the clips: a 3D player, curves per frame and what made them.
/// The first clip is shown, a second one as its ghost; with more, the page has a choice. The same
/// input gives the same bytes. Written atomically. Throws Error without clips or without the
/// player.
ReportSize WriteReport(std::span<const ClipInput> clips, const std::filesystem::path& path,
                       const ReportOptions& options, const CommonOptions& common);

/// For commands that make clips: the same into their result's folder. Without the player there is a
/// note instead of a report.
void WriteReportBeside(std::span<const ClipInput> clips, const std::filesystem::path& path,
                       const CommonOptions& common);

}  // namespace holdfast::apps
