// SPDX-License-Identifier: MIT
#include "apps/report_writer.h"

#include "geometry/io/container/atomic_file.h"

namespace holdfast::apps {

ReportPage WriteReport(std::span<const ReportInput> clips, const std::filesystem::path& path,
                       ReportPageOptions options, const CommonOptions& common) {
  if (Interrupted()) return {};
  options.seed = common.seed;
  options.threads = NumThreads(common);
  Progress progress(common, "report");
  ReportPage page = MakeReportPage(clips, options, [&](const char*, int done, int total) {
    progress.Update(done, total);
    return !Interrupted();
  });
  if (!page.html.empty()) WriteAtomically(path, page.html);
  return page;
}

void WriteReportBeside(std::span<const ReportInput> clips, const std::filesystem::path& path,
                       const CommonOptions& common) {
  if (HasReportPlayer()) {
    WriteReport(clips, path, {}, common);
    if (Interrupted()) Note(common, "note: interrupted: the result is kept, without report.html");
  } else {
    Note(common, "note: no report.html: this program was built without the player");
  }
}

}  // namespace holdfast::apps
