// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip_body.h"
#include "geometry/options.h"
#include "geometry/parallel.h"

namespace holdfast {

/// A clip with additional data for a page.
struct ReportInput : ClipScene {
  /// File of the clip; empty for an embedded clip and an imported file.
  std::filesystem::path file;
  /// World, meters: only displayed.
  std::optional<TriangleMesh> marker;
  nlohmann::json metrics;  ///< from metrics.json in the clip's folder; null without one
};

/// Reads the metrics.json that a command wrote next to a clip ("clip.npz"); null if there is none.
/// Throws Error for a file with other content.
nlohmann::json MetricsBeside(const std::filesystem::path& clip);

struct ReportPageOptions {
  std::string title;                  ///< empty: composed of the names of object and motion
  double contact_threshold_mm = 5.0;  ///< skin closer than this to the object is in contact
  std::uint64_t seed = 1;             ///< only displayed, with the version
  int threads = 1;                    ///< does not change the page
};
OptionTable OptionsOf(ReportPageOptions& options);

struct ReportPage {
  std::string html;               ///< empty if stopped by `progress`
  int directions = 0;             ///< number of pose correctives, maximum over clips
  double surface_error_mm = 0.0;  ///< largest distance of a displayed vertex from the body model's
};

/// Whether the library was built with the player (HOLDFAST_BUILD_PLAYER), which pages require.
bool HasReportPlayer();

/// Creates one self-contained page (HTML) for the clips: a 3D player, curves per frame, and
/// provenance. The first clip is displayed, a second one as its ghost; for more clips, the page has
/// a selector. Deterministic. Names and notes are escaped, so that they can neither end their
/// element nor run as code. `progress` receives the stage "report", per clip. Throws Error without
/// clips or without the player.
ReportPage MakeReportPage(std::span<const ReportInput> clips, const ReportPageOptions& options = {},
                          const StagedProgress& progress = {});

/// Escapes text for HTML content and attribute values.
std::string EscapeHtml(std::string_view text);

/// Concatenated named little-endian arrays, for a page that reads them as typed arrays.
class ReportPayload {
 public:
  /// Element types: float, int16, int8, uint32, uint16, uint8. `stride` is the number of values of
  /// one row (a vertex, a frame), for the reader.
  template <typename T>
  void Add(std::string_view name, std::span<const T> values, int stride);
  template <typename T>
  void Add(std::string_view name, const std::vector<T>& values, int stride) {
    Add(name, std::span<const T>(values), stride);
  }

  /// {name: {type, offset, count, stride}}: type as in "f32", offset in bytes.
  const nlohmann::json& Directory() const { return directory_; }

  /// All arrays, deflated (zlib format), as base64.
  std::string Encode() const;

 private:
  nlohmann::json directory_ = nlohmann::json::object();
  std::string bytes_;
};

/// Returns the section of a page in which the contacts of a hand are edited
/// (player/contacts.js), for a page without other data. `payload` has `object_vertices`,
/// `object_faces`, `hand_vertices` (of one frame after the other, object's frame), `hand_faces` and
/// `hand_part`; `header` has `file` (contacts.json), `frames` (those of hand_vertices), `hold`
/// (first and last frame), `parts` (`name`, `on_robot`), `up` (object's frame) and `command`
/// (shown). Throws Error without the player.
std::string ContactEditor(nlohmann::json header, const ReportPayload& payload);

}  // namespace holdfast
