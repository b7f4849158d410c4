// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// Labeled markers of one capture. Axes are the file's: most formats do not state which is up.
struct MarkerRecording {
  std::string format = "C3D";         ///< or "TRC", "Vicon CSV", "Qualisys TSV"
  std::vector<std::string> names;     ///< as in the file, without the subject
  std::vector<std::string> subjects;  ///< of each marker ("P1" of "P1:RSHO"); empty without one
  Eigen::MatrixXd positions;  ///< (3 M x T) meters; all three are NaN if a marker is not seen
  double rate_hz = 0.0;
  int first_frame = 1;             ///< number of the first frame in the file
  std::string unit;                ///< as written in the file
  double meters_per_unit = 1e-3;   ///< factor applied to the positions
  std::vector<std::string> notes;  ///< faults that did not prevent reading

  int NumMarkers() const { return static_cast<int>(names.size()); }
  int NumFrames() const { return static_cast<int>(positions.cols()); }
  Eigen::Vector3d At(int marker, int frame) const {
    return positions.block<3, 1>(3 * marker, frame);
  }
  bool Seen(int marker, int frame) const {
    return positions(3 * marker, frame) == positions(3 * marker, frame);
  }
  /// Index of a name in `names`, ignoring case; nullopt if there is none.
  std::optional<int> Find(std::string_view name) const;
};

/// Detects the format by a file's first bytes, unpacked if gzipped; empty if it is none of them.
std::string_view MarkerFormatOf(std::string_view head);

/// Reads a recording of any of the formats, gzipped or not, whatever its name. Throws Error naming
/// file, and line or field, for a file that is none of them, is truncated, has an invalid number,
/// or an impossible rate or scale. `notes` lists contradictions in the file that are read as other
/// programs read them (equal names, a truncated unit, columns without a name).
MarkerRecording ReadMarkers(const std::filesystem::path& path);
/// Same for the content of a file; `where` names it in messages.
MarkerRecording ParseMarkers(std::string_view content, const std::string& where);

/// A unit of length as written in files: "mm", "m", "cm", "in" and words for them, which may be
/// truncated after three letters.
struct LengthUnit {
  std::string_view name;
  double meters = 1.0;
  bool cut_off = false;
};
/// Returns nullopt for any other word.
std::optional<LengthUnit> FindLengthUnit(std::string_view unit);

/// Splits "P1:RSHO" into subjects and names. Labels that are not UTF-8 are read as Latin-1, the
/// second of two equal ones becomes "RSHO_2", and so on; `notes`, named `where`, report both.
void SetMarkerNames(const std::vector<std::string>& labels, const std::string& where,
                    MarkerRecording& recording);

}  // namespace holdfast
