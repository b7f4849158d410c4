// SPDX-License-Identifier: MIT
#include "geometry/io/mesh/mesh_scan.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/mesh/mesh_parts.h"
#include "geometry/mesh/mesh_topology.h"

namespace holdfast {
namespace {

constexpr std::string_view kBlank = " \t\r\v\f";
constexpr std::size_t kShownWord = 32;
constexpr std::size_t kStlHeader = 84;
constexpr std::size_t kStlTriangle = 50;

bool IsBlank(char c) { return kBlank.find(c) != std::string_view::npos; }

/// Iterates over the lines of a text, and over the words of a line.
class Lines {
 public:
  Lines(std::string_view text, const std::string& name) : rest_(text), name_(name) {}

  bool Next() {
    if (rest_.empty()) return false;
    const std::size_t end = rest_.find('\n');
    line_ = rest_.substr(0, end);
    rest_ = end == std::string_view::npos ? std::string_view() : rest_.substr(end + 1);
    ++number_;
    return true;
  }

  std::string_view Word() {
    while (!line_.empty() && IsBlank(line_.front())) line_.remove_prefix(1);
    std::size_t end = 0;
    while (end < line_.size() && !IsBlank(line_[end])) ++end;
    const std::string_view word = line_.substr(0, end);
    line_.remove_prefix(end);
    return word;
  }

  /// Next word on any line, skipping comments; empty at the end.
  std::string_view WordAcrossLines() {
    for (;;) {
      const std::string_view word = Word();
      if (!word.empty() && word.front() != '#') return word;
      if (!Next()) return {};  // also skips the rest of a comment
    }
  }

  double Coordinate(std::string_view word) const {
    if (word.empty()) Fail("a coordinate is missing", kTruncated);
    double value = 0.0;
    const std::string_view digits = word.front() == '+' ? word.substr(1) : word;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc::result_out_of_range && end == digits.data() + digits.size()) {
      // from_chars leaves underflow (1e-400) to the caller: it is zero here.
      if (digits.find("e-") != std::string_view::npos ||
          digits.find("E-") != std::string_view::npos) {
        return 0.0;
      }
    } else if (error != std::errc() || end != digits.data() + digits.size()) {
      Fail(fmt::format("'{}' is not a number", Excerpt(word, kShownWord)),
           "Check the file, or export it again");
    }
    // Meshes are written in single precision, which limits the range.
    if (!std::isfinite(static_cast<float>(value)) || error != std::errc()) {
      Fail(fmt::format("the coordinate '{}' is not finite", Excerpt(word, kShownWord)),
           "Remove the vertex, or export the mesh again");
    }
    return value;
  }

  bool Integer(std::string_view word, long long& value) const {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size() && !word.empty();
  }

  [[noreturn]] void Fail(const std::string& problem, const std::string& remedy) const {
    throw Error(fmt::format("{}:{}", name_, number_), problem, remedy);
  }

  std::string_view Rest() const { return rest_; }

 private:
  std::string_view line_;
  std::string_view rest_;
  std::string name_;
  int number_ = 0;
};

[[noreturn]] void NoElements(const std::string& name, const char* what) {
  throw Error(name, fmt::format("has no {}", what),
              "Give a surface: vertices, and faces that join them");
}

void RequireSurface(const MeshScan& scan, const std::string& name) {
  if (scan.positions.empty()) NoElements(name, "vertices");
  if (scan.polygon_begin.size() < 2) NoElements(name, "faces");
}

void AddPolygonId(MeshScan& scan, long long id, std::size_t num_vertices, const Lines& lines) {
  if (id < 0 || id >= static_cast<long long>(num_vertices)) {
    lines.Fail(fmt::format("a face refers to vertex {} of {} (counted from 0)", id, num_vertices),
               "Check the file, or export it again");
  }
  scan.polygon_ids.push_back(static_cast<int>(id));
}

void EndPolygon(MeshScan& scan, const Lines& lines) {
  if (scan.polygon_ids.size() - scan.polygon_begin.back() < 3) {
    lines.Fail("a face has fewer than three corners", "Remove it, or export the mesh again");
  }
  scan.polygon_begin.push_back(static_cast<int>(scan.polygon_ids.size()));
}

/// Checks a count from a header: an element takes at least `least_bytes`.
std::size_t Count(long long count, std::size_t least_bytes, std::size_t bytes_left,
                  std::string_view what, const std::string& where) {
  if (count < 0) {
    throw Error(where, fmt::format("its header gives {} as the number of {}", count, what),
                "Check the file");
  }
  if (static_cast<std::size_t>(count) > bytes_left / least_bytes) {
    throw Error(where,
                fmt::format("its header promises {} {}, more than its {} bytes can hold", count,
                            what, bytes_left),
                kTruncated);
  }
  return static_cast<std::size_t>(count);
}

/// Removes repeated corners of the last polygon, and drops it if fewer than three are left.
/// `last_seen_in` holds the polygon in which each vertex was last seen.
void EndObjPolygon(MeshScan& scan, std::vector<int>& last_seen_in, const Lines& lines) {
  const int begin = scan.polygon_begin.back();
  if (scan.polygon_ids.size() - begin < 3) EndPolygon(scan, lines);  // reports it
  const int polygon = static_cast<int>(scan.polygon_begin.size() + scan.num_left_out);
  const auto is_repeated = [&](int id) {
    return std::exchange(last_seen_in[id], polygon) == polygon;
  };
  const auto first = scan.polygon_ids.begin() + begin;
  scan.polygon_ids.erase(std::remove_if(first, scan.polygon_ids.end(), is_repeated),
                         scan.polygon_ids.end());
  if (scan.polygon_ids.size() - begin < 3) {
    scan.polygon_ids.resize(begin);
    ++scan.num_left_out;
  } else {
    EndPolygon(scan, lines);
  }
}

/// Adds separate triangles, nine numbers each: corners at the same position become one vertex.
void WeldTriangles(const std::vector<float>& numbers, MeshScan& scan) {
  const Eigen::Matrix3Xd corners =
      Eigen::Map<const Eigen::Matrix3Xf>(numbers.data(), 3,
                                         static_cast<Eigen::Index>(numbers.size() / 3))
          .cast<double>();
  const std::vector<int> first = FirstAtSamePlace(corners);
  std::vector<int> vertex(first.size());
  for (int c = 0; c < corners.cols(); ++c) {
    if (first[c] == c) {
      vertex[c] = static_cast<int>(scan.positions.size());
      scan.positions.emplace_back(corners.col(c));
    }
    vertex[c] = vertex[first[c]];
    if (c % 3 < 2) continue;
    if (HasRepeatedCorner({vertex[c - 2], vertex[c - 1], vertex[c]})) {
      ++scan.num_left_out;
      continue;
    }
    scan.polygon_ids.insert(scan.polygon_ids.end(), {vertex[c - 2], vertex[c - 1], vertex[c]});
    scan.polygon_begin.push_back(static_cast<int>(scan.polygon_ids.size()));
  }
}

}  // namespace

std::string PlainLines(std::string_view bytes, bool continued) {
  if (bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);
  std::string text;
  text.reserve(bytes.size() + 1);
  std::size_t swallowed = 0;
  bool joins = false;
  while (!bytes.empty()) {
    const std::size_t end = std::min(bytes.find_first_of("\r\n"), bytes.size());
    const std::string_view line = bytes.substr(0, end);
    const bool both = bytes.substr(end, 2) == "\r\n";
    bytes.remove_prefix(std::min(end + (both ? 2 : 1), bytes.size()));
    const std::size_t first = line.find_first_not_of(kBlank);
    const std::size_t last = line.find_last_not_of(kBlank);
    const bool is_comment = !joins && first != line.npos && line[first] == '#';
    joins = continued && !is_comment && last != line.npos && line[last] == '\\';
    text += joins ? line.substr(0, last) : line;
    text += joins ? ' ' : '\n';
    if (joins) {
      ++swallowed;
    } else {
      text.append(std::exchange(swallowed, 0), '\n');
    }
  }
  return text;
}

MeshScan ScanObj(std::string_view bytes, const std::string& name) {
  const std::string plain = PlainLines(bytes, true);
  bytes = plain;
  // Faces are read in a pass of their own: they may name vertices that come later.
  MeshScan scan;
  std::size_t num_vertices = 0;
  std::size_t num_faces = 0;
  for (Lines ahead(bytes, name); ahead.Next();) {
    const std::string_view word = ahead.Word();
    num_vertices += word == "v";
    num_faces += word == "f";
  }
  if (num_vertices == 0 && num_faces == 0) {
    throw Error(name, "does not look like an .obj file: it has neither 'v' nor 'f' lines",
                "Check its content, and give it the extension of its format");
  }
  scan.positions.reserve(num_vertices);
  scan.polygon_begin.reserve(num_faces + 1);
  scan.polygon_ids.reserve(3 * num_faces);
  Lines lines(bytes, name);
  while (lines.Next()) {
    const std::string_view word = lines.Word();
    if (word != "v") continue;
    Eigen::Vector3d p;
    for (int k = 0; k < 3; ++k) p[k] = lines.Coordinate(lines.Word());
    scan.positions.push_back(p);
  }
  std::size_t seen = 0;
  std::vector<int> last_seen_in(scan.positions.size(), 0);
  Lines again(bytes, name);
  while (again.Next()) {
    const std::string_view keyword = again.Word();
    if (keyword == "v") ++seen;
    if (keyword != "f") continue;
    for (std::string_view word = again.Word(); !word.empty() && word[0] != '#';
         word = again.Word()) {
      long long id = 0;
      const std::string_view vertex = word.substr(0, word.find('/'));
      if (!again.Integer(vertex, id) || word.find_first_not_of("0123456789/-") != word.npos) {
        again.Fail(fmt::format("'{}' is not a corner of a face", Excerpt(word, kShownWord)),
                   "Check the file, or export it again");
      }
      // Ids count from 1; negative ids count backward from the last vertex so far.
      if (id == 0)
        again.Fail("a face refers to vertex 0, but .obj counts from 1", "Check the exporter");
      AddPolygonId(scan, id > 0 ? id - 1 : static_cast<long long>(seen) + id, scan.positions.size(),
                   again);
    }
    EndObjPolygon(scan, last_seen_in, again);
  }
  if (scan.num_left_out == 0) RequireSurface(scan, name);
  return scan;
}

MeshScan ScanOff(std::string_view bytes, const std::string& name) {
  const std::string plain = PlainLines(bytes, false);
  MeshScan scan;
  Lines lines(plain, name);
  std::string_view magic = lines.WordAcrossLines();
  // ModelNet's files have the number of vertices in the same word.
  std::string_view first = magic.substr(std::min(magic.find_first_of("0123456789"), magic.size()));
  magic.remove_suffix(first.size());
  if (magic != "OFF" && magic != "COFF" && magic != "NOFF" && magic != "CNOFF" &&
      magic != "STOFF") {
    lines.Fail("does not start with OFF", "Check that it is an .off file");
  }
  if (first.empty()) first = lines.WordAcrossLines();
  if (first == "BINARY" || first == "binary") {
    throw Error(name, "is a binary .off file", "Convert it to .ply or to text");
  }
  long long num_vertices = 0;
  long long num_faces = 0;
  long long num_edges = 0;
  if (!lines.Integer(first, num_vertices) || !lines.Integer(lines.WordAcrossLines(), num_faces) ||
      !lines.Integer(lines.WordAcrossLines(), num_edges)) {
    lines.Fail("the numbers of vertices, faces and edges are missing", kTruncated);
  }
  // "0 0 0\n" is the shortest vertex; "3 0 0 0\n" the shortest face.
  const std::size_t vertices = Count(num_vertices, 6, bytes.size(), "vertices", name);
  const std::size_t faces = Count(num_faces, 7, bytes.size(), "faces", name);
  if (vertices == 0) NoElements(name, "vertices");
  if (faces == 0) NoElements(name, "faces");
  scan.positions.reserve(vertices);
  scan.polygon_begin.reserve(faces + 1);
  scan.polygon_ids.reserve(3 * faces);
  for (std::size_t v = 0; v < vertices; ++v) {
    Eigen::Vector3d p;
    p[0] = lines.Coordinate(lines.WordAcrossLines());
    p[1] = lines.Coordinate(lines.Word());
    p[2] = lines.Coordinate(lines.Word());
    scan.positions.push_back(p);
    while (!lines.Word().empty()) continue;  // colors, normals
  }
  for (std::size_t f = 0; f < faces; ++f) {
    long long corners = 0;
    const std::string_view word = lines.WordAcrossLines();
    if (word.empty()) {
      lines.Fail(fmt::format("ends after {} of {} faces", f, faces), kTruncated);
    }
    if (!lines.Integer(word, corners) || corners < 3 || corners > num_vertices * 4) {
      lines.Fail(
          fmt::format("'{}' is not the number of corners of a face", Excerpt(word, kShownWord)),
          "Check the file, or export it again");
    }
    for (long long k = 0; k < corners; ++k) {
      long long id = 0;
      const std::string_view corner = lines.Word();
      if (!lines.Integer(corner, id)) {
        lines.Fail(fmt::format("corner {} of a face is missing or not a number", k + 1),
                   kTruncated);
      }
      AddPolygonId(scan, id, vertices, lines);
    }
    EndPolygon(scan, lines);
    while (!lines.Word().empty()) continue;  // colors
  }
  return scan;
}

MeshScan ScanStl(std::string_view bytes, const std::string& name) {
  MeshScan scan;
  // Binary files may begin with "solid", too: the size decides.
  std::uint32_t count = 0;
  if (bytes.size() >= kStlHeader) std::memcpy(&count, bytes.data() + 80, sizeof count);
  const std::size_t promised = kStlHeader + std::size_t{count} * kStlTriangle;
  const bool size_fits = bytes.size() >= kStlHeader && bytes.size() >= promised &&
                         (count > 0 || bytes.size() == kStlHeader);
  std::vector<float> corners;
  std::string_view start = bytes;
  if (start.starts_with("\xef\xbb\xbf")) start.remove_prefix(3);
  while (!start.empty() && (IsBlank(start.front()) || start.front() == '\n'))
    start.remove_prefix(1);
  const bool says_solid = start.substr(0, 5) == "solid" || start.substr(0, 5) == "SOLID";
  const bool has_facets = bytes.find("facet") != bytes.npos || bytes.find("FACET") != bytes.npos ||
                          bytes.find("endsolid") != bytes.npos;
  if (!size_fits && says_solid && has_facets) {
    const std::string plain = PlainLines(bytes, false);
    Lines lines(plain, name);
    bool ended = false;
    while (lines.Next()) {
      const std::string_view word = lines.Word();
      ended = ended || EqualIgnoringCase(word, "endsolid");
      if (!EqualIgnoringCase(word, "outer")) continue;
      for (int corner = 0; corner < 3; ++corner) {
        if (!lines.Next() || !EqualIgnoringCase(lines.Word(), "vertex")) {
          lines.Fail("a triangle has fewer than three 'vertex' lines", kTruncated);
        }
        for (int k = 0; k < 3; ++k) {
          corners.push_back(static_cast<float>(lines.Coordinate(lines.Word())));
        }
      }
    }
    if (!ended) lines.Fail("ends without 'endsolid'", kTruncated);
  } else {
    if (!size_fits) {
      throw Error(
          name,
          bytes.size() < kStlHeader
              ? fmt::format("is too short for an .stl file ({} bytes)", bytes.size())
              : fmt::format("its header promises {} triangles ({} bytes), but it has {} bytes",
                            count, promised, bytes.size()),
          kTruncated);
    }
    scan.num_unread = bytes.size() - promised;
    corners.resize(9 * std::size_t{count});
    for (std::size_t t = 0; t < count; ++t) {
      std::memcpy(&corners[9 * t], bytes.data() + kStlHeader + t * kStlTriangle + 12, 36);
      for (std::size_t i = 9 * t; i < 9 * t + 9; ++i) {
        if (!std::isfinite(corners[i])) {
          throw Error(name, fmt::format("triangle {} has a coordinate that is not finite", t),
                      "Remove the triangle, or export the mesh again");
        }
      }
    }
  }
  if (corners.empty()) NoElements(name, "faces");
  WeldTriangles(corners, scan);
  return scan;
}

}  // namespace holdfast
