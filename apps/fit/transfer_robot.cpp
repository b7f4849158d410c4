// SPDX-License-Identifier: MIT
#include "apps/fit/transfer_robot.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/fit/robot_page.h"
#include "apps/result_folder.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/parallel.h"
#include "geometry/render/png.h"
#include "solver/robot/robot.h"
#include "solver/trial/robot_scene.h"

namespace holdfast::apps {
namespace {

constexpr double kLeastKept = 0.5;  // of the contacts: less is no transfer

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

// Contacts that the robot does not keep, and those that it has no part for.
void WarnOfLost(const RobotTransferSetup& setup, const RobotMeasures& measures,
                const CommonOptions& common) {
  std::vector<std::string> parts;
  for (const LostPart& part : LostParts(measures)) {
    parts.push_back(fmt::format("{} ({} of {} frames)", part.part, part.lost, part.frames));
  }
  if (!parts.empty()) {
    Note(common, fmt::format("warning: contact is lost at {}: the robot's part is 5 mm and more "
                             "from the object",
                             fmt::join(parts, ", ")));
  }
  if (setup.contacts_left_out > 0) {
    Note(common, fmt::format("note: {} of {} contacts are of parts that the robot lacks: left out",
                             setup.contacts_left_out, setup.contacts_left_out + measures.contacts));
  }
}

std::string GripText(const RobotMeasures& measures) {
  constexpr double kSlips_mm = 30.0;
  if (std::isnan(measures.give_mm)) return "never holds";
  if (measures.give_mm > kSlips_mm)
    return "may slip: a friction of 0.6 does not hold the weight in every direction";
  return fmt::format("the object's own weight moves it by {:.1f} mm", measures.give_mm);
}

}  // namespace

void AddRobotOptions(CLI::App& command, RobotTransferInput& input) {
  const char* const group = "To a robot's hand";
  CLI::Option* const robot =
      command.add_option("--robot", input.robot, "Robot hand: URDF (.urdf) or MJCF (.xml)")
          ->group(group);
  for (const char* other : {"--object", "--scale", "--body", "--betas"}) {
    robot->excludes(command.get_option(other));
  }
  AddOption(command, "--hand", input.hand, "The hand that is transferred",
            CLI::IsMember({"auto", "right", "left"}))
      ->needs(robot)
      ->group(group);
  command
      .add_option("--correspondence", input.correspondence,
                  "Which of its links is what, as CSV (part,link), in place of what is found")
      ->needs(robot)
      ->group(group);
  command
      .add_flag("--robot-on-path", input.on_path,
                "Keep its wrist where the human's is, within about a centimetre")
      ->needs(robot)
      ->group(group);
}

int RunRobotTransfer(const std::string& clip, const ClipInputOptions& clip_input,
                     const RobotTransferInput& input, const std::string& output,
                     const CommonOptions& common) {
  ResultFolder folder(output, common.force);
  RobotTransferOptions options;
  options.on_path = input.on_path;
  options.threads = NumThreads(common);
  if (input.hand != "auto") {
    options.demonstration.side = input.hand == "left" ? Side::kLeft : Side::kRight;
  }
  if (!input.correspondence.empty()) {
    options.correspondence = ReadCorrespondence(input.correspondence);
    options.correspondence_source = input.correspondence;
  }
  RobotHand robot = ReadRobotHand(input.robot);
  const ClipInput scene = LoadClipInput(clip, clip_input, common);
  const RobotTransferSetup setup = PrepareRobotTransfer(scene, std::move(robot), options);
  for (const std::string& note : setup.robot.notes) Note(common, "note: " + note);
  StageProgress progress(common);
  const RobotTransfer result =
      TransferToRobot(setup, options, [&](const char* stage, int done, int total) {
        progress.Update(stage, done, total);
        return !Interrupted();
      });
  progress.End();
  if (Interrupted()) return kInterrupted;
  const RobotMeasures measures = MeasureTransfer(setup, result.poses, options.threads);
  nlohmann::json metrics = JsonHead("holdfast/transfer-robot/1", common);
  metrics["options"] = {{"clip", clip},
                        {"object", scene.object_source},
                        {"robot", input.robot},
                        {"correspondence", input.correspondence},
                        {"on_path", input.on_path}};
  metrics["robot"] = RobotJson(setup);
  metrics["protocol"] = RobotProtocolJson(options);
  metrics["transfer"] = RobotMeasuresJson(measures);
  metrics["transfer"]["contacts_left_out"] = setup.contacts_left_out;
  const auto frames = static_cast<double>(result.poses.size());
  nlohmann::json summary = metrics;
  summary["output"] = output;
  metrics["per_frame"] = FramesJson(measures);
  WriteRobotMotion(setup, result.poses, measures, folder / "robot.npz");
  WriteRobotTable(setup, result.poses, folder / "robot.csv");
  WriteAtomically(folder / "correspondence.csv", CorrespondenceText(setup));
  RobotPictureOptions sheet, film;
  sheet.columns = input.picture_columns;
  sheet.rows = input.picture_rows;
  film.columns = input.film_columns;
  film.rows = input.film_rows;
  // Two at a time, each with half of the threads: much of the scene is made on one.
  const int half = std::max(1, options.threads / 2);
  sheet.threads = film.threads = half;
  ParallelFor(3, std::min(options.threads, 2), [&](int k) {
    if (k == 0) WriteRobotScene(setup, result.poses, folder / "scene.xml", half);
    if (k == 1) WritePng(RobotFilm(setup, result.poses, film), folder / "film.png");
    if (k == 2) WritePng(RobotSheet(setup, result.poses, sheet), folder / "sheet.png");
  });
  WriteAtomically(folder / "report.html", RobotPage(setup, result.poses, measures, "sheet.png"));
  folder.WriteMetrics(metrics);
  folder.Commit();
  WarnOfLost(setup, measures, common);
  PrintResult(
      common, summary,
      fmt::format(
          "{}: {} frames on {} ({} fingers, {} joints)\n"
          "  contacts           {:.0f} % kept (of {}: within 5 mm of the object), {:.2f} mm and "
          "{:.1f} degrees from the human's, {:.0f} % within 5 mm of them\n"
          "  deepest            {:.2f} mm, {} frames deeper than 2 mm\n"
          "  grip               {}\n"
          "  solved in          {:.2f} ms a frame, the start in {:.0f} ms\n",
          output, result.poses.size(), setup.robot.name, setup.anatomy.fingers.size(),
          setup.robot.NumDofs(), 100.0 * measures.kept_ratio, measures.contacts,
          measures.contact_mm, measures.angle_deg, 100.0 * measures.touching_ratio,
          measures.deepest_mm, measures.frames_deeper_than_2_mm, GripText(measures),
          result.solve_ms / frames, result.start_ms));
  if (measures.kept_ratio >= kLeastKept) return kDone;
  Note(common,
       fmt::format("warning: less than {:.0f} % of the contacts are kept: this robot does not "
                   "hold {} so (exit code 3)",
                   100.0 * kLeastKept, scene.clip.object->name));
  return kFitFault;
}

}  // namespace holdfast::apps
