// SPDX-License-Identifier: MIT
#include "apps/evaluate/reach_study_page.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <fmt/format.h>

#include "apps/charts.h"
#include "apps/page.h"

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

const std::vector<std::string> kStudyHeads = {
    "intention",    "SR",        "SR at end",  "rests",    "DTG mean",
    "DTG median",   "FS",        "FS, joints", "airborne", "pelvis, peak",
    "acceleration", "paper: SR", "paper: DTG", "paper: FS"};

std::vector<std::string> RowOf(const StudyRun& run) {
  const StudySummary& s = run.summary;
  std::string label = run.variant->label;
  if (!run.how.empty()) label += fmt::format(" ({})", run.how);
  return {label,
          Percent(s.reach.success),
          Percent(s.reach.success_at_end),
          Percent(s.reach.rests),
          fmt::format("{:.1f} cm", 100.0 * s.reach.distance_mean_m),
          fmt::format("{:.1f} cm", 100.0 * s.reach.distance_median_m),
          Percent(s.surface_skating),
          Percent(s.reach.skating),
          Percent(s.reach.airborne),
          fmt::format("{:.2f} m/s", s.reach.peak_pelvis_median_m_s),
          fmt::format("{:.2f} m/s2", s.reach.acceleration_m_s2),
          OrDash(run.variant->paper_success, 100.0, "%"),
          OrDash(run.variant->paper_distance_m, 100.0, "cm"),
          OrDash(run.variant->paper_skating, 100.0, "%")};
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

// Share of motions that come within 0 to 1 m of the goal.
ShareSeries WithinTolerance(const std::string& label, const std::vector<StudyMotion>& motions) {
  std::vector<double> distances;
  for (const StudyMotion& motion : motions) distances.push_back(motion.outcome.closest_m);
  std::ranges::sort(distances);
  ShareSeries series{label, {}};
  for (int k = 0; k <= 100; ++k) {
    const auto count = std::ranges::upper_bound(distances, 0.01 * k) - distances.begin();
    series.points.emplace_back(0.01 * k,
                               static_cast<double>(count) / static_cast<double>(distances.size()));
  }
  return series;
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
    text += fmt::format("; on the {} that go a meter or more: {} (foot joints {})",
                        captured.walking_clips, Percent(captured.walking_surface),
                        Percent(captured.walking_joints));
  }
  return text + ".";
}

std::vector<std::vector<std::string>> RowsOf(const std::vector<const StudyRun*>& runs) {
  std::vector<std::vector<std::string>> rows;
  for (const StudyRun* run : runs) rows.push_back(RowOf(*run));
  return rows;
}

std::vector<NamedRun> Named(const std::vector<const StudyRun*>& runs, bool by_deadline) {
  std::vector<NamedRun> named;
  for (const StudyRun* run : runs) {
    named.emplace_back(by_deadline ? run->deadline + " deadline" : run->variant->label, run);
  }
  return named;
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

std::string PlaceCharts(const std::vector<NamedRun>& runs, int width) {
  std::string charts;
  for (const auto& [axis, title] :
       {std::pair{GridAxis::kHeight, "by height of the goal, % of motions"},
        std::pair{GridAxis::kAngle, "by angle, counter-clockwise from ahead, %"},
        std::pair{GridAxis::kDistance, "by distance, %"},
        std::pair{GridAxis::kStart, "by start pose, %"}}) {
    Bars bars{title, {}, {}, width};
    for (const auto& [name, run] : runs) {
      std::vector<double> values;
      bars.labels.clear();
      for (const AxisValue& value : ByAxis(*run, axis)) {
        bars.labels.push_back(value.label);
        values.push_back(value.success);
      }
      bars.series.emplace_back(name, values);
    }
    charts += BarChart(bars);
  }
  return charts;
}

std::string ToleranceChart(const std::vector<NamedRun>& runs, const std::string& title, int width) {
  ShareLines lines{title, {}, {}};
  for (const auto& [name, run] : runs) lines.series.push_back(WithinTolerance(name, run->motions));
  for (int k = 0; k <= 4; ++k) lines.ticks.emplace_back(0.25 * k, fmt::format("{} cm", 25 * k));
  lines.limit = wandr::kReachedWithin;
  lines.width = width;
  return ShareChart(lines);
}

nlohmann::json PlacesJson(const StudyRun& run, bool counts) {
  nlohmann::json places;
  for (const auto& [name, axis] :
       {std::pair{"by_angle", GridAxis::kAngle}, std::pair{"by_height", GridAxis::kHeight},
        std::pair{"by_distance", GridAxis::kDistance}, std::pair{"by_start", GridAxis::kStart}}) {
    for (const AxisValue& value : ByAxis(run, axis)) {
      places[name].push_back({{"at", value.label},
                              {"success_ratio", value.success},
                              {"distance_to_goal_mean_m", value.distance_m}});
      if (counts) places[name].back()["motions"] = value.motions;
    }
  }
  return places;
}

std::string StudyTable(const std::vector<StudyRun>& runs, const CapturedSkating& captured) {
  std::string text;
  for (const char* deadline : {"adaptive", "fixed"}) {
    const auto some = Select(runs, "", deadline);
    if (some.empty()) continue;
    if (!text.empty()) text += "\n";
    text += fmt::format("{} deadline, {} motions each\n\n", deadline, some[0]->motions.size());
    text += MarkdownTable(kStudyHeads, RowsOf(some));
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
    std::vector<int> strong;
    for (std::size_t r = 0; r < some.size(); ++r) {
      if (some[r]->variant->key == "full") strong.push_back(static_cast<int>(r));
    }
    page += fmt::format("<h2>Table, {} deadline</h2>", deadline);
    page += HtmlTable(kStudyHeads, RowsOf(some), strong);
  }
  const std::string about = CapturedText(captured);
  if (!about.empty()) page += "<p>" + EscapeHtml(about) + "</p>\n";
  const auto full = Select(runs, "full", "");
  page += "<h2>Success by place of the goal, full intention</h2>\n";
  page += PlaceCharts(Named(full, true), 400);
  for (const StudyRun* run : full) page += FromAbove(*run);
  page += "<h2>Success by tolerance</h2>\n";
  for (const char* deadline : {"adaptive", "fixed"}) {
    const auto some = Select(runs, "", deadline);
    if (some.empty()) continue;
    page += ToleranceChart(Named(some, false),
                           fmt::format("% of motions within, {} deadline", deadline), 400);
  }
  return page + "</body></html>\n";
}

}  // namespace holdfast::apps
