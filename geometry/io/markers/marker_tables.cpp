// SPDX-License-Identifier: MIT
#include "geometry/io/markers/marker_tables.h"

#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/container/text_scanner.h"

namespace holdfast {
namespace {

std::string_view Trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \r") - begin + 1);
}

// Reads lines of fields and tracks the line number.
class Table {
 public:
  Table(std::string_view text, char separator, const std::string& where)
      : text_(text), separator_(separator), where_(where) {}

  // Reads the fields of the next line; false at the end of the text.
  bool Next(std::vector<std::string_view>& fields) {
    fields.clear();
    if (text_.empty()) return false;
    ++line_;
    const std::size_t end = text_.find('\n');
    cut_off_ = end == std::string_view::npos;
    std::string_view line = text_.substr(0, end);
    text_ = end == std::string_view::npos ? std::string_view() : text_.substr(end + 1);
    while (true) {
      const std::size_t cut = line.find(separator_);
      fields.push_back(Trimmed(line.substr(0, cut)));
      if (cut == std::string_view::npos) break;
      line = line.substr(cut + 1);
    }
    return true;
  }
  std::vector<std::string_view> Need(const char* what) {
    std::vector<std::string_view> fields;
    if (!Next(fields)) Fail(fmt::format("ends before its {}", what));
    return fields;
  }
  [[noreturn]] void Fail(const std::string& problem) const {
    throw Error(fmt::format("{}:{}", where_, line_), problem,
                "Export it again from the capture software");
  }
  double Number(std::string_view field, const char* what) {
    double value = 0.0;
    if (!ParseNumber(field, value) && !ParseDecimalComma(field, value)) value = kNoNumber;
    if (!std::isfinite(value))
      Fail(fmt::format("'{}' is not a valid {}", field.substr(0, 40), what));
    return value;
  }
  void Note(const std::string& note, MarkerRecording& recording) const {
    recording.notes.push_back(fmt::format("{}: {}", where_, note));
  }
  bool HasDecimalCommas() const { return decimal_commas_; }
  // Whether the last line that was read has no line end.
  bool CutOff() const { return cut_off_; }

 private:
  static constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

  // Parses "12,5", where commas do not separate fields.
  bool ParseDecimalComma(std::string_view field, double& value) {
    const std::size_t comma = field.find(',');
    if (comma == std::string_view::npos || field.find_first_of(",.", comma + 1) != field.npos) {
      return false;
    }
    std::string with_point(field);
    with_point[comma] = '.';
    if (!ParseNumber(with_point, value)) return false;
    decimal_commas_ = true;
    return true;
  }

  std::string_view text_;
  char separator_;
  const std::string& where_;
  bool cut_off_ = false, decimal_commas_ = false;
  int line_ = 0;
};

void CheckRate(const Table& table, double rate) {
  if (!(rate > 0.0) || rate >= 1e5)
    table.Fail(fmt::format("a rate of {} Hz is not possible", rate));
}

void SetUnit(const Table& table, std::string_view word, MarkerRecording& recording) {
  recording.unit = AsUtf8(word);
  const std::optional<LengthUnit> unit = FindLengthUnit(word);
  if (!unit) table.Fail(fmt::format("'{}' is not a known unit of length", word));
  if (unit->cut_off) {
    table.Note(fmt::format("the unit '{}' is cut off; read as {}", word, unit->name), recording);
  }
  recording.meters_per_unit = unit->meters;
}

// Names that head three columns each; a marker without a name is called by its number.
std::vector<std::string> NamesOverThree(const Table& table,
                                        const std::vector<std::string_view>& fields,
                                        std::size_t first, MarkerRecording& recording) {
  std::vector<std::string> names;
  std::vector<std::size_t> nameless;
  for (std::size_t k = first; k < fields.size(); ++k) {
    if (fields[k].empty()) continue;
    if ((k - first) % 3 != 0) {
      table.Fail(
          fmt::format("the name '{}' is not above the first of three columns", AsUtf8(fields[k])));
    }
    for (std::size_t m = names.size(); m < (k - first) / 3; ++m) {
      names.push_back(fmt::format("point {}", m + 1));
      nameless.push_back(m + 1);
    }
    names.emplace_back(fields[k]);
  }
  if (!nameless.empty()) {
    table.Note(fmt::format("columns without a name; their markers are named by number: {}",
                           fmt::join(nameless, ", ")),
               recording);
  }
  return names;
}

// Reads lines of `first` fields that are not positions, then three per marker. Programs write
// nothing, NaN or zeros for a marker that is not seen. Positions beyond the names are ignored.
void ReadPositions(Table& table, std::size_t first, MarkerRecording& recording) {
  const auto markers = static_cast<std::size_t>(recording.NumMarkers());
  const std::size_t width = first + 3 * markers;
  if (markers == 0) table.Fail("names no markers");
  std::vector<double> values;
  std::vector<std::string_view> fields;
  int frames = 0, longer = 0;
  bool trims = false;
  while (table.Next(fields)) {
    while (fields.size() > width && fields.back().empty()) fields.pop_back();
    if (fields.size() == 1 && fields.front().empty()) continue;
    // Programs omit the separators of unseen markers at the end of a line.
    if (fields.size() > first && fields.size() < width && fields.size() % 3 == first % 3) {
      if (table.CutOff() && !trims) table.Fail("ends in the middle of a line");
      trims = true;
      fields.resize(width);
    }
    if (fields.size() > width && (fields.size() - width) % 3 == 0) {
      ++longer;
      fields.resize(width);
    }
    if (fields.size() != width) {
      table.Fail(
          fmt::format("{} fields, {} are expected: {} markers", fields.size(), width, markers));
    }
    if (frames == 0 && first > 0) {
      recording.first_frame = static_cast<int>(table.Number(fields.front(), "frame number"));
    }
    for (std::size_t m = 0; m < markers; ++m) {
      Eigen::Vector3d point;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::string_view field = fields[first + 3 * m + c];
        const bool unseen = field.empty() || EqualIgnoringCase(field, "nan");
        point[c] = unseen ? std::numeric_limits<double>::quiet_NaN()
                          : recording.meters_per_unit * table.Number(field, "coordinate");
      }
      if (point.hasNaN() || point.isZero(0.0)) {
        point.setConstant(std::numeric_limits<double>::quiet_NaN());
      }
      values.insert(values.end(), point.begin(), point.end());
    }
    ++frames;
  }
  if (frames == 0) table.Fail("has no frames");
  if (longer > 0) {
    table.Note(
        fmt::format("{} of {} rows have positions of markers without a name, which are ignored",
                    longer, frames),
        recording);
  }
  if (table.HasDecimalCommas()) table.Note("numbers have decimal commas", recording);
  recording.positions = Eigen::Map<const Eigen::MatrixXd>(
      values.data(), static_cast<Eigen::Index>(3 * markers), frames);
}

// Returns the first of `candidates` that a line (from 0) contains: files saved by a spreadsheet
// program have other separators than the format states.
char SeparatorOf(std::string_view text, int line, std::string_view candidates) {
  for (; line > 0 && !text.empty(); --line) {
    const std::size_t end = text.find('\n');
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
  }
  text = text.substr(0, text.find('\n'));
  for (const char separator : candidates) {
    if (text.find(separator) != std::string_view::npos) return separator;
  }
  return candidates.front();
}
}  // namespace

MarkerRecording ParseTrc(std::string_view text, const std::string& where) {
  const char separator = SeparatorOf(text, 1, "\t;,");
  Table table(text, separator, where);
  table.Need("head");
  const std::vector<std::string_view> keys = table.Need("head");
  const std::vector<std::string_view> values = table.Need("head");
  std::map<std::string, std::string_view> head;
  for (std::size_t k = 0; k < std::min(keys.size(), values.size()); ++k) {
    head[std::string(keys[k])] = values[k];
  }
  MarkerRecording recording;
  if (separator != '\t') {
    table.Note(fmt::format("fields are separated by '{}', not by tabs", separator), recording);
  }
  for (const char* key : {"DataRate", "Units"}) {
    if (!head.contains(key)) table.Fail(fmt::format("the header has no {}", key));
  }
  recording.rate_hz = table.Number(head["DataRate"], "rate (DataRate)");
  CheckRate(table, recording.rate_hz);
  SetUnit(table, head["Units"], recording);
  SetMarkerNames(NamesOverThree(table, table.Need("marker names"), 2, recording), where, recording);
  table.Need("axes");
  ReadPositions(table, 2, recording);
  // The rows decide how many markers there are.
  if (const auto told = head.find("NumMarkers");
      told != head.end() && told->second != std::to_string(recording.NumMarkers())) {
    table.Note(
        fmt::format("NumMarkers is {}, {} are named", AsUtf8(told->second), recording.NumMarkers()),
        recording);
  }
  return recording;
}

MarkerRecording ParseViconCsv(std::string_view text, const std::string& where) {
  const char separator = SeparatorOf(text, 2, ",;\t");
  Table table(text, separator, where);
  table.Need("head");
  MarkerRecording recording;
  recording.rate_hz = table.Number(table.Need("rate").front(), "rate");
  CheckRate(table, recording.rate_hz);
  SetMarkerNames(NamesOverThree(table, table.Need("marker names"), 2, recording), where, recording);
  table.Need("axes");
  const std::vector<std::string_view> units = table.Need("units");
  SetUnit(table, units.size() > 2 ? units[2] : "", recording);
  ReadPositions(table, 2, recording);
  return recording;
}

MarkerRecording ParseQtmTsv(std::string_view text, const std::string& where) {
  Table table(text, '\t', where);
  MarkerRecording recording;
  SetUnit(table, "mm", recording);
  std::vector<std::string> names;
  std::optional<double> markers;
  // The head ends where a line begins with a number, or with the names of columns.
  Table look(text, '\t', where);
  std::vector<std::string_view> fields;
  std::size_t before = 0;
  double number = 0.0;
  while (look.Next(fields) && !ParseNumber(fields.front(), number)) {
    table.Need("head");
    if (fields.front() == "FREQUENCY" && fields.size() > 1) {
      recording.rate_hz = table.Number(fields[1], "rate (FREQUENCY)");
    } else if (fields.front() == "NO_OF_MARKERS" && fields.size() > 1) {
      markers = table.Number(fields[1], "number of markers");
    } else if (fields.front() == "MARKER_NAMES") {
      for (std::size_t k = 1; k < fields.size(); ++k) {
        if (!fields[k].empty()) names.emplace_back(fields[k]);
      }
    } else if (EqualIgnoringCase(fields.front(), "Frame")) {
      before = fields.size() > 1 && EqualIgnoringCase(fields[1], "Time") ? 2 : 1;
    }
  }
  CheckRate(table, recording.rate_hz);
  if (markers && *markers != static_cast<double>(names.size())) {
    table.Fail(
        fmt::format("MARKER_NAMES has {} names, NO_OF_MARKERS is {}", names.size(), *markers));
  }
  SetMarkerNames(names, where, recording);
  ReadPositions(table, before, recording);
  return recording;
}

}  // namespace holdfast
