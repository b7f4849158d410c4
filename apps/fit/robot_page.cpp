// SPDX-License-Identifier: MIT
#include "apps/fit/robot_page.h"

#include <array>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/charts.h"
#include "apps/page.h"

namespace holdfast::apps {
namespace {

constexpr std::array<const char*, 6> kJointColours = {"#3b82c4", "#d4743a", "#4c9f70",
                                                      "#a55ec0", "#c2a83e", "#888888"};

std::string NumbersTable(const RobotMeasures& measures) {
  const auto frames = static_cast<double>(measures.frames.size());
  return HtmlTable(
      {"", ""}, {{"contacts kept (within 5 mm of the object)", Percent(measures.kept_ratio, 0)},
                 {"from the human's places, mean", fmt::format("{:.2f} mm", measures.contact_mm)},
                 {"within 5 mm of them", Percent(measures.touching_ratio, 0)},
                 {"normals, mean angle", fmt::format("{:.1f}°", measures.angle_deg)},
                 {"deepest of the clip", fmt::format("{:.2f} mm", measures.deepest_mm)},
                 {"frames deeper than 2 mm", Percent(measures.frames_deeper_than_2_mm / frames)},
                 {"links in each other, deepest", fmt::format("{:.2f} mm", measures.self_mm)}});
}

std::string FramesChart(const RobotMeasures& measures) {
  LineChart chart{"Distance and depth", "frame", "mm", false, {}};
  ChartLine distance{"contact distance, mean", "#3b82c4", {}, {}, {}};
  ChartLine depth{"deepest", "#c0392b", {}, {}, {}};
  for (std::size_t t = 0; t < measures.frames.size(); ++t) {
    const RobotFrameMeasure& frame = measures.frames[t];
    const auto x = static_cast<double>(t);
    depth.points.emplace_back(x, frame.Deepest_mm());
    if (frame.contacts.empty()) continue;
    distance.points.emplace_back(x, frame.ContactDistance_mm());
  }
  chart.lines = {distance, depth};
  return DrawLineChart(chart);
}

// A chart for each finger; followers go with their leaders.
std::string JointCharts(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses) {
  std::map<std::string, LineChart> charts;
  const auto add = [&](const std::string& title, const std::vector<int>& links) {
    for (const int link : links) {
      const RobotLink& moved = setup.robot.links[static_cast<std::size_t>(link)];
      if (moved.dof < 0) continue;
      const RobotDof& dof = setup.robot.dofs[static_cast<std::size_t>(moved.dof)];
      if (dof.name != moved.joint) continue;  // a follower
      LineChart& chart = charts[title];
      chart.title = title;
      chart.x_label = "frame";
      chart.y_label = "share of its range";
      ChartLine line{
          dof.name, kJointColours[chart.lines.size() % kJointColours.size()], {}, {}, {}};
      for (std::size_t t = 0; t < poses.size(); ++t) {
        line.points.emplace_back(static_cast<double>(t),
                                 (poses[t].q(moved.dof) - dof.low) / (dof.high - dof.low));
      }
      chart.lines.push_back(std::move(line));
    }
  };
  for (const RobotFinger& finger : setup.anatomy.fingers) {
    for (const std::vector<int>& links : finger.links) {
      add(kFingerNames[static_cast<std::size_t>(finger.human)], links);
    }
  }
  std::string html;
  for (const auto& [title, chart] : charts) html += DrawLineChart(chart);
  return html;
}

std::string PartsTable(const RobotTransferSetup& setup) {
  std::map<std::string, std::vector<std::string>> parts;
  for (const PartLink& row : PartLinksOf(setup.robot, setup.anatomy)) {
    parts[row.part].push_back(row.link);
  }
  std::vector<std::vector<std::string>> rows;
  for (const auto& [part, links] : parts) {
    rows.push_back({part, fmt::format("{}", fmt::join(links, ", "))});
  }
  return HtmlTable({"part of the hand", "links"}, rows);
}

}  // namespace

std::string RobotPage(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                      const RobotMeasures& measures, const std::string& sheet) {
  const std::string title = fmt::format("{}: {} frames", setup.robot.name, poses.size());
  std::string html = PageHead(title, title,
                              std::string(kTableStyle) + kChartStyle +
                                  "td, th { padding: .2rem .6rem; text-align: left; }"
                                  "img { max-width: 100%; }");
  html += NumbersTable(measures) + FramesChart(measures);
  html +=
      fmt::format("<h2>Robot and human hand</h2>\n<img src=\"{}\" alt=\"Frames of the hold\">\n",
                  EscapeHtml(sheet));
  html += "<h2>Joints</h2>\n" + JointCharts(setup, poses);
  html += "<h2>Which link is what</h2>\n" + PartsTable(setup);
  if (!setup.robot.notes.empty()) {
    html += "<h2>Notes</h2>\n<ul>";
    for (const std::string& note : setup.robot.notes) html += "<li>" + EscapeHtml(note) + "</li>";
    html += "</ul>\n";
  }
  return html + "</body></html>\n";
}

}  // namespace holdfast::apps
