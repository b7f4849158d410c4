// SPDX-License-Identifier: MIT
#include "apps/fit/transfer_robot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/charts.h"
#include "apps/output.h"
#include "geometry/inspect/inspection.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/decimate.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/parallel.h"
#include "geometry/render/image.h"
#include "solver/robot/contact_file.h"
#include "solver/robot/robot.h"
#include "solver/trial/robot_scene.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kMinKept = 0.5;          // minimum fraction of kept contacts of a transfer
constexpr int kEditedVertices = 5'000;    // maximum, of the object in the contact editor
constexpr std::size_t kEditedFrames = 8;  // maximum, in which the contact editor shows the hand

nlohmann::json RobotJson(const RobotTransferSetup& setup) {
  nlohmann::json parts = nlohmann::json::object();
  for (const PartLink& row : PartLinksOf(setup.robot, setup.anatomy)) {
    parts[row.part].push_back(row.link);
  }
  return {{"name", setup.robot.name},
          {"file", setup.robot.source},
          {"side", SideName(setup.anatomy.side)},
          {"fingers", setup.anatomy.fingers.size()},
          {"joints", setup.robot.NumDofs()},
          {"parts", parts},
          {"notes", setup.robot.notes}};
}

nlohmann::json FramesJson(const RobotMeasures& measures) {
  nlohmann::json depth = nlohmann::json::array(), contact = depth, angle = depth;
  for (const RobotFrameMeasure& frame : measures.frames) {
    depth.push_back(frame.Deepest_mm());
    const bool none = frame.contacts.empty();
    contact.push_back(none ? nlohmann::json() : nlohmann::json(frame.ContactDistance_mm()));
    angle.push_back(none ? nlohmann::json() : nlohmann::json(frame.ContactAngle_deg()));
  }
  return {{"penetration_depth_mm", depth},
          {"contact_distance_mm", contact},
          {"contact_normal_deg", angle}};
}

std::string CorrespondenceText(const RobotTransferSetup& setup) {
  std::string text = "part,link\n";
  for (const PartLink& row : PartLinksOf(setup.robot, setup.anatomy)) {
    text += fmt::format("{},{}\n", row.part, row.link);
  }
  return text;
}

// Warns of contacts lost by the robot, and of contacts for which it has no part.
void WarnOfLost(const RobotTransferSetup& setup, const RobotMeasures& measures,
                const CommonOptions& common) {
  const std::vector<std::string> parts = LostParts(measures);
  if (!parts.empty()) {
    Note(common,
         fmt::format(
             "warning: contact is lost at {}: the robot link is 5 mm or more from the object",
             fmt::join(parts, ", ")));
  }
  if (setup.contacts_left_out > 0) {
    Note(common,
         fmt::format("note: {} of {} contacts are ignored: the robot does not have these parts",
                     setup.contacts_left_out, setup.contacts_left_out + measures.contacts));
  }
}

std::string GripText(const RobotMeasures& measures) {
  constexpr double kSlips_mm = 30.0;
  if (std::isnan(measures.give_mm)) return "never holds";
  if (measures.give_mm > kSlips_mm)
    return "may slip: friction 0.6 does not hold the weight in every direction";
  return fmt::format("the object's own weight moves it by {:.1f} mm", measures.give_mm);
}

}  // namespace

void AddRobotOptions(CLI::App& command, RobotTransferInput& input) {
  const char* const group = "Target robot hand";
  CLI::Option* const robot =
      command
          .add_option(
              "--robot", input.robots,
              "Robot hand: URDF (.urdf) or MJCF (.xml). With two files, one of a right and one of "
              "a left hand, both hands of the clip are transferred")
          ->expected(1, 2)
          ->group(group);
  for (const char* other : {"--object", "--scale", "--body", "--betas"}) {
    robot->excludes(command.get_option(other));
  }
  command
      .add_option(
          "--correspondence", input.correspondence,
          "CSV table part,link that assigns robot links to parts of the human hand, in place of "
          "the detected assignment")
      ->needs(robot)
      ->group(group);
  command
      .add_option("--contacts", input.options.contacts,
                  "File of contacts that replace the clip's: an edited contacts.json of an earlier "
                  "transfer")
      ->needs(robot)
      ->group(group);
  const OptionTable table = OptionsOf(input.options);
  AddOptions(command, table);
  for (const Option& option : table.All()) command.get_option(option.flag)->needs(robot);
}

namespace {

// A clip on one robot hand.
struct OnRobot {
  RobotTransferSetup setup;
  RobotTransfer result;
  RobotMeasures measures;

  RobotInScene InScene() const { return {&setup, &result.poses}; }
};

// Reads the robots; of two, the side of each, which is that of its shape, else the other's
// opposite.
std::vector<std::pair<RobotHand, std::optional<Side>>> ReadRobots(const RobotTransferInput& input) {
  std::vector<std::pair<RobotHand, std::optional<Side>>> robots;
  for (const std::string& file : input.robots) {
    robots.emplace_back(ReadRobotHand(file), input.options.side);
  }
  if (robots.size() < 2) return robots;
  if (input.options.side) {
    throw Error("--hand", "with two robots both hands are transferred", "Leave it out");
  }
  for (const auto& [flag, file] : {std::pair("--correspondence", &input.correspondence),
                                   {"--contacts", &input.options.contacts}}) {
    if (!file->empty()) {
      throw Error(flag, "is for one robot", "Transfer one hand at a time (--hand)");
    }
  }
  const RobotAnatomy second = FindAnatomy(robots[1].first, Side::kLeft);
  const Side first = FindAnatomy(robots[0].first, OtherSide(second.side)).side;
  robots[0].second = first;
  robots[1].second = FindAnatomy(robots[1].first, OtherSide(first)).side;
  if (robots[1].second == first) {
    throw Error("--robot",
                fmt::format("{} and {} are both {} hands", input.robots[0], input.robots[1],
                            SideName(first)),
                "Give a right and a left hand");
  }
  return robots;
}

// The command that uses edited contacts.
std::string CommandWithContacts(const std::string& clip, const RobotTransferInput& input,
                                const RobotTransferSetup& setup) {
  std::string command = fmt::format("holdfast transfer {} --robot {}", ShellWord(clip),
                                    ShellWord(setup.robot.source));
  if (input.robots.size() > 1 || input.options.side) {
    command += fmt::format(" --hand {}", SideName(setup.anatomy.side));
  }
  if (!input.correspondence.empty()) {
    command += " --correspondence " + ShellWord(input.correspondence);
  }
  if (input.options.on_path) command += " --robot-on-path";
  return command + " --contacts contacts.json -o edited";
}

// Writes all files of one hand but scene and film.
void WriteHand(const OnRobot& hand, const std::string& clip, const RobotTransferInput& input,
               const std::string& sequence, int threads, const fs::path& folder) {
  const auto& [setup, result, measures] = hand;
  fs::create_directories(folder);
  WriteRobotMotion(setup, result.poses, measures, folder / "robot.npz");
  WriteRobotTable(setup, result.poses, folder / "robot.csv");
  WriteMesh(setup.object, folder / "object.obj");
  WriteMotionV1(setup, result.poses, measures, sequence, "object.obj", folder / "motion_v1.npz");
  WriteAtomically(folder / "correspondence.csv", CorrespondenceText(setup));
  WriteContacts(setup.demonstration, folder / "contacts.json");
  WritePng(RobotSheet(setup, result.poses, input.picture_columns, input.picture_rows, threads),
           folder / "sheet.png");
  WriteAtomically(folder / "report.html", RobotPage(setup, result.poses, measures, "sheet.png",
                                                    CommandWithContacts(clip, input, setup)));
}

nlohmann::json HandJson(const OnRobot& hand) {
  nlohmann::json transfer = RobotMeasuresJson(hand.measures);
  transfer["contacts_left_out"] = hand.setup.contacts_left_out;
  return {{"robot", RobotJson(hand.setup)}, {"transfer", transfer}};
}

std::string HandText(const OnRobot& hand, const std::string& output) {
  const RobotMeasures& measures = hand.measures;
  const auto frames = static_cast<double>(hand.result.poses.size());
  return fmt::format(
      "{}: {} frames on {} ({} fingers, {} joints)\n"
      "  contacts           {:.0f} % of {} kept (within 5 mm of the object); mean distance "
      "{:.2f} mm and {:.1f} degrees from the human's contacts, {:.0f} % within 5 mm of them\n"
      "  deepest            {:.2f} mm, {} frames deeper than 2 mm\n"
      "  hold               {}\n"
      "  solved in          {:.2f} ms per frame, first frame {:.0f} ms\n",
      output, hand.result.poses.size(), hand.setup.robot.name, hand.setup.anatomy.fingers.size(),
      hand.setup.robot.NumDofs(), 100.0 * measures.kept_ratio, measures.contacts,
      measures.contact_mm, measures.angle_deg, 100.0 * measures.touching_ratio, measures.deepest_mm,
      measures.frames_deeper_than_2_mm, GripText(measures), hand.result.solve_ms / frames,
      hand.result.start_ms);
}

// The page of two hands, which links to theirs.
std::string PageOfBoth(const std::vector<OnRobot>& hands) {
  const std::string title = "Both hands";
  std::string html = PageHead(title, title, "img { max-width: 100%; }") + "<ul>";
  for (const OnRobot& hand : hands) {
    html += fmt::format("<li><a href=\"{0}/report.html\">{0} hand: {1}</a></li>",
                        SideName(hand.setup.anatomy.side), EscapeHtml(hand.setup.robot.name));
  }
  return html + "</ul>\n<img src=\"film.png\" alt=\"Frames of the clip\">\n</body></html>\n";
}

}  // namespace

int RunRobotTransfer(const std::string& clip, const ClipInputOptions& clip_input,
                     const RobotTransferInput& input, const std::string& output,
                     const CommonOptions& common) {
  ResultFolder folder(output, common.force);
  RobotTransferOptions options = input.options;
  options.threads = NumThreads(common);
  auto robots = ReadRobots(input);
  if (!input.correspondence.empty()) {
    options.correspondence = ReadCorrespondence(input.correspondence);
    options.correspondence_source = input.correspondence;
  }
  const ClipInput scene = LoadClipInput(clip, clip_input, common);
  // The convex pieces of the object for MuJoCo depend on nothing else and take longest.
  std::future<TrialSolid> solid;
  if (scene.object) {
    solid = std::async(options.threads > 1 ? std::launch::async : std::launch::deferred, [&scene] {
      return MakeTrialSolid(*scene.object, SignedDistance(*scene.object), TrialProtocol());
    });
  }
  std::vector<OnRobot> hands;
  for (auto& [robot, side] : robots) {
    options.side = side;
    hands.push_back({PrepareRobotTransfer(scene, std::move(robot), options), {}, {}});
    const RobotTransferSetup& setup = hands.back().setup;
    for (const std::string& note : setup.robot.notes) Note(common, "note: " + note);
  }
  StageProgress progress(common);
  for (OnRobot& hand : hands) {
    hand.result = TransferToRobot(hand.setup, options, [&](const char* stage, int done, int total) {
      progress.Update(stage, done, total);
      return !Interrupted();
    });
    if (Interrupted()) break;
    hand.measures = MeasureTransfer(hand.setup, hand.result.poses, options.threads);
  }
  progress.End();
  if (Interrupted()) return kInterrupted;

  const bool both = hands.size() > 1;
  const std::string sequence = fs::path(output).filename().string();
  nlohmann::json metrics = JsonHead("holdfast/transfer-robot/1", common);
  metrics["options"] = {
      {"clip", clip},
      {"object", scene.object_source},
      {"robot", both ? nlohmann::json(input.robots) : nlohmann::json(input.robots[0])},
      {"correspondence", input.correspondence},
      {"contacts", input.options.contacts},
      {"on_path", options.on_path}};
  metrics["protocol"] = RobotProtocolJson();
  std::vector<RobotInScene> in_scene;
  std::string text;
  for (const OnRobot& hand : hands) {
    const std::string side(SideName(hand.setup.anatomy.side));
    in_scene.push_back(hand.InScene());
    text += HandText(hand, both ? output + ", " + side : output);
    if (both) {
      metrics["hands"][side] = HandJson(hand);
    } else {
      metrics.update(HandJson(hand));
    }
  }
  nlohmann::json summary = metrics;
  summary["output"] = output;
  for (const OnRobot& hand : hands) {
    (both ? metrics["hands"][SideName(hand.setup.anatomy.side)] : metrics)["per_frame"] =
        FramesJson(hand.measures);
  }
  // Two at a time with half of the threads each, since much of the scene is single-threaded.
  const int half = std::max(1, options.threads / 2);
  const int count = static_cast<int>(hands.size());
  ParallelFor(2 + count, std::min(options.threads, 2), [&](int k) {
    if (k == 0) {
      WritePng(RobotFilm(in_scene, input.film_columns, input.film_rows, half), folder / "film.png");
    } else if (k <= count) {
      const OnRobot& hand = hands[static_cast<std::size_t>(k - 1)];
      const std::string side(SideName(hand.setup.anatomy.side));
      WriteHand(hand, clip, input, both ? sequence + "_" + side : sequence, half,
                folder / (both ? side.c_str() : ""));
    } else {
      WriteRobotScene(in_scene, solid.get(), folder / "scene.xml");
    }
  });
  if (both) WriteAtomically(folder / "report.html", PageOfBoth(hands));
  folder.WriteMetrics(metrics);
  folder.Commit();
  for (const OnRobot& hand : hands) WarnOfLost(hand.setup, hand.measures, common);
  PrintResult(common, summary, text);
  if (std::ranges::all_of(
          hands, [](const OnRobot& hand) { return hand.measures.kept_ratio >= kMinKept; })) {
    return kDone;
  }
  Note(common, fmt::format("warning: less than {:.0f} % of the contacts are kept: this robot "
                           "cannot hold {} in this way (exit code 3)",
                           100.0 * kMinKept, scene.clip.object->name));
  return kFitFault;
}

namespace {

constexpr std::array<const char*, 6> kJointColors = {"#3b82c4", "#d4743a", "#4c9f70",
                                                     "#a55ec0", "#c2a83e", "#888888"};

std::string NumbersTable(const RobotMeasures& measures) {
  const auto frames = static_cast<double>(measures.frames.size());
  return HtmlTable(
      {"", ""},
      {{"contacts kept (within 5 mm of the object)", Percent(measures.kept_ratio, 0)},
       {"mean distance from the human's contacts", fmt::format("{:.2f} mm", measures.contact_mm)},
       {"contacts within 5 mm of the human's", Percent(measures.touching_ratio, 0)},
       {"mean angle between normals", fmt::format("{:.1f}°", measures.angle_deg)},
       {"deepest penetration of the clip", fmt::format("{:.2f} mm", measures.deepest_mm)},
       {"frames deeper than 2 mm", Percent(measures.frames_deeper_than_2_mm / frames)},
       {"deepest self-penetration of links", fmt::format("{:.2f} mm", measures.self_mm)}});
}

std::string FramesChart(const RobotMeasures& measures) {
  LineChart chart{"Distance and depth", "frame", "mm", {}};
  ChartLine distance{"mean contact distance", "#3b82c4", {}};
  ChartLine depth{"deepest", "#c0392b", {}};
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

// One chart per finger. Mimic joints follow their leaders and are not drawn.
std::string JointCharts(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses) {
  std::map<std::string, LineChart> charts;
  const auto add = [&](const std::string& title, const std::vector<int>& links) {
    for (const int link : links) {
      const RobotLink& moved = setup.robot.links[static_cast<std::size_t>(link)];
      if (moved.dof < 0) continue;
      const RobotDof& dof = setup.robot.dofs[static_cast<std::size_t>(moved.dof)];
      if (dof.name != moved.joint) continue;  // a mimic joint
      LineChart& chart = charts[title];
      chart.title = title;
      chart.x_label = "frame";
      chart.y_label = "fraction of its range";
      ChartLine line{dof.name, kJointColors[chart.lines.size() % kJointColors.size()], {}};
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

// The object, with fewer vertices if it has many and can be decimated.
TriangleMesh EditedObject(const TriangleMesh& object) {
  try {
    return object.NumVertices() > kEditedVertices
               ? Decimate(object, {.vertices = kEditedVertices, .samples = 0}).mesh
               : object;
  } catch (const Error&) {
    return object;
  }
}

std::string ContactSection(const RobotTransferSetup& setup, const std::string& command) {
  const std::vector<HumanFrame>& frames = setup.demonstration.frames;
  const auto first = std::ranges::find_if(frames, &HumanFrame::holds);
  const auto last = std::find_if(frames.rbegin(), frames.rend(),
                                 [](const HumanFrame& frame) { return frame.holds; });
  const auto hold = std::array{first - frames.begin(), frames.rend() - last - 1};
  const nlohmann::json file = ContactsJson(setup.demonstration);
  std::set<int> begins = {static_cast<int>(hold[0])};
  for (const nlohmann::json& contact : file["contacts"])
    begins.insert(contact["frames"][0].get<int>());
  const std::vector<int> all(begins.begin(), begins.end());
  std::vector<int> shown;
  for (std::size_t k = 0; k < all.size(); k += (all.size() + kEditedFrames - 1) / kEditedFrames) {
    shown.push_back(all[k]);
  }
  const Eigen::Vector3d up = first->world_from_object.linear().row(2);
  nlohmann::json header = {{"file", file},
                           {"frames", shown},
                           {"hold", hold},
                           {"up", {up.x(), up.y(), up.z()}},
                           {"command", command}};
  for (int part = 0; part < kNumHandParts; ++part) {
    header["parts"].push_back(
        {{"name", HandPartName(part)}, {"on_robot", !setup.pads.Empty(part)}});
  }
  ReportPayload payload;
  const auto add = [&](const char* name, const TriangleMesh& mesh) {
    const auto v = mesh.vertices.reshaped();
    const auto f = mesh.faces.reshaped();
    payload.Add(fmt::format("{}_vertices", name), std::vector<float>(v.begin(), v.end()), 3);
    payload.Add(fmt::format("{}_faces", name), std::vector<std::uint32_t>(f.begin(), f.end()), 3);
  };
  add("object", EditedObject(setup.object));
  TriangleMesh hands{Eigen::Matrix3Xd(3, 0), setup.human->Surface().Faces()};
  for (const int t : shown) Append({frames[static_cast<std::size_t>(t)].vertices, {}}, hands);
  add("hand", hands);
  std::vector<std::uint8_t> parts;
  for (int v = 0; v < setup.human->NumVertices(); ++v) {
    parts.push_back(static_cast<std::uint8_t>(setup.landmarks->PartOf(v)));
  }
  payload.Add("hand_part", parts, 1);
  return ContactEditor(header, payload);
}

}  // namespace

std::string RobotPage(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                      const RobotMeasures& measures, const std::string& sheet,
                      const std::string& command) {
  const std::string title = fmt::format("{}: {} frames", setup.robot.name, poses.size());
  std::string html = PageHead(title, title,
                              std::string(kTableStyle) + kChartStyle +
                                  "td, th { padding: .2rem .6rem; text-align: left; }"
                                  "img { max-width: 100%; }");
  html += NumbersTable(measures) + FramesChart(measures);
  html +=
      fmt::format("<h2>Robot and human hand</h2>\n<img src=\"{}\" alt=\"Frames of the hold\">\n",
                  EscapeHtml(sheet));
  if (HasReportPlayer()) html += ContactSection(setup, command);
  html += "<h2>Joints</h2>\n" + JointCharts(setup, poses);
  html += "<h2>Links by part of the hand</h2>\n" + PartsTable(setup);
  if (!setup.robot.notes.empty()) {
    html += "<h2>Notes</h2>\n<ul>";
    for (const std::string& note : setup.robot.notes) html += "<li>" + EscapeHtml(note) + "</li>";
    html += "</ul>\n";
  }
  return html + "</body></html>\n";
}

}  // namespace holdfast::apps
