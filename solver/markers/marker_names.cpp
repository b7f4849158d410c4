// SPDX-License-Identifier: MIT
#include "solver/markers/marker_names.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/suggestion.h"

namespace holdfast {
namespace {

constexpr auto kSkin = MarkerTie::kSkin;
constexpr auto kLandmark = MarkerTie::kLandmark;
constexpr auto kCluster = MarkerTie::kCluster;

// A row for the right side or the middle; millimeters. In the T-pose of SMPL-X the right arm points
// to -x, up is y, forward z, thumbs forward, palms down.
struct Row {
  const char* name;  // without the side
  int joint, toward;
  double fraction, x, y, z;
  MarkerTie tie;
  double sigma;
};

constexpr int kEnd = -1;
constexpr int kIndex1 = kRightHandBegin, kIndex3 = kRightHandBegin + 2,
              kMiddle1 = kRightHandBegin + 3, kThumb3 = kRightHandBegin + 14;

// Freitas and Scholz (2009), as in sets of daily tasks: plates of four markers, 1 to 4.
constexpr Row kPlates[] = {
    {"SHO", kRightCollar, kRightShoulder, 0.9, 0, 45, -20, kCluster, 40},
    {"UAR", kRightShoulder, kRightElbow, 0.5, 0, 55, 0, kCluster, 45},
    {"LAR", kRightElbow, kRightWrist, 0.65, 0, 40, 0, kCluster, 40},
    {"HAN", kRightWrist, kMiddle1, 0.6, 0, 28, 0, kCluster, 25},
};

constexpr Row kSides[] = {
    // The same set, beside its plates.
    {"FTP", kIndex3, kEnd, 0.75, 0, 12, 0, kLandmark, 6},
    {"FB", kRightWrist, kIndex1, 1.0, 0, 20, 0, kLandmark, 10},
    {"THUM", kThumb3, kEnd, 0.7, 0, 8, 8, kLandmark, 8},
    {"GTH", kRightCollar, kRightShoulder, 1.0, -15, 40, 0, kLandmark, 20},
    {"LEP", kRightShoulder, kRightElbow, 1.0, 0, 39, 0, kLandmark, 8},
    {"MEP", kRightShoulder, kRightElbow, 1.0, 0, -39, 0, kLandmark, 8},
    {"SPR", kRightElbow, kRightWrist, 1.0, 0, 4, 27, kLandmark, 7},
    {"SPU", kRightElbow, kRightWrist, 1.0, 0, 4, -27, kLandmark, 7},
    // Plug-in Gait.
    {"SHO", kRightCollar, kRightShoulder, 0.85, 0, 40, 0, kSkin, 20},
    {"UPA", kRightShoulder, kRightElbow, 0.5, 0, 40, 15, kSkin, 45},
    {"ELB", kRightShoulder, kRightElbow, 1.0, 0, 30, -25, kSkin, 35},
    {"FRM", kRightElbow, kRightWrist, 0.5, 0, 40, 0, kSkin, 35},
    {"WRA", kRightElbow, kRightWrist, 1.0, 0, 0, 32, kSkin, 12},
    {"WRB", kRightElbow, kRightWrist, 1.0, 0, 0, -32, kSkin, 12},
    {"FIN", kRightWrist, kMiddle1, 1.0, 0, 20, 0, kSkin, 12},
    {"FHD", kHead, kHead, 0.0, -48, 107, 72, kSkin, 30},
    {"BHD", kHead, kHead, 0.0, -43, 109, -62, kSkin, 30},
    {"ASI", kPelvis, kPelvis, 0.0, -102, 34, 80, kSkin, 25},
    {"PSI", kPelvis, kPelvis, 0.0, -50, 40, -98, kSkin, 25},
    {"THI", kRightHip, kRightKnee, 0.55, -80, 0, 0, kSkin, 45},
    {"KNE", kRightHip, kRightKnee, 1.0, -55, 0, 0, kSkin, 15},
    {"TIB", kRightKnee, kRightAnkle, 0.5, -60, 0, 0, kSkin, 45},
    {"ANK", kRightKnee, kRightAnkle, 1.0, -45, -10, 0, kSkin, 12},
    {"HEE", kRightAnkle, kRightAnkle, 0.0, 0, -24, -66, kSkin, 15},
    {"TOE", kRightAnkle, kRightFoot, 1.2, 8, 30, 0, kSkin, 25},
    {"MT5", kRightAnkle, kRightFoot, 0.8, -40, -8, 0, kSkin, 20},
    // Extensions of Plug-in Gait: CMU's Vicon set, CGM2.
    {"MT1", kRightAnkle, kRightFoot, 0.95, 40, 5, 0, kSkin, 20},
    {"THMB", kThumb3, kEnd, 0.5, 0, 8, 8, kLandmark, 15},
    {"KNM", kRightHip, kRightKnee, 1.0, 50, 0, 0, kSkin, 15},
    {"MED", kRightKnee, kRightAnkle, 1.0, 40, 5, 5, kSkin, 12},
    {"THAP", kRightHip, kRightKnee, 0.4, 0, 0, 70, kSkin, 45},
    {"THAD", kRightHip, kRightKnee, 0.75, 0, 0, 70, kSkin, 45},
    {"TIAP", kRightKnee, kRightAnkle, 0.3, 0, 0, 50, kSkin, 45},
    {"TIAD", kRightKnee, kRightAnkle, 0.7, 0, 0, 50, kSkin, 45},
};

// Aliases, after the side: CMU (front and back of the waist, shin), CGM2 (metatarsal heads), and
// longer names.
constexpr std::pair<const char*, const char*> kSideAliases[] = {
    {"FWT", "ASI"},  {"BWT", "PSI"},  {"SHN", "TIB"}, {"ASIS", "ASI"},
    {"PSIS", "PSI"}, {"SMH", "TOE"},  {"VMH", "MT5"}, {"FMH", "MT1"},
    {"THM", "THMB"}, {"MKNE", "KNM"}, {"MANK", "MED"}};

constexpr Row kMiddleRows[] = {
    {"STRN", kSpine3, kSpine3, 0.0, 0, 20, 150, kSkin, 50},
    {"CLAV", kSpine3, kNeck, 0.75, 0, 0, 100, kSkin, 20},
    {"C7", kSpine3, kNeck, 0.95, 0, 0, -80, kSkin, 20},
    {"T10", kSpine2, kSpine3, 0.3, 0, 0, -120, kSkin, 35},
    {"SACR", kPelvis, kPelvis, 0.0, 0, 60, -120, kSkin, 25},
    {"RBAK", kSpine3, kSpine3, 0.0, -80, 60, -100, kSkin, 50},
    {"RBAC", kSpine3, kSpine3, 0.0, -80, 60, -100, kSkin, 50},
    {"ARIEL", kHead, kHead, 0.0, 0, 180, 10, kSkin, 30},
    // A glove: three markers on a plate, two per finger, and a triangle on the back.
    {"hand_top", kRightWrist, kMiddle1, 0.6, 0, 30, 0, kCluster, 25},
    {"hand_left", kRightWrist, kMiddle1, 0.5, 0, 30, 15, kCluster, 25},
    {"hand_right", kRightWrist, kMiddle1, 0.5, 0, 30, -15, kCluster, 25},
    {"index_tip", kIndex3, kEnd, 0.7, 0, 12, 0, kLandmark, 7},
    {"index_middle", kIndex1 + 1, kIndex3, 0.5, 0, 14, 0, kLandmark, 12},
    {"middle_tip", kIndex3 + 3, kEnd, 0.7, 0, 12, 0, kLandmark, 7},
    {"middle_middle", kIndex1 + 4, kIndex3 + 3, 0.5, 0, 14, 0, kLandmark, 12},
    {"little_tip", kIndex3 + 6, kEnd, 0.7, 0, 12, 0, kLandmark, 7},
    {"little_middle", kIndex1 + 7, kIndex3 + 6, 0.5, 0, 14, 0, kLandmark, 12},
    {"ring_tip", kIndex3 + 9, kEnd, 0.7, 0, 12, 0, kLandmark, 7},
    {"ring_middle", kIndex1 + 10, kIndex3 + 9, 0.5, 0, 14, 0, kLandmark, 12},
    {"thumb_tip", kThumb3, kEnd, 0.7, 0, 8, 8, kLandmark, 8},
    {"thumb_middle", kThumb3 - 1, kThumb3, 0.5, 0, 10, 8, kLandmark, 12},
    {"right_elbow", kRightShoulder, kRightElbow, 1.0, 0, 40, 0, kLandmark, 20},
    {"right_shoulder", kRightCollar, kRightShoulder, 0.9, 0, 50, 0, kLandmark, 20},
    {"back_top", kSpine3, kNeck, 0.3, 0, 0, -130, kCluster, 60},
    {"back_left", kSpine3, kSpine3, 0.0, 60, 0, -130, kCluster, 60},
    {"back_right", kSpine3, kSpine3, 0.0, -60, 0, -130, kCluster, 60},
};

MarkerSite SiteOf(const Row& row, std::string name, bool left) {
  MarkerSite site;
  site.name = std::move(name);
  site.joint = left ? MirrorJoint(row.joint) : row.joint;
  site.toward = row.toward < 0 ? -1 : left ? MirrorJoint(row.toward) : row.toward;
  site.fraction = row.fraction;
  site.outward = 1e-3 * Eigen::Vector3d(left ? -row.x : row.x, row.y, row.z);
  site.tie = row.tie;
  site.sigma_m = 1e-3 * row.sigma;
  return site;
}

std::string Lower(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

std::vector<std::string> CellsOf(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else if (c != '\r' && (c != ' ' || !fields.back().empty())) {
      fields.back() += c;
    }
  }
  return fields;
}

// Normalizes a name: "Right_Elb.1" and "RELB1" are equal.
std::string Plain(std::string_view name) {
  std::string plain = Lower(name);
  std::erase_if(plain, [](char c) { return c == '_' || c == '-' || c == '.' || c == ' '; });
  if (plain.starts_with("right")) plain.erase(1, 4);
  if (plain.starts_with("left")) plain.erase(1, 3);
  return plain;
}

// Column indices of a table, from its header.
struct Columns {
  int name = -1, joint = -1, vertex = -1, cluster = -1;
};

Columns ColumnsOf(const std::vector<std::string>& head, const std::string& where) {
  Columns columns;
  for (std::size_t k = 0; k < head.size(); ++k) {
    const std::string word = Lower(head[k]);
    const int column = static_cast<int>(k);
    if (word == "name") columns.name = column;
    if (word == "joint") columns.joint = column;
    if (word == "vertex") columns.vertex = column;
    if (word == "cluster") columns.cluster = column;
  }
  if (columns.name < 0 || (columns.joint < 0 && columns.vertex < 0)) {
    throw Error(where, "its first line does not name the columns",
                "Write name,joint,vertex,cluster there (joint or vertex may be left out)");
  }
  return columns;
}

MarkerSite SiteOfFields(const Columns& columns, const std::vector<std::string>& fields,
                        const std::string& where, const std::vector<int>& joint_of_vertex) {
  const auto field = [&](int column) {
    return column >= 0 && column < static_cast<int>(fields.size()) ? fields[column] : "";
  };
  MarkerSite site;
  site.name = field(columns.name);
  const std::string joint = field(columns.joint), vertex = field(columns.vertex);
  if (site.name.empty() || (joint.empty() && vertex.empty())) {
    throw Error(where, "has no name, or neither joint nor vertex", "Fill them in");
  }
  if (!vertex.empty()) {
    const auto [end, fault] =
        std::from_chars(vertex.data(), vertex.data() + vertex.size(), site.vertex);
    if (fault != std::errc() || end != vertex.data() + vertex.size() || site.vertex < 0 ||
        site.vertex >= static_cast<int>(joint_of_vertex.size())) {
      throw Error(where, fmt::format("'{}' is not a vertex of the body", vertex),
                  fmt::format("Give a number from 0 to {}", joint_of_vertex.size() - 1));
    }
    site.joint = joint_of_vertex[site.vertex];
    site.tie = kSkin;
    site.sigma_m = 0.01;
  }
  if (!joint.empty()) {
    const std::optional<int> found = FindJoint(joint);
    if (!found) {
      throw Error(where, fmt::format("'{}' is not a joint", joint),
                  Suggestion(joint, {kJointNames.begin(), kJointNames.end()}) +
                      "Use the joint names of SMPL-X");
    }
    site.joint = *found;
  }
  if (!field(columns.cluster).empty()) site.tie = kCluster;
  if (site.vertex < 0) site.sigma_m = 0.06;
  return site;
}

}  // namespace

std::string_view MarkerTieName(MarkerTie tie) {
  return tie == kSkin ? "skin" : tie == kLandmark ? "landmark" : "cluster";
}

const MarkerTable& MarkerTable::Known() {
  static const MarkerTable table = [] {
    MarkerTable known;
    const auto add_both = [&](const Row& row, const std::string& name) {
      known.Add(SiteOf(row, "R" + name, false));
      known.Add(SiteOf(row, "L" + name, true));
    };
    for (const Row& row : kPlates) {
      for (const char number : {'1', '2', '3', '4'}) add_both(row, std::string(row.name) + number);
    }
    for (const Row& row : kSides) add_both(row, row.name);
    for (const auto& [alias, name] : kSideAliases) {
      for (const char* const side : {"R", "L"}) {
        MarkerSite site = *known.Find(std::string(side) + name);
        site.name = std::string(side) + alias;
        known.Add(std::move(site));
      }
    }
    for (const Row& row : kMiddleRows) known.Add(SiteOf(row, row.name, false));
    return known;
  }();
  return table;
}

MarkerTable MarkerTable::Read(const std::filesystem::path& path,
                              const std::vector<int>& joint_of_vertex) {
  std::ifstream in(path);
  if (!in) throw Error(path.string(), "cannot be read", "Check the path");
  MarkerTable table;
  std::optional<Columns> columns;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    const std::string where = fmt::format("{}:{}", path.string(), ++number);
    if (line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    const std::vector<std::string> fields = CellsOf(line);
    if (fields.size() == 1 && fields[0].empty()) continue;
    if (!columns) {
      columns = ColumnsOf(fields, where);
      continue;
    }
    MarkerSite site = SiteOfFields(*columns, fields, where, joint_of_vertex);
    if (table.Find(site.name)) {
      throw Error(where, fmt::format("'{}' is listed twice", site.name), "Delete one");
    }
    table.Add(std::move(site));
  }
  if (table.sites_.empty()) {
    throw Error(path.string(), "lists no markers",
                "Write name,joint,vertex,cluster, then one row per marker");
  }
  return table;
}

MarkerTable MarkerTable::With(const MarkerTable& other) const {
  MarkerTable both = other;
  for (const MarkerSite& site : sites_) {
    if (other.Find(site.name) == nullptr) both.Add(site);
  }
  return both;
}

const MarkerSite* MarkerTable::Find(std::string_view name) const {
  const std::string wanted = Lower(name);
  const auto found = std::ranges::find_if(
      sites_, [&](const MarkerSite& site) { return Lower(site.name) == wanted; });
  return found == sites_.end() ? nullptr : &*found;
}

std::pair<const MarkerSite*, int> MarkerTable::Nearest(std::string_view name) const {
  const std::string wanted = Plain(name);
  const auto letters = [&](const MarkerSite& site) {
    return EditDistance(wanted, Plain(site.name));
  };
  const auto nearest = std::ranges::min_element(sites_, {}, letters);
  return {&*nearest, letters(*nearest)};
}

}  // namespace holdfast
