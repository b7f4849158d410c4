// SPDX-License-Identifier: MIT
#include "apps/evaluate/reach_study_page.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <fmt/format.h>

#include "apps/evaluate/reach_study_charts.h"
#include "apps/report/report_page.h"

namespace holdfast::apps {
namespace {

int IndexOn(const wandr::ReachCase& c, GridAxis axis) {
  switch (axis) {
    case GridAxis::kAngle:
      return c.angle;
    case GridAxis::kHeight:
      return c.height;
    case GridAxis::kDistance:
      return c.distance;
    case GridAxis::kStart:
      return c.start;
  }
  return 0;
}

std::string OrDash(const std::optional<double>& value, double factor, const char* unit) {
  return value ? fmt::format("{:.{}f} {}", factor * *value,
                             factor == 100.0 && unit[0] == 'c' ? 1 : 0, unit)
               : "-";
}

struct PageRow {
  std::vector<std::string> cells;
};

const std::vector<std::string> kStudyHeads = {
    "intention", "SR",         "SR at end", "DTG mean",     "DTG median",
    "FS",        "FS, joints", "airborne",  "pelvis, peak", "acceleration",
    "paper: SR", "paper: DTG", "paper: FS"};

PageRow RowOf(const StudyRun& run) {
  const StudySummary& s = run.summary;
  std::string label = run.variant->label;
  if (!run.how.empty()) label += fmt::format(" ({})", run.how);
  return {{label, Percent(s.reach.success), Percent(s.reach.success_at_end),
           fmt::format("{:.1f} cm", 100.0 * s.reach.distance_mean_m),
           fmt::format("{:.1f} cm", 100.0 * s.reach.distance_median_m), Percent(s.surface_skating),
           Percent(s.reach.skating), Percent(s.reach.airborne),
           fmt::format("{:.2f} m/s", s.reach.peak_pelvis_median_m_s),
           fmt::format("{:.2f} m/s2", s.reach.acceleration_m_s2),
           OrDash(run.variant->paper_success, 100.0, "%"),
           OrDash(run.variant->paper_distance_m, 100.0, "cm"),
           OrDash(run.variant->paper_skating, 100.0, "%")}};
}

std::string AxisChart(const std::vector<const StudyRun*>& runs, GridAxis axis,
                      const std::string& title) {
  Bars bars;
  bars.title = title;
  for (const StudyRun* run : runs) {
    std::vector<double> values;
    bars.labels.clear();
    for (const AxisValue& value : ByAxis(*run, axis)) {
      bars.labels.push_back(value.label);
      values.push_back(value.success);
    }
    bars.series.emplace_back(run->deadline + " deadline", values);
  }
  return BarChart(bars);
}

// Success at every place of the ground, over heights, starts and samples: ahead is up.
std::string FromAbove(const StudyRun& run) {
  constexpr double kMiddle = 200.0, kRadius = 172.0;
  constexpr double kNearest = 30.0;  // leaves room for the person in the middle
  std::map<std::pair<int, int>, std::pair<int, int>> reached;  // (angle, distance) -> (of, all)
  for (std::size_t i = 0; i < run.cases.size(); ++i) {
    auto& [of, all] = reached[{run.cases[i].angle, run.cases[i].distance}];
    of += run.motions[i].outcome.Reached();
    ++all;
  }
  const wandr::ReachProtocol& p = run.protocol;
  std::string svg = "<figure>" + SvgOpen(400, 400);
  svg += SvgText(8, 16, fmt::format("Success from above, {} deadline, %", run.deadline), "start",
                 "class=\"title\"");
  svg += fmt::format("<path d=\"M{0} {1} l-7 12 h14 z\" class=\"person\"/>", kMiddle, kMiddle - 8);
  for (const auto& [place, counts] : reached) {
    const double share = static_cast<double>(counts.first) / counts.second;
    const double distance = p.num_distances == 1
                                ? 0.5 * (p.min_distance_m + p.max_distance_m)
                                : p.min_distance_m + (p.max_distance_m - p.min_distance_m) *
                                                         place.second / (p.num_distances - 1);
    const double angle = 2.0 * std::numbers::pi * place.first / p.num_angles;
    // Angles go counter-clockwise from ahead, which is up.
    const double r = kNearest + (kRadius - kNearest) * distance / std::max(p.max_distance_m, 1e-6);
    const double x = kMiddle - r * std::sin(angle), y = kMiddle + 8 - r * std::cos(angle);
    svg += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"14\" fill=\"#2f6f9f\" fill-opacity=\"{:.2f}\" "
        "class=\"place\"><title>{:.2f} m, {:.0f} degrees: {}</title></circle>",
        x, y, share, distance, angle * 180.0 / std::numbers::pi, Percent(share));
    svg += SvgText(x, y + 4, fmt::format("{:.0f}", 100.0 * share), "middle",
                   share > 0.55 ? "class=\"light\"" : "");
  }
  return svg + "</svg></figure>\n";
}

std::string ToleranceOf(const std::vector<const StudyRun*>& runs, const std::string& title) {
  std::vector<ShareSeries> series;
  for (const StudyRun* run : runs) {
    series.push_back(WithinTolerance(run->variant->label, run->motions));
  }
  return ToleranceChart(series, title);
}

std::vector<const StudyRun*> Select(const std::vector<StudyRun>& runs, const std::string& variant,
                                    const std::string& deadline) {
  std::vector<const StudyRun*> some;
  for (const StudyRun& run : runs) {
    if ((variant.empty() || run.variant->key == variant) &&
        (deadline.empty() || run.deadline == deadline)) {
      some.push_back(&run);
    }
  }
  return some;
}

std::string CapturedText(const CapturedSkating& captured) {
  if (captured.clips == 0) return "";
  std::string text =
      fmt::format("The same measure on {} held-out captured clips: FS {} (foot joints {})",
                  captured.clips, Percent(captured.surface), Percent(captured.joints));
  if (captured.walking_clips > 0) {
    text += fmt::format("; on the {} that go a metre or more: {} (foot joints {})",
                        captured.walking_clips, Percent(captured.walking_surface),
                        Percent(captured.walking_joints));
  }
  return text + ".";
}

}  // namespace

std::vector<AxisValue> ByAxis(const StudyRun& run, GridAxis axis) {
  const wandr::ReachProtocol& p = run.protocol;
  std::map<int, std::vector<const StudyMotion*>> places;
  std::map<int, const wandr::ReachCase*> example;
  for (std::size_t i = 0; i < run.cases.size(); ++i) {
    places[IndexOn(run.cases[i], axis)].push_back(&run.motions[i]);
    example[IndexOn(run.cases[i], axis)] = &run.cases[i];
  }
  std::vector<AxisValue> values;
  for (const auto& [place, motions] : places) {
    AxisValue value;
    const auto on_range = [&](int count, double low, double high) {
      return count == 1 ? 0.5 * (low + high) : low + (high - low) * place / (count - 1);
    };
    switch (axis) {
      case GridAxis::kAngle:
        value.label = fmt::format("{:.0f}°", 360.0 * place / p.num_angles);
        break;
      case GridAxis::kHeight:
        value.label = fmt::format("{:.2f} m", example[place]->goal.z());
        break;
      case GridAxis::kDistance:
        value.label =
            fmt::format("{:.2f} m", on_range(p.num_distances, p.min_distance_m, p.max_distance_m));
        break;
      case GridAxis::kStart:
        value.label = fmt::format("{}", place + 1);
        break;
    }
    value.motions = static_cast<int>(motions.size());
    for (const StudyMotion* motion : motions) {
      value.success += motion->outcome.Reached() / static_cast<double>(motions.size());
      value.distance_m += motion->outcome.closest_m / static_cast<double>(motions.size());
    }
    values.push_back(value);
  }
  return values;
}

std::string StudyTable(const std::vector<StudyRun>& runs, const CapturedSkating& captured) {
  std::string text;
  for (const char* deadline : {"adaptive", "fixed"}) {
    const auto some = Select(runs, "", deadline);
    if (some.empty()) continue;
    if (!text.empty()) text += "\n";
    text += fmt::format("{} deadline, {} motions each\n\n|", deadline, some[0]->motions.size());
    for (const std::string& head : kStudyHeads) text += fmt::format(" {} |", head);
    text += "\n|";
    for (std::size_t k = 0; k < kStudyHeads.size(); ++k) text += "---|";
    text += "\n";
    for (const StudyRun* run : some) {
      text += "|";
      for (const std::string& cell : RowOf(*run).cells) text += fmt::format(" {} |", cell);
      text += "\n";
    }
  }
  const std::string about = CapturedText(captured);
  if (!about.empty()) text += "\n" + about + "\n";
  return text;
}

std::string StudyPage(const StudyText& text, const std::vector<StudyRun>& runs,
                      const CapturedSkating& captured) {
  std::string page = StudyPageHead(text.title);
  for (const std::string& note : text.notes) page += "<p>" + EscapeHtml(note) + "</p>\n";
  for (const char* deadline : {"adaptive", "fixed"}) {
    const auto some = Select(runs, "", deadline);
    if (some.empty()) continue;
    page += fmt::format("<h2>Table, {} deadline</h2><div class=\"scroll\"><table><tr>", deadline);
    for (const std::string& head : kStudyHeads) page += "<th>" + EscapeHtml(head) + "</th>";
    page += "</tr>\n";
    for (const StudyRun* run : some) {
      page += run->variant->key == "full" ? "<tr class=\"full\">" : "<tr>";
      for (const std::string& cell : RowOf(*run).cells) page += "<td>" + EscapeHtml(cell) + "</td>";
      page += "</tr>\n";
    }
    page += "</table></div>\n";
  }
  const std::string about = CapturedText(captured);
  if (!about.empty()) page += "<p>" + EscapeHtml(about) + "</p>\n";
  const auto full = Select(runs, "full", "");
  page += "<h2>Success by place of the goal, full intention</h2>\n";
  page += AxisChart(full, GridAxis::kHeight, "by height of the goal, % of motions");
  page += AxisChart(full, GridAxis::kAngle, "by angle, counter-clockwise from ahead, %");
  page += AxisChart(full, GridAxis::kDistance, "by distance, %");
  page += AxisChart(full, GridAxis::kStart, "by start pose, %");
  for (const StudyRun* run : full) page += FromAbove(*run);
  page += "<h2>Success by tolerance</h2>\n";
  for (const char* deadline : {"adaptive", "fixed"}) {
    const auto some = Select(runs, "", deadline);
    if (some.empty()) continue;
    page += ToleranceOf(some, fmt::format("% of motions within, {} deadline", deadline));
  }
  return page + "</body></html>\n";
}

}  // namespace holdfast::apps
