// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/charts.h"
#include "apps/evaluate/reach_study_methods_results.h"
#include "apps/page.h"

namespace holdfast::apps {
namespace {

const std::vector<std::string> kMethodHeads = {"",
                                               "SR",
                                               "SR at end",
                                               "rests",
                                               "DTG mean",
                                               "DTG median",
                                               "FS",
                                               "FS, joints",
                                               "both feet > 12 cm: motions",
                                               "both feet > 12 cm: frames",
                                               "pelvis > 2 m/s: motions",
                                               "pelvis > 2 m/s: frames",
                                               "acceleration",
                                               "latents, rms"};

std::string Centimeters(double meters) { return fmt::format("{:.1f} cm", 100.0 * meters); }

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

// Rows of latent-opt are told in `strong`.
std::vector<std::vector<std::string>> RowsOf(const std::vector<MethodRun>& runs,
                                             const std::vector<CapturedMotion>& captured,
                                             std::vector<int>& strong) {
  std::vector<std::vector<std::string>> rows;
  for (const PaperRow& paper : PaperRows()) {
    rows.push_back({paper.label, Percent(paper.success, 0), "-", "-", Centimeters(paper.distance_m),
                    "-", Percent(paper.skating, 0)});
  }
  for (const CapturedGroup& group : GroupsOf(captured)) {
    rows.push_back({group.label, "-", "-", "-", "-", "-"});
    for (std::string& cell : MannerCells(group.summary)) rows.back().push_back(std::move(cell));
  }
  for (const MethodRun& run : runs) {
    const MethodSummary& s = run.summary;
    if (run.method.key == "latent-opt") strong.push_back(static_cast<int>(rows.size()));
    rows.push_back({run.method.label, Percent(s.study.reach.success),
                    Percent(s.study.reach.success_at_end), Percent(s.study.reach.rests),
                    Centimeters(s.study.reach.distance_mean_m),
                    Centimeters(s.study.reach.distance_median_m)});
    for (std::string& cell : MannerCells(s)) rows.back().push_back(std::move(cell));
    rows.back().push_back(fmt::format("{:.2f}", s.latent_rms));
  }
  for (std::vector<std::string>& row : rows) row.resize(kMethodHeads.size(), "-");
  return rows;
}

ShareSeries SeriesOf(const MethodRun& run, const SuccessCurve& curve, double last_x) {
  // What has stopped stays where it is; what never iterates is a level to compare with.
  ShareSeries series{run.method.label, {}, curve.x.size() < 2};
  for (std::size_t k = 0; k < curve.x.size(); ++k) {
    series.points.emplace_back(curve.x[k], curve.success[k]);
  }
  series.points.emplace_back(last_x, curve.success.back());
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
    lines.series.push_back(SeriesOf(run, SuccessBySeconds(run), lines.ticks.back().first));
  }
  return ShareChart(lines);
}

}  // namespace

std::string MethodsTable(const std::vector<MethodRun>& runs,
                         const std::vector<CapturedMotion>& captured) {
  std::vector<int> strong;
  return MarkdownTable(kMethodHeads, RowsOf(runs, captured, strong));
}

std::string MethodsTimes(const std::vector<MethodRun>& runs) {
  std::string text;
  for (const MethodRun& run : runs) {
    const double seconds = run.summary.seconds;
    text +=
        fmt::format("{}: {:.{}f} s per motion\n", run.method.label, seconds, seconds < 0.1 ? 3 : 2);
  }
  return text;
}

std::string MethodsTimingPage(const std::vector<MethodRun>& runs) {
  return StudyPageHead("Success by time") + SecondsChart(runs) + "</body></html>\n";
}

std::string MethodsPage(const StudyText& text, const std::vector<MethodRun>& runs,
                        const std::vector<CapturedMotion>& captured) {
  std::string page = StudyPageHead(text.title);
  for (const std::string& note : text.notes) page += "<p>" + EscapeHtml(note) + "</p>\n";
  page += fmt::format("<h2>Table, {} motions each</h2>", runs[0].motions.size());
  std::vector<int> strong;
  const std::vector<std::vector<std::string>> rows = RowsOf(runs, captured, strong);
  page += HtmlTable(kMethodHeads, rows, strong, "many") + "<h2>Success on the way</h2>\n";
  page += IterationChart(runs);
  std::vector<NamedRun> named;
  for (const MethodRun& run : runs) named.emplace_back(run.method.label, &run.plain);
  page += "<h2>Success by tolerance</h2>\n" + ToleranceChart(named, "% of motions within", 600);
  page += "<h2>Success by place of the goal</h2>\n" + PlaceCharts(named, 600);
  return page + "</body></html>\n";
}

}  // namespace holdfast::apps
