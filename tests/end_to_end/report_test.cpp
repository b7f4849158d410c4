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

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::ProgramResult;
using testing::ReadText;

using ReportCommand = testing::ProgramTest;
using FitCommand = testing::ProgramTest;

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
  longer.object->trans.resize(3, frames);
  longer.object->orient.resize(3, frames);
  for (int t = 0; t < frames; ++t) {
    const int same = t % clip.NumFrames();
    longer.trans.col(t) = clip.trans.col(same);
    longer.pose[t] = clip.pose[same];
    longer.object->trans.col(t) = clip.object->trans.col(same);
    longer.object->orient.col(t) = clip.object->orient.col(same);
  }
  return longer;
}

TEST_F(ReportCommand, WritesOnePageThatNeedsNothingElse) {
  const ProgramResult result = folder.Run("report demo_drink -o r.html --json -q");
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

TEST_F(ReportCommand, EightSecondsStayUnderEightMegabytes) {
  WriteClip(Repeated(ClipWithObject("mug", ""), 240), folder / "long.npz");
  const nlohmann::json summary = folder.Json("report long.npz -o r.html -q");
  EXPECT_LT(summary["bytes"].get<double>(), 8e6);
  EXPECT_GT(summary["bytes"].get<double>(), 5e5);
  EXPECT_LE(summary["surface_error_mm"].get<double>(), 0.1);
  EXPECT_LT(summary["made_ms"].get<double>(), 60'000);  // 0.6 s on an idle laptop
  EXPECT_EQ(HeaderOf(ReadText(folder / "r.html"))["clips"][0]["frames"], 240);
}

TEST_F(ReportCommand, CurvesWithoutMetricsAreThoseOfTheMetricsProtocol) {
  const Clip clip = ClipWithObject("mug", "");
  WriteClip(clip, folder / "clip.npz");
  folder.Run("report clip.npz -o r.html -q");
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

TEST_F(ReportCommand, NamesFromFilesStayText) {
  const std::string hostile = "</script><script>alert(1)</script><!--\"'&\xff";
  Clip clip = DemoClip();
  clip.object.emplace();
  clip.object->name = hostile;
  clip.object->mesh = hostile;
  clip.object->trans.setZero(3, clip.NumFrames());
  clip.object->orient.setZero(3, clip.NumFrames());
  WriteClip(clip, folder / "clip.npz");
  folder.Run("report clip.npz -o r.html -q");
  const std::string page = ReadText(folder / "r.html");
  EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(HeaderOf(page)["clips"][0]["object_name"].get<std::string>(),
              HasSubstr("</script><script>alert(1)</script>"));
  EXPECT_THAT(page, HasSubstr("<title>&lt;/script&gt;&lt;script&gt;alert(1)"));
}

TEST_F(ReportCommand, ShowsTheBodyAloneWhenTheObjectIsMissing) {
  WriteClip(ClipWithObject("nobody_knows_it", "gone.ply"), folder / "clip.npz");
  EXPECT_THAT(folder.Run("report clip.npz -o r.html").err, HasSubstr("gone.ply"));
  const nlohmann::json clip = HeaderOf(ReadText(folder / "r.html"))["clips"][0];
  EXPECT_EQ(clip["has_object"], false);
  EXPECT_THAT(clip["notes"].dump(), HasSubstr("gone.ply"));
  EXPECT_FALSE(clip["series"].contains("contact_ratio"));
}

TEST_F(ReportCommand, ShowsSeveralClips) {
  WriteClip(ClipWithObject("mug", ""), folder / "first.npz");
  WriteClip(ClipWithObject("bottle", ""), folder / "second.npz");
  folder.Run("report first.npz second.npz demo_inspect -o r.html --title Three -q");
  const std::string page = ReadText(folder / "r.html");
  const nlohmann::json header = HeaderOf(page);
  ASSERT_EQ(header["clips"].size(), 3u);
  EXPECT_EQ(header["title"], "Three");
  EXPECT_EQ(header["clips"][1]["name"], "second");
  EXPECT_EQ(header["clips"][2]["has_object"], false);
  EXPECT_THAT(page, HasSubstr("id=\"report-payload-2\""));
}

TEST_F(ReportCommand, ShowsASingleFrame) {
  WriteClip(Slice(ClipWithObject("mug", ""), 0, 1), folder / "clip.npz");
  folder.Run("report clip.npz -o r.html -q");
  EXPECT_EQ(HeaderOf(ReadText(folder / "r.html"))["clips"][0]["frames"], 1);
}

TEST_F(ReportCommand, SaysWhatIsWrong) {
  folder.Run("report -o r.html", 2);
  folder.Run("report demo_drink", 2);
  folder.Fails("report gone.npz -o r.html", 1, "gone.npz");
  folder.Run("report demo_drink -o r.html -q");
  folder.Fails("report demo_drink -o r.html -q", 1, "--force");
}

TEST_F(FitCommand, LeavesAReportUnlessToldNotTo) {
  folder.Run("fit demo_drink mug -o held --end 4 -q");
  const nlohmann::json clip = HeaderOf(ReadText(folder / "held/report.html"))["clips"][0];
  EXPECT_EQ(clip["frames"], 4);
  EXPECT_EQ(clip["has_object"], true);
  EXPECT_TRUE(clip["series"].contains("energy_total"));
  EXPECT_TRUE(clip["series"]["iterations"][0].is_null()) << "the first frame is given, not solved";
  EXPECT_EQ(clip["metrics"]["options"]["object"], "mug");
  folder.Run("fit demo_drink mug -o bare --end 4 --no-report -q");
  EXPECT_FALSE(std::filesystem::exists(folder / "bare/report.html"));
}

#else

TEST_F(ReportCommand, SaysHowToGetThePlayer) {
  folder.Fails("report demo_drink -o r.html", 1, "HOLDFAST_BUILD_PLAYER=ON");
}

#endif

}  // namespace
}  // namespace holdfast
