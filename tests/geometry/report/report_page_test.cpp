// SPDX-License-Identifier: MIT
#include "geometry/report/report_page.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/io/container/atomic_file.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ReportInput Shown(const char* source, int frames) {
  const LoadedClip motion = LoadClip("demo_drink");
  ReportInput input;
  input.source = source;
  input.clip = Slice(motion.clip, 0, frames);
  input.body = motion.body.model;
  input.betas = motion.body.betas;
  return input;
}

TEST(ReportPage, HoldsItsClipsAndNothingThatCouldRun) {
  if (!HasReportPlayer()) GTEST_SKIP() << "built without the player";
  const std::vector<ReportInput> clips = {Shown("one</script><b>", 2), Shown("two", 3)};
  std::vector<int> told;
  const auto progress = [&](const char*, int done, int total) {
    EXPECT_EQ(total, 2);
    told.push_back(done);
    return true;
  };
  const ReportPage page = MakeReportPage(clips, {.title = "", .seed = 7}, progress);
  EXPECT_EQ(told, (std::vector<int>{1, 2}));
  EXPECT_LT(page.surface_error_mm, 0.11);
  EXPECT_GT(page.directions, 0);
  EXPECT_EQ(page.html.find("<!doctype html>"), 0u);
  EXPECT_THAT(page.html, Not(HasSubstr("<!--holdfast:")));
  EXPECT_THAT(page.html, HasSubstr("<title>one&lt;/script&gt;&lt;b&gt; and two"));
  const std::string begin = "id=\"report-header\">";
  const std::size_t from = page.html.find(begin) + begin.size();
  const nlohmann::json header =
      nlohmann::json::parse(page.html.substr(from, page.html.find("</script>", from) - from));
  EXPECT_EQ(header["schema"], "holdfast/report/1");
  EXPECT_EQ(header["seed"], 7);
  EXPECT_TRUE(header["holdfast_version"].is_string());
  EXPECT_EQ(header["clips"][0]["name"], "one</script><b>");
  EXPECT_EQ(header["clips"][1]["frames"], 3);
  EXPECT_EQ(MakeReportPage(clips, {.title = "", .seed = 7, .threads = 3}).html, page.html);
}

TEST(ReportPage, IsNotMadeWhereTheWorkIsStopped) {
  if (!HasReportPlayer()) GTEST_SKIP() << "built without the player";
  const std::vector<ReportInput> clips = {Shown("one", 1), Shown("two", 1)};
  int calls = 0;
  EXPECT_EQ(MakeReportPage(clips, {}, [&](const char*, int, int) { return ++calls < 1; }).html, "");
  EXPECT_EQ(calls, 1);
}

TEST(ReportPage, SaysWhatIsMissing) {
  EXPECT_THROW(MakeReportPage({}), Error);
  if (HasReportPlayer()) return;
  const ReportInput clip = Shown("one", 1);
  EXPECT_THAT(testing::ErrorText([&] {
                MakeReportPage({&clip, 1});
              }),
              HasSubstr("HOLDFAST_BUILD_PLAYER=ON"));
}

TEST(ReportPage, ReadsTheMetricsOfAResult) {
  const testing::TemporaryFolder folder;
  EXPECT_TRUE(MetricsBeside(folder / "clip.npz").is_null());
  WriteAtomically(folder / "metrics.json", "{\"seed\": 1}");
  EXPECT_EQ(MetricsBeside(folder / "clip.npz")["seed"], 1);
  EXPECT_TRUE(MetricsBeside(folder / "other.npz").is_null());
  WriteAtomically(folder / "metrics.json", "[1, 2]");
  EXPECT_THROW(MetricsBeside(folder / "clip.npz"), Error);
}

TEST(EscapeHtml, LeavesNoMarkup) {
  EXPECT_EQ(EscapeHtml("<a b='c'>&\""), "&lt;a b=&#39;c&#39;&gt;&amp;&quot;");
}

}  // namespace
}  // namespace holdfast
