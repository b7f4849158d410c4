// SPDX-License-Identifier: MIT
#include "apps/evaluate/naturalness_page.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/charts.h"
#include "apps/page.h"

namespace holdfast::apps {
namespace {

constexpr const char* kNaturalnessColors[] = {"#444c56", "#d1495b", "#2f6f9f", "#66a182",
                                              "#edae49", "#6d597a", "#1b998b"};

const char* ColorOf(std::size_t column) {
  return kNaturalnessColors[column % std::size(kNaturalnessColors)];
}

std::string CurveChart(const NaturalnessStudy& study, StyleCurve curve) {
  const StyleCurveInfo& info = StyleCurves()[static_cast<std::size_t>(curve)];
  LineChart chart;
  chart.title = info.label;
  chart.x_label = info.x_label;
  chart.y_label = info.histogram ? fmt::format("% {}", info.y_label.substr(9))
                                 : fmt::format("{}, median and quartiles", info.y_label);
  chart.logarithmic = curve == StyleCurve::kPower;
  for (std::size_t c = 0; c < study.columns.size(); ++c) {
    const StyleCurveSpread spread = SpreadOf(study.columns[c].set, curve);
    if (spread.count == 0) continue;
    ChartLine line;
    line.label = fmt::format("{} ({})", study.columns[c].set.label, spread.count);
    line.color = ColorOf(c);
    for (Eigen::Index i = 0; i < spread.mean.size(); ++i) {
      line.points.emplace_back(CurveX(info, i),
                               info.histogram ? 100.0 * spread.mean[i] : spread.median[i]);
      if (info.histogram) continue;
      line.low.push_back(spread.low[i]);
      line.high.push_back(spread.high[i]);
    }
    chart.lines.push_back(std::move(line));
  }
  return DrawLineChart(chart);
}

std::string DistanceChart(const NaturalnessStudy& study) {
  DotChart chart;
  chart.title = "Distance from the reference, by measure";
  chart.x_label = "deviations of the reference; gray ticks: what chance alone gives";
  for (std::size_t c = 1; c < study.columns.size(); ++c) {
    chart.series.emplace_back(study.columns[c].set.label, ColorOf(c));
  }
  std::vector<std::pair<double, int>> order;
  for (int m = 0; m < study.NumMeasures(); ++m) {
    double farthest = -1.0;
    for (std::size_t c = 1; c < study.columns.size(); ++c) {
      const double distance = study.columns[c].distance[static_cast<std::size_t>(m)].distance;
      if (std::isfinite(distance)) farthest = std::max(farthest, distance);
    }
    if (farthest >= 0.0) order.emplace_back(-farthest, m);
  }
  std::ranges::sort(order);
  for (const auto& [farthest, m] : order) {
    DotChart::Row row;
    row.label = InfoOf(m).label;
    for (std::size_t c = 1; c < study.columns.size(); ++c) {
      const StyleDistance& distance = study.columns[c].distance[static_cast<std::size_t>(m)];
      row.values.push_back(distance.distance);
      row.ticks.push_back(distance.by_chance);
    }
    chart.rows.push_back(std::move(row));
  }
  return chart.rows.empty() ? "" : DrawDotChart(chart);
}

constexpr const char* kNaturalnessStyle = R"(
th, td { padding: .25rem .6rem; text-align: right; border-bottom: 1px solid #8886; }
th:first-child, td:first-child, .words td { text-align: left; }
tr.group td { font-weight: 600; padding-top: .8rem; }
td.shown { font-weight: 600; } td.chance { opacity: .6; })";

std::string TableHtml(const NaturalnessStudy& study) {
  std::string html = "<div class=\"scroll\"><table><tr>";
  const std::vector<std::string> heads = Heads(study);
  for (const std::string& head : heads) html += "<th>" + EscapeHtml(head) + "</th>";
  html += "</tr>\n";
  for (std::string_view group : {"Feet", "Way", "Body", "Motion", "Hand"}) {
    if (group == "Hand" && !study.hands) continue;
    html +=
        fmt::format("<tr class=\"group\"><td colspan=\"{}\">{}</td></tr>\n", heads.size(), group);
    for (const std::vector<std::string>& row : Rows(study, &group)) {
      html += "<tr>";
      for (std::size_t k = 0; k < row.size(); ++k) {
        const bool is_distance = k >= 3 && k % 2 == 1 && row[k] != "-";
        const char* kind = !is_distance                   ? ""
                           : row[k].ends_with("(chance)") ? " class=\"chance\""
                                                          : " class=\"shown\"";
        html += fmt::format("<td{}>{}</td>", kind, EscapeHtml(row[k]));
      }
      html += "</tr>\n";
    }
  }
  return html + "</table></div>\n";
}

std::string OddestHtml(const NaturalnessStudy& study) {
  std::vector<std::vector<std::string>> rows;
  for (const NaturalnessColumn& column : study.columns) {
    for (const int i : OddestMotions(column, 3)) {
      const Oddness& odd = column.oddness[static_cast<std::size_t>(i)];
      const StyleMeasureInfo& info = InfoOf(odd.most);
      rows.push_back({column.set.label, column.files[static_cast<std::size_t>(i)],
                      fmt::format("{:.2f}", odd.value),
                      fmt::format("{}: {:.{}f} {}", info.label, ForPeople(info, odd.most_value),
                                  Digits(info), UnitForPeople(info))});
    }
  }
  return HtmlTable({"set", "motion", "oddness", "farthest off"}, rows, {}, "words");
}

}  // namespace

std::string NaturalnessPage(const NaturalnessStudy& study) {
  std::string page = PageHead("Naturalness", "What makes a walk look captured",
                              fmt::format("{}{}{}", kTableStyle, kNaturalnessStyle, kChartStyle));
  for (const std::string& note : study.notes) page += "<p>" + EscapeHtml(note) + "</p>\n";
  page += "<ul>\n";
  for (std::size_t c = 0; c < study.columns.size(); ++c) {
    const NaturalnessColumn& column = study.columns[c];
    page += "<li>" + EscapeHtml(Summary(column));
    if (c > 0) {
      page += EscapeHtml(fmt::format(
          ". Mean distance {:.2f} (chance: {:.2f}). Set apart by (mean for the reference's; "
          "distance): {}",
          column.mean_distance, column.mean_by_chance, ApartText(study, column, 6)));
      if (study.hands) {
        page += fmt::format(". Mean distance of the hand {:.2f} (chance: {:.2f})",
                            column.hand_distance, column.hand_by_chance);
      }
    }
    page += "</li>\n";
  }
  page += "</ul>\n";
  page += DistanceChart(study);
  page += "<h2>Curves</h2>\n";
  for (int k = 0; k < study.NumCurves(); ++k) page += CurveChart(study, static_cast<StyleCurve>(k));
  page += "<h2>All measures</h2>\n<p>Mean over motions ± standard error.</p>\n" + TableHtml(study);
  page += "<h2>The oddest motions of each set</h2>\n" + OddestHtml(study);
  std::vector<std::vector<std::string>> definitions;
  for (int m = 0; m < study.NumMeasures(); ++m) {
    const StyleMeasureInfo& info = InfoOf(m);
    definitions.push_back({std::string(info.label),
                           fmt::format("{}{}", info.definition, info.of_walks ? " (walks)" : "")});
  }
  return page + "<h2>Definitions</h2>\n" + HtmlTable({}, definitions, {}, "words") +
         "</body></html>\n";
}

}  // namespace holdfast::apps
