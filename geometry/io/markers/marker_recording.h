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

/// Labeled markers of one capture. Axes are the file's: which way is up is not part of most.
struct MarkerRecording {
  MarkerFormat format = MarkerFormat::kC3d;
  std::vector<std::string> names;     ///< as in the file, without the subject
  std::vector<std::string> subjects;  ///< of each marker ("P1" of "P1:RSHO"); empty without one
  Eigen::MatrixXd positions;  ///< (3 M x T) meters; NaN in all three where a marker is not seen
  double rate_hz = 0.0;
  int first_frame = 1;             ///< the file's number of the first column
  std::string unit;                ///< as the file writes it
  double meters_per_unit = 1e-3;   ///< that positions were multiplied by
  std::vector<std::string> notes;  ///< faults of the file that it was read in spite of

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
/// none, a rate or a scale that cannot be. What a file contradicts itself in and is read all the
/// same as other programs read it (equal names, a cut off unit, columns without a name), is in
/// `notes`.
MarkerRecording ReadMarkers(const std::filesystem::path& path);
/// The same of a file's content; `where` names it in messages.
MarkerRecording ParseMarkers(std::string_view content, const std::string& where);

/// A unit of length as files write it: "mm", "m", "cm", "in" and words for them, which may be cut
/// off after three letters.
struct LengthUnit {
  std::string_view name;
  double meters = 1.0;
  bool cut_off = false;
};
/// Nothing for any other word.
std::optional<LengthUnit> FindLengthUnit(std::string_view unit);

/// Puts "P1:RSHO" into subjects and names. Labels that are not UTF-8 are read as Latin-1, the
/// second of two equal ones becomes "RSHO_2", and so on; `notes`, named `where`, tell of both.
void SetMarkerNames(const std::vector<std::string>& labels, const std::string& where,
                    MarkerRecording& recording);

}  // namespace holdfast
