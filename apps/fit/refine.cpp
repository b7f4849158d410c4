// SPDX-License-Identifier: MIT
#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/fit_job.h"
#include "apps/output.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/surface_distance.h"
#include "solver/body_ik/smooth_body.h"
#include "solver/carry/carry_json.h"
#include "solver/carry/refine.h"

namespace holdfast::apps {
namespace {

struct RefineCommand {
  CommonOptions common;
  ClipInputOptions input;
  std::string clip;
  std::string output;
  RefineOptions refine;
  std::optional<double> smooth_hz;
};

nlohmann::json OrNull(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json();
}

nlohmann::json MeasuredJson(const CarriedQuality& measured) {
  const ContactScore& contact = measured.contact;
  const Unevenness& object = measured.jitter.object;
  nlohmann::json json = HandsJson(measured);
  json.update({{"max_penetration_depth_mm", contact.penetration_max_mm},
               {"mean_max_penetration_depth_mm", contact.penetration_mean_max_mm},
               {"frames_deeper_than_2_mm", contact.deep_frames},
               {"mean_intersection_volume_cm3", contact.voxel_volume_cm3},
               {"frames_in_contact_ratio", OrNull(contact.contact_frames_ratio)},
               {"object_acceleration_m_s2", OrNull(object.acceleration_m_s2)},
               {"object_jerk_m_s3", OrNull(object.jerk_m_s3)},
               {"object_angular_acceleration_rad_s2", OrNull(object.angular_acceleration_rad_s2)},
               {"object_acceleration_against_hand", OrNull(measured.jitter.acceleration_ratio)}});
  return json;
}

std::string Text(const RefineCommand& options, const RefineReport& report) {
  const CarriedQuality &before = report.before, &after = report.after;
  const DataDistance& distance = report.distance;
  const RefineResult& result = report.result;
  std::string text = fmt::format(
      "{}/clip.npz: {} frames refined\n"
      "                          before     after\n"
      "  deeper than 2 mm    {:8d}   {:8d}   frames\n"
      "  deepest, both ways  {:8.2f}   {:8.2f}   mm\n"
      "  intersection        {:8.3f}   {:8.3f}   cm3 (mean; voxels)\n"
      "  in contact          {:8.1f}   {:8.1f}   % of the frames held\n"
      "  object acceleration {:8.2f}   {:8.2f}   m/s2 (mean, while held)\n"
      "  moved from the data {:.2f} mm, {:.2f} degrees (root mean square)\n",
      options.output, result.clip.NumFrames(), before.contact.deep_frames,
      after.contact.deep_frames, before.contact.penetration_max_mm,
      after.contact.penetration_max_mm, before.contact.voxel_volume_cm3,
      after.contact.voxel_volume_cm3, 100.0 * before.contact.contact_frames_ratio.value_or(0.0),
      100.0 * after.contact.contact_frames_ratio.value_or(0.0),
      before.jitter.object.acceleration_m_s2.value_or(0.0),
      after.jitter.object.acceleration_m_s2.value_or(0.0), distance.rms_mm, distance.rms_degrees);
  if (before.hand_frames > 0) {
    const auto percent = [&](int tips) { return 100.0 * tips / (5.0 * before.hand_frames); };
    text += fmt::format(
        "  fingertips touch    {:8.1f}   {:8.1f}   % of fingertips in the frames held\n"
        "  too far, too deep   {:4.0f},{:3.0f}   {:4.0f},{:3.0f}   % of fingertips\n",
        percent(before.tips.touch), percent(after.tips.touch), percent(before.tips.beside),
        percent(before.tips.inside), percent(after.tips.beside), percent(after.tips.inside));
  }
  for (const FingerRepair& hand : report.fingers) {
    if (hand.jump_frames > 0) {
      text += fmt::format("  {} fingers jump in {} frames: {} rotations replaced\n",
                          SideName(hand.side), hand.jump_frames, hand.replaced);
    } else if (!hand.moves && result.clip.NumFrames() > 1) {
      text += fmt::format("  {} fingers do not move in the clip: they were not captured\n",
                          SideName(hand.side));
    }
  }
  for (const RefinedHold& hold : result.holds) {
    text += fmt::format(
        "  frames {}-{}: {} hand, {} (the object moves {:.1f} mm, {:.1f} degrees in the hand)\n",
        hold.begin, hold.end - 1, SideName(hold.side), hold.rigid ? "held firmly" : "slips",
        hold.movement_mm, hold.movement_deg);
  }
  for (const RefinedTouch& touch : result.touches) {
    text += fmt::format("  frames {}-{}: {} hand touches the object and is adjusted\n", touch.begin,
                        touch.end - 1, SideName(touch.side));
  }
  for (const RefinedRest& rest : result.rests) {
    text += fmt::format("  frames {}-{}: at rest, {:.3f} m above the ground\n", rest.begin,
                        rest.end - 1, rest.height_m);
  }
  for (const FrameRange& frames : report.kept) {
    text += fmt::format("  frames {}-{}: unchanged, because refining made the penetration deeper\n",
                        frames.begin, frames.end - 1);
  }
  text += ClearanceText(report.clearance);
  return text + fmt::format("  solved in {:.0f} ms, {} iterations\n", result.report.solve_ms,
                            result.report.iterations);
}

// Loads the clip and checks the requirements of refinement. Throws Error if one is missing.
ClipInput LoadRefinable(const RefineCommand& options) {
  ClipInput input = LoadClipInput(options.clip, options.input, options.common);
  RequireMeters(options.clip, input.clip, *input.body);
  if (!input.clip.object) {
    throw Error(options.clip, "has no object trajectory to refine",
                "Make one with 'holdfast fit', or give a clip with object_trans and object_orient; "
                "smooth a body without an object with --smooth");
  }
  if (!input.object) {
    throw Error(options.clip, "its object's mesh is missing: " + input.object_missing,
                "Give its file with --object");
  }
  if (input.own_object && !SameSurface(*input.own_object, *input.object)) {
    throw Error(options.input.object,
                "is not the object of the clip's trajectory: " + input.clip.object->mesh,
                fmt::format("Leave out --object, or fit the object again: holdfast fit {} {}",
                            options.clip, options.input.object));
  }
  return input;
}

nlohmann::json MetricsOf(const RefineCommand& options, const ClipInput& input,
                         const PreparedObject& object, const RefineReport& report) {
  const RefineResult& result = report.result;
  const bool right = std::ranges::any_of(
      result.clip.holding_hand, [](std::uint8_t bits) { return (bits & kHoldsRight) != 0; });
  nlohmann::json metrics = JsonHead("holdfast/refine/1", options.common);
  RefineOptions refine = options.refine;
  metrics["options"] = OptionsJson(OptionsOf(refine));
  metrics["options"].update(WeightsJson(refine.fit));
  metrics["options"].update({{"clip", options.clip},
                             {"object", input.object_source},
                             {"object_scale", input.object_scale}});
  metrics["protocol"] =
      ProtocolJson(refine.protocol, object.solid,
                   HandModel(input.body, input.betas, right ? Side::kRight : Side::kLeft));
  metrics["before"] = MeasuredJson(report.before);
  metrics["after"] = MeasuredJson(report.after);
  metrics["distance_to_data"] = {{"rms_mm", report.distance.rms_mm},
                                 {"rms_deg", report.distance.rms_degrees}};
  metrics["fingers"] = FingersJson(report.fingers);
  metrics["ball"] = report.ball;
  metrics.update(HoldsJson(result));
  metrics["kept"] = KeptJson(report.kept);
  metrics["clearance"] = ClearanceJson(report.clearance);
  metrics["solve"] = {{"iterations", result.report.iterations},
                      {"converged", result.report.converged},
                      {"cost_before", result.report.cost_before},
                      {"cost_after", result.report.cost_after}};
  return metrics;
}

nlohmann::json PerFrameJson(const RefineReport& report) {
  nlohmann::json depth_before = nlohmann::json::array(), depth_after = nlohmann::json::array();
  for (const auto& frame : report.before.contact.frames) {
    depth_before.push_back(frame.penetration_mm);
  }
  for (const auto& frame : report.after.contact.frames) depth_after.push_back(frame.penetration_mm);
  return {{"holding_hand", report.result.clip.holding_hand},
          {"penetration_depth_before_mm", depth_before},
          {"penetration_depth_mm", depth_after},
          {"distance_to_data_mm", report.distance.mm},
          {"distance_to_data_deg", report.distance.degrees}};
}

// A body without an object.
int Smooth(const RefineCommand& options) {
  ResultFolder folder(options.output, options.common.force);
  const LoadedClip input = LoadClip(options.clip, LoadBody(options.input.body), options.common);
  RequireMeters(options.clip, input.clip, *input.body.model);
  SmoothOptions smooth;
  smooth.cutoff_hz = *options.smooth_hz;
  smooth.threads = NumThreads(options.common);
  const auto done = RunStaged(options.common, [&](const StagedProgress& progress) {
    return SmoothBody(input.clip, input.body, smooth, options.clip, progress);
  });
  if (!done) return kInterrupted;
  const SmoothedBody& smoothed = *done;
  const SmoothReport& report = smoothed.report;
  for (const std::string& note : report.notes) Note(options.common, "warning: " + note);
  const auto json = [](const BodyJitter& jitter) {
    return nlohmann::json{{"jerk_m_s3", jitter.jerk_m_s3}, {"foot_skate_mm_s", jitter.skate_mm_s}};
  };
  nlohmann::json metrics = JsonHead("holdfast/smooth/1", options.common);
  metrics["options"] = {{"clip", options.clip}, {"smooth", smooth.cutoff_hz}};
  metrics["before"] = json(report.before);
  metrics["after"] = json(report.after);
  metrics["moved_mm"] = report.moved_mm;
  metrics["outliers"] = report.outliers;
  metrics["feet_pinned"] = report.feet_pinned;
  metrics["max_foot_correction_mm"] = 1e3 * report.max_foot_correction_m;
  WriteClip(smoothed.clip, folder / "clip.npz");
  folder.WriteMetrics(metrics);
  folder.Commit();
  nlohmann::json summary = metrics;
  summary["output"] = options.output;
  PrintResult(
      options.common, summary,
      fmt::format("{}/clip.npz: {} frames smoothed, cut-off at {:g} Hz\n"
                  "                       before     after\n"
                  "  jerk              {:8.1f}  {:8.1f}   m/s3 (mean of 22 joints)\n"
                  "  feet in contact   {:8.1f}  {:8.1f}   mm/s\n"
                  "  moved by {:.1f} mm (root mean square); outliers replaced: {}; feet {}\n",
                  options.output, smoothed.clip.NumFrames(), smooth.cutoff_hz,
                  report.before.jerk_m_s3, report.after.jerk_m_s3, report.before.skate_mm_s,
                  report.after.skate_mm_s, report.moved_mm, report.outliers,
                  report.feet_pinned ? "pinned" : "not pinned"));
  return kDone;
}

int Refine(const RefineCommand& options) {
  if (options.smooth_hz) return Smooth(options);
  ResultFolder folder(options.output, options.common.force);
  const ClipInput input = LoadRefinable(options);
  RefineOptions refine = options.refine;
  refine.threads = NumThreads(options.common);
  const auto object = std::make_shared<const PreparedObject>(
      PrepareObject(input.object_in_clip
                        ? ObjectOfMesh(*input.object, input.clip.object->name, input.object_source)
                        : LoadObject(input.object_source, input.object_scale),
                    refine.object_vertices, refine.threads));
  for (const std::string& note : object->notes) Note(options.common, "note: " + note);
  StageProgress progress(options.common);
  const RefineReport report = NamingSource("the clip", options.clip, [&] {
    return RefineCarried(input.clip, {input.body, input.betas}, *object, refine,
                         [&](const char* stage, int done, int total) {
                           progress.Update(stage, done, total);
                           return !Interrupted();
                         });
  });
  progress.End();
  if (Interrupted()) return kInterrupted;
  RequireRefined(report, options.clip, input.object_source);
  nlohmann::json metrics = MetricsOf(options, input, *object, report);
  nlohmann::json summary = metrics;
  summary["output"] = options.output;
  metrics["per_frame"] = PerFrameJson(report);
  WriteClipFiles(report.result.clip, object->object.mesh, folder / "");
  folder.WriteMetrics(metrics);
  folder.Commit();
  PrintResult(options.common, summary, Text(options, report));
  if (!report.contact_kept) {
    Note(options.common,
         fmt::format("warning: contact is lost: the hand is in contact in {:.1f} % of the frames "
                     "held, before in {:.1f} %",
                     100.0 * report.after.contact.contact_frames_ratio.value_or(0.0),
                     100.0 * report.before.contact.contact_frames_ratio.value_or(0.0)));
  }
  if (const ContactScore& after = report.after.contact; after.deep_frames > 0) {
    Note(options.common,
         fmt::format("warning: hand and object still penetrate by more than {:g} mm in {} of {} "
                     "frames, by up to {:.1f} mm",
                     kDeep_mm, after.deep_frames, report.result.clip.NumFrames(),
                     after.penetration_max_mm));
  }
  for (const std::string& warning : ClearanceWarnings(report.clearance)) {
    Note(options.common, "warning: " + warning);
  }
  return report.sound ? kDone : kFitFault;
}

}  // namespace

void AddRefineCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<RefineCommand>();
  CLI::App* command = app.add_subcommand(
      "refine",
      "Refine a clip that has an object trajectory: reduce penetration, jitter and lost contact; "
      "or smooth the body of a clip without an object");
  command->add_option("clip", options->clip, kClipHelp)->required();
  command
      ->add_option("-o,--output", options->output,
                   "Output folder: clip.npz, object.ply, metrics.json with values before and after")
      ->required();
  AddClipInputOptions(*command, options->input);
  AddOption(*command, "--smooth", options->smooth_hz,
            "Smooth the body of a clip without an object, with this cut-off frequency, Hz; feet in "
            "contact with the ground are pinned",
            CLI::Range(0.1, 100.0));
  AddOptions(*command, OptionsOf(options->refine));
  AddCommonOptions(*command, options->common, true,
                   "  holdfast refine captured.npz --object mug.obj -o clean\n"
                   "  holdfast refine held -o refined --hand right --json\n"
                   "  holdfast refine estimated.npz -o smooth --smooth 5\n");
  command->callback([options, &exit_code] { exit_code = Refine(*options); });
}

}  // namespace holdfast::apps
