// SPDX-License-Identifier: MIT
// Reports as files: what is in them, what is not, and what happens with bad input. How they look
// and behave is tested in a browser (tests/web/show_report.mjs).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/score/hand_object_score.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;
using testing::TemporaryFolder;

#ifdef HOLDFAST_HAS_PLAYER

// The JSON that the page's script reads.
nlohmann::json HeaderOf(const std::string& page) {
  const std::string begin = "id=\"report-header\">";
  const std::size_t from = page.find(begin) + begin.size();
  return nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
}

Clip DemoClip() { return ReadClip(HOLDFAST_MESHES_DIR "/clips/demo_drink.npz"); }

// The demo clip with an object that moves with the right wrist: no fit needed.
Clip ClipWithObject(const std::string& object_name, const std::string& mesh) {
  Clip clip = DemoClip();
  const auto body = BodyModel::Default();
  const HandModel hand(body, {}, Side::kRight);
  HandState state(hand);
  clip.object.emplace();
  clip.object->name = object_name;
  clip.object->mesh = mesh;
  clip.object->trans.resize(3, clip.NumFrames());
  clip.object->orient.setZero(3, clip.NumFrames());
  for (int t = 0; t < clip.NumFrames(); ++t) {
    state.SetBody(clip.pose[t], clip.trans.col(t));
    state.Evaluate(FingersOf(clip.pose[t], Side::kRight), false);
    clip.object->trans.col(t) = state.Vertices().rowwise().mean();
  }
  return clip;
}

Clip Repeated(const Clip& clip, int frames) {
  Clip longer = clip;
  longer.trans.resize(3, frames);
  longer.pose.resize(static_cast<std::size_t>(frames));
  longer.holding_hand.clear();
  for (int t = 0; t < frames; ++t) {
    longer.trans.col(t) = clip.trans.col(t % clip.NumFrames());
    longer.pose[t] = clip.pose[t % clip.NumFrames()];
  }
  if (!clip.object) return longer;
  longer.object->trans.resize(3, frames);
  longer.object->orient.resize(3, frames);
  for (int t = 0; t < frames; ++t) {
    longer.object->trans.col(t) = clip.object->trans.col(t % clip.NumFrames());
    longer.object->orient.col(t) = clip.object->orient.col(t % clip.NumFrames());
  }
  return longer;
}

TEST(ReportCommand, WritesOnePageThatNeedsNothingElse) {
  const TemporaryFolder folder;
  const ProgramResult result = RunHoldfast(folder.Path(), "report demo_drink -o r.html --json -q");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string page = ReadText(folder / "r.html");
  EXPECT_EQ(nlohmann::json::parse(result.out)["bytes"], page.size());
  EXPECT_EQ(page.find("<!doctype html>"), 0u);
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
  for (const char* fetch :
       {"src=\"", "<link", "@import", "url(http", "fetch(\"http", "import(\"http"}) {
    EXPECT_THAT(page, Not(HasSubstr(fetch)));
  }
  EXPECT_THAT(page, Not(HasSubstr("<!--holdfast:")));
  EXPECT_EQ(testing::Listing(folder.Path()), "r.html ");
}

TEST(ReportCommand, EightSecondsStayUnderEightMegabytes) {
  const TemporaryFolder folder;
  WriteClip(Repeated(ClipWithObject("mug", ""), 240), folder / "long.npz");
  const ProgramResult result = RunHoldfast(folder.Path(), "report long.npz -o r.html --json -q");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json summary = nlohmann::json::parse(result.out);
  EXPECT_LT(summary["bytes"].get<double>(), 8e6);
  EXPECT_GT(summary["bytes"].get<double>(), 5e5);
  EXPECT_LE(summary["surface_error_mm"].get<double>(), 0.1);
  EXPECT_LT(summary["made_ms"].get<double>(), 60'000);  // 0.6 s on an idle laptop
  EXPECT_EQ(HeaderOf(ReadText(folder / "r.html"))["clips"][0]["frames"], 240);
}

TEST(ReportCommand, GivesTheSameBytesForAnyNumberOfThreads) {
  const TemporaryFolder folder;
  WriteClip(ClipWithObject("mug", ""), folder / "clip.npz");
  ASSERT_EQ(RunHoldfast(folder.Path(), "report clip.npz -o a.html --threads 1 -q").exit_code, 0);
  ASSERT_EQ(RunHoldfast(folder.Path(), "report clip.npz -o b.html --threads 3 -q").exit_code, 0);
  EXPECT_TRUE(ReadText(folder / "a.html") == ReadText(folder / "b.html"));
}

TEST(ReportCommand, CurvesWithoutMetricsAreThoseOfTheMetricsProtocol) {
  const TemporaryFolder folder;
  const Clip clip = ClipWithObject("mug", "");
  WriteClip(clip, folder / "clip.npz");
  ASSERT_EQ(RunHoldfast(folder.Path(), "report clip.npz -o r.html -q").exit_code, 0);
  const nlohmann::json series = HeaderOf(ReadText(folder / "r.html"))["clips"][0]["series"];
  const HandModel hand(BodyModel::Default(), {}, Side::kRight);
  const Solid mug(ReadMesh(HOLDFAST_MESHES_DIR "/objects/mug.ply"));
  const auto frames =
      MeasureHandObject(clip, hand, mug, nullptr, {.contact = {}, .measure_exact = false}).frames;
  ASSERT_EQ(series["contact_ratio"].size(), frames.size());
  bool deep = false;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    EXPECT_NEAR(series["contact_ratio"][t].get<double>(), frames[t].hand.contact_ratio, 1e-12);
    // Depths beyond 12.7 mm are shown as that.
    const double depth = std::min(12.7, frames[t].hand.max_penetration_mm);
    EXPECT_NEAR(series["hand_in_object_mm"][t].get<double>(), depth, 1e-9);
    deep = deep || depth > 1.0;
  }
  EXPECT_TRUE(deep) << "the clip is meant to have penetration";
}

TEST(ReportCommand, NamesFromFilesStayText) {
  const TemporaryFolder folder;
  const std::string hostile = "</script><script>alert(1)</script><!--\"'&\xff";
  Clip clip = DemoClip();
  clip.object.emplace();
  clip.object->name = hostile;
  clip.object->mesh = hostile;
  clip.object->trans.setZero(3, clip.NumFrames());
  clip.object->orient.setZero(3, clip.NumFrames());
  WriteClip(clip, folder / "clip.npz");
  const ProgramResult result = RunHoldfast(folder.Path(), "report clip.npz -o r.html -q");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string page = ReadText(folder / "r.html");
  EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(HeaderOf(page)["clips"][0]["object_name"].get<std::string>(),
              HasSubstr("</script><script>alert(1)</script>"));
  EXPECT_THAT(page, HasSubstr("<title>&lt;/script&gt;&lt;script&gt;alert(1)"));
}

TEST(ReportCommand, ShowsTheBodyAloneWhenTheObjectIsMissing) {
  const TemporaryFolder folder;
  WriteClip(ClipWithObject("nobody_knows_it", "gone.ply"), folder / "clip.npz");
  const ProgramResult result = RunHoldfast(folder.Path(), "report clip.npz -o r.html");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("gone.ply"));
  const nlohmann::json clip = HeaderOf(ReadText(folder / "r.html"))["clips"][0];
  EXPECT_EQ(clip["has_object"], false);
  EXPECT_THAT(clip["notes"].dump(), HasSubstr("gone.ply"));
  EXPECT_FALSE(clip["series"].contains("contact_ratio"));
}

TEST(ReportCommand, ShowsSeveralClips) {
  const TemporaryFolder folder;
  WriteClip(ClipWithObject("mug", ""), folder / "first.npz");
  WriteClip(ClipWithObject("bottle", ""), folder / "second.npz");
  const ProgramResult result = RunHoldfast(
      folder.Path(), "report first.npz second.npz demo_inspect -o r.html --title Three -q");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string page = ReadText(folder / "r.html");
  const nlohmann::json header = HeaderOf(page);
  ASSERT_EQ(header["clips"].size(), 3u);
  EXPECT_EQ(header["title"], "Three");
  EXPECT_EQ(header["clips"][1]["name"], "second");
  EXPECT_EQ(header["clips"][2]["has_object"], false);
  EXPECT_THAT(page, HasSubstr("id=\"report-payload-2\""));
}

TEST(ReportCommand, ShowsASingleFrame) {
  const TemporaryFolder folder;
  WriteClip(Slice(ClipWithObject("mug", ""), 0, 1), folder / "clip.npz");
  const ProgramResult result = RunHoldfast(folder.Path(), "report clip.npz -o r.html -q");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(HeaderOf(ReadText(folder / "r.html"))["clips"][0]["frames"], 1);
}

TEST(ReportCommand, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  EXPECT_EQ(RunHoldfast(folder.Path(), "report -o r.html").exit_code, 2);
  EXPECT_EQ(RunHoldfast(folder.Path(), "report demo_drink").exit_code, 2);
  const ProgramResult missing = RunHoldfast(folder.Path(), "report gone.npz -o r.html");
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.err, HasSubstr("gone.npz"));
  EXPECT_EQ(testing::Listing(folder.Path()), "");
  ASSERT_EQ(RunHoldfast(folder.Path(), "report demo_drink -o r.html -q").exit_code, 0);
  const ProgramResult there = RunHoldfast(folder.Path(), "report demo_drink -o r.html -q");
  EXPECT_EQ(there.exit_code, 1);
  EXPECT_THAT(there.err, HasSubstr("--force"));
}

TEST(FitCommand, LeavesAReportUnlessToldNotTo) {
  const TemporaryFolder folder;
  ASSERT_EQ(RunHoldfast(folder.Path(), "fit demo_drink mug -o held --end 4 -q").exit_code, 0);
  const nlohmann::json clip = HeaderOf(ReadText(folder / "held/report.html"))["clips"][0];
  EXPECT_EQ(clip["frames"], 4);
  EXPECT_EQ(clip["has_object"], true);
  EXPECT_TRUE(clip["series"].contains("energy_total"));
  EXPECT_TRUE(clip["series"]["iterations"][0].is_null()) << "the first frame is given, not solved";
  EXPECT_EQ(clip["metrics"]["options"]["object"], "mug");
  ASSERT_EQ(
      RunHoldfast(folder.Path(), "fit demo_drink mug -o bare --end 4 --no-report -q").exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(folder / "bare/report.html"));
}

#else

TEST(ReportCommand, SaysHowToGetThePlayer) {
  const TemporaryFolder folder;
  const ProgramResult result = RunHoldfast(folder.Path(), "report demo_drink -o r.html");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("HOLDFAST_BUILD_PLAYER=ON"));
}

#endif

}  // namespace
}  // namespace holdfast
