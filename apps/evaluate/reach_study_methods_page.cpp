// SPDX-License-Identifier: MIT
#include "apps/evaluate/reach_study_methods_page.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/evaluate/reach_study_charts.h"
#include "apps/report/report_page.h"

namespace holdfast::apps {
namespace {

struct MethodRow {
  bool bold = false;
  std::vector<std::string> cells;
};

const std::vector<std::string> kMethodHeads = {"",
                                               "SR",
                                               "SR at end",
                                               "DTG mean",
                                               "DTG median",
                                               "FS",
                                               "FS, joints",
                                               "both feet > 12 cm: motions",
                                               "both feet > 12 cm: frames",
                                               "pelvis > 2 m/s: motions",
                                               "pelvis > 2 m/s: frames",
                                               "acceleration",
                                               "latents, rms",
                                               "s per motion"};

std::string Centimetres(double metres) { return fmt::format("{:.1f} cm", 100.0 * metres); }

// How motions move, whatever they were for.
std::vector<std::string> MannerCells(const MethodSummary& s) {
  return {Percent(s.study.surface_skating),
          Percent(s.study.reach.skating),
          Percent(s.airborne_motions),
          Percent(s.study.reach.airborne, 2),
          Percent(s.fast_motions),
          Percent(s.fast_frames, 2),
          fmt::format("{:.2f} m/s2", s.study.reach.acceleration_m_s2)};
}

std::vector<MethodRow> RowsOf(const std::vector<MethodRun>& runs,
                              const std::vector<CapturedMotion>& captured) {
  std::vector<MethodRow> rows;
  for (const PaperRow& paper : PaperRows()) {
    rows.push_back({false,
                    {paper.label, Percent(paper.success, 0), "-", Centimetres(paper.distance_m),
                     "-", Percent(paper.skating, 0)}});
  }
  for (const CapturedGroup& group : GroupsOf(captured)) {
    MethodRow row{false, {group.label, "-", "-", "-", "-"}};
    for (std::string& cell : MannerCells(group.summary)) row.cells.push_back(std::move(cell));
    rows.push_back(row);
  }
  for (const MethodRun& run : runs) {
    const MethodSummary& s = run.summary;
    MethodRow row{
        run.method.key == "latent-opt",
        {run.method.label, Percent(s.study.reach.success), Percent(s.study.reach.success_at_end),
         Centimetres(s.study.reach.distance_mean_m), Centimetres(s.study.reach.distance_median_m)}};
    for (std::string& cell : MannerCells(s)) row.cells.push_back(std::move(cell));
    row.cells.push_back(fmt::format("{:.2f}", s.latent_rms));
    row.cells.push_back(fmt::format("{:.{}f}", s.seconds, s.seconds < 0.1 ? 3 : 2));
    rows.push_back(row);
  }
  for (MethodRow& row : rows) row.cells.resize(kMethodHeads.size(), "-");
  return rows;
}

ShareSeries SeriesOf(const MethodRun& run, const SuccessCurve& curve, double last_x) {
  ShareSeries series{run.method.label, curve.x, curve.success};
  // What has stopped stays where it is; what never iterates is a level to compare with.
  series.dashed = curve.x.size() < 2;
  if (series.dashed) series.share.insert(series.share.begin(), series.share[0]);
  if (series.dashed) series.x.insert(series.x.begin(), 0.0);
  series.x.push_back(last_x);
  series.share.push_back(series.share.back());
  return series;
}

std::string IterationChart(const std::vector<MethodRun>& runs) {
  double last = 1.0;
  for (const MethodRun& run : runs) last = std::max(last, SuccessByIteration(run).x.back());
  const double step = last <= 20 ? 5 : last <= 50 ? 10 : last <= 120 ? 25 : 50;
  ShareLines lines{"% of motions within 10 cm, by iterations", {}, {}};
  for (double x = 0.0; x < last; x += step) lines.ticks.emplace_back(x, fmt::format("{:g}", x));
  lines.ticks.emplace_back(step * std::ceil(last / step),
                           fmt::format("{:g}", step * std::ceil(last / step)));
  for (const MethodRun& run : runs) {
    lines.series.push_back(SeriesOf(run, SuccessByIteration(run), lines.ticks.back().first));
  }
  lines.width = 600;
  return ShareChart(lines);
}

std::string SecondsChart(const std::vector<MethodRun>& runs) {
  double first = 1.0, last = 1.0;
  for (const MethodRun& run : runs) {
    for (const double x : SuccessBySeconds(run).x) {
      if (x > 0.0) first = std::min(first, x);
      last = std::max(last, x);
    }
  }
  ShareLines lines{"% of motions within 10 cm, by seconds of one core per motion", {}, {}};
  const int low = static_cast<int>(std::floor(std::log10(first)));
  const int high = static_cast<int>(std::ceil(std::log10(last) - 1e-9));
  for (int power = low; power <= std::max(high, low + 1); ++power) {
    lines.ticks.emplace_back(std::pow(10.0, power), fmt::format("{:g}", std::pow(10.0, power)));
  }
  lines.logarithmic = true;
  lines.width = 600;
  for (const MethodRun& run : runs) {
    ShareSeries series = SeriesOf(run, SuccessBySeconds(run), lines.ticks.back().first);
    if (series.dashed) {  // from when it is there
      series.x.erase(series.x.begin());
      series.share.erase(series.share.begin());
    }
    lines.series.push_back(std::move(series));
  }
  return ShareChart(lines);
}

std::string AxisChart(const std::vector<MethodRun>& runs, GridAxis axis, const std::string& title) {
  Bars bars{title, {}, {}, 600};
  for (const MethodRun& run : runs) {
    std::vector<double> values;
    bars.labels.clear();
    for (const AxisValue& value : ByAxis(run, axis)) {
      bars.labels.push_back(value.label);
      values.push_back(value.success);
    }
    bars.series.emplace_back(run.method.label, values);
  }
  return BarChart(bars);
}

}  // namespace

std::string MethodsTable(const std::vector<MethodRun>& runs,
                         const std::vector<CapturedMotion>& captured) {
  std::string text = "|";
  for (const std::string& head : kMethodHeads) text += fmt::format(" {} |", head);
  text += "\n|";
  for (std::size_t k = 0; k < kMethodHeads.size(); ++k) text += "---|";
  text += "\n";
  for (const MethodRow& row : RowsOf(runs, captured)) {
    text += "|";
    for (const std::string& cell : row.cells) text += fmt::format(" {} |", cell);
    text += "\n";
  }
  return text;
}

std::string MethodsPage(const StudyText& text, const std::vector<MethodRun>& runs,
                        const std::vector<CapturedMotion>& captured) {
  std::string page = StudyPageHead(text.title);
  for (const std::string& note : text.notes) page += "<p>" + EscapeHtml(note) + "</p>\n";
  page +=
      fmt::format("<h2>Table, {} motions each</h2><div class=\"scroll\"><table class=\"many\"><tr>",
                  runs[0].motions.size());
  for (const std::string& head : kMethodHeads) page += "<th>" + EscapeHtml(head) + "</th>";
  page += "</tr>\n";
  for (const MethodRow& row : RowsOf(runs, captured)) {
    page += row.bold ? "<tr class=\"full\">" : "<tr>";
    for (const std::string& cell : row.cells) page += "<td>" + EscapeHtml(cell) + "</td>";
    page += "</tr>\n";
  }
  page += "</table></div>\n<h2>Success on the way</h2>\n";
  page += IterationChart(runs) + SecondsChart(runs);
  page += "<h2>Success by tolerance</h2>\n";
  std::vector<ShareSeries> within;
  for (const MethodRun& run : runs) {
    std::vector<StudyMotion> plain;
    for (const MethodMotion& motion : run.motions) plain.push_back(motion.motion);
    within.push_back(WithinTolerance(run.method.label, plain));
  }
  page += ToleranceChart(within, "% of motions within", 600);
  page += "<h2>Success by place of the goal</h2>\n";
  page += AxisChart(runs, GridAxis::kHeight, "by height of the goal, % of motions");
  page += AxisChart(runs, GridAxis::kAngle, "by angle, counter-clockwise from ahead, %");
  page += AxisChart(runs, GridAxis::kDistance, "by distance, %");
  page += AxisChart(runs, GridAxis::kStart, "by start pose, %");
  return page + "</body></html>\n";
}

}  // namespace holdfast::apps
