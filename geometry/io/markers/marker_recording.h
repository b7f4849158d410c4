// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

enum class MarkerFormat { kC3d, kTrc, kViconCsv, kQtmTsv };
std::string_view MarkerFormatName(MarkerFormat format);

/// Labelled markers of one capture. Axes are the file's: which way is up is not part of most.
struct MarkerRecording {
  MarkerFormat format = MarkerFormat::kC3d;
  std::vector<std::string> names;     ///< as in the file, without the subject
  std::vector<std::string> subjects;  ///< of each marker ("P1" of "P1:RSHO"); empty without one
  Eigen::MatrixXd positions;  ///< (3 M x T) metres; NaN in all three where a marker is not seen
  double rate_hz = 0.0;
  int first_frame = 1;            ///< the file's number of the first column
  std::string unit;               ///< as the file writes it
  double metres_per_unit = 1e-3;  ///< that positions were multiplied by

  int NumMarkers() const { return static_cast<int>(names.size()); }
  int NumFrames() const { return static_cast<int>(positions.cols()); }
  Eigen::Vector3d At(int marker, int frame) const {
    return positions.block<3, 1>(3 * marker, frame);
  }
  bool Seen(int marker, int frame) const {
    return positions(3 * marker, frame) == positions(3 * marker, frame);
  }
  /// Place of a name in `names`, any case; nothing where there is none.
  std::optional<int> Find(std::string_view name) const;
};

/// By the file's first bytes, unpacked where it is gzip'd; nothing for anything else.
std::optional<MarkerFormat> MarkerFormatOf(std::string_view head);

/// Reads a recording of any of the formats, gzip'd or not, whatever it is called. Throws Error that
/// names file, and line or field, for a file that is none of them, is cut off, has a number that is
/// none, a rate or a scale that cannot be, or two markers of one name.
MarkerRecording ReadMarkers(const std::filesystem::path& path);
/// The same of a file's content; `where` names it in messages.
MarkerRecording ParseMarkers(std::string_view content, const std::string& where);

/// "mm", "m", "cm" and words for them as metres per unit; nothing for any other word.
std::optional<double> MetresPerUnit(std::string_view unit);

/// Puts "P1:RSHO" into subjects and names. Throws Error, named `where`, for equal names.
void SetMarkerNames(const std::vector<std::string>& labels, const std::string& where,
                    MarkerRecording& recording);

}  // namespace holdfast
