// SPDX-License-Identifier: MIT
#include "solver/carry/run_fit.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "solver/carry/carry_json.h"

namespace holdfast {
namespace {

void AddGraspOptions(FitJob& job, OptionTable& table) {
  table.Group("The grasp");
  AddStyleOption(
      table, "style", job.carry.style,
      "Style of a new grasp: power, precision, handle (fingers through the handle), or auto");
  AddUseOption(table, job.carry.use);
  table.Flag("regrasp", job.regrasp, "Make a new grasp even if the clip has one of this object");
  table.Flag("keep_grasp", job.keep_grasp,
             "Keep the clip's own grasp and trajectory even if they belong to another object");
  table.Text("first_grasp", job.first_grasp,
             "File with a hand that grasps this object, used as the first grasp: a clip (written "
             "by 'holdfast grasp'), or parameters of a body (from GOAL) or of a hand (from "
             "GrabNet). If it has no object pose, the hand is assumed to be in the object frame");
  table.Text("first_grasp_body", job.first_grasp_body,
             "Body model of --first-grasp, such as MANO_RIGHT.pkl; default: the clip's");
}

void AddEnergyOptions(FitOptions& fit, OptionTable& table) {
  table.Group("Terms of the energy");
  AddWeightOptions(table, fit,
                   [](const EnergyTermInfo& info) { return info.term != EnergyTerm::kSupport; });
  table.Flag("slip", fit.slip,
             "Let contacts slide on the surface (E_s instead of E_d and E_c), for objects turned "
             "or squeezed in the fingers");
  table.Number("contact_threshold", "mm", ScaledNumber{&fit.contact_threshold_m, 1e-3}, kPositive,
               "Contact threshold tau, mm: hand and object vertices that are closer than this at "
               "the start of the hold are in contact");
  table.Choice("normalize", fit.normalize,
               {{"sum", Normalization::kSum}, {"mean", Normalization::kMean}},
               "Normalization of E_c and E_t: sum (as in the IMoS paper), or mean over pairs and "
               "coordinates (as in the IMoS authors' code). E_d is always a sum");
}

void AddSolverOptions(FitJob& job, OptionTable& table) {
  FitOptions& fit = job.carry.fit;
  table.Group("The solver");
  table.Number("object_vertices", "", job.object_vertices, {4, 100'000},
               "Vertices that the object is simplified to");
  table.Choice("solve", fit.whole_clip, {{"sequential", false}, {"batch", true}},
               "sequential: frame by frame; batch: sequential, then all frames jointly with an "
               "acceleration penalty");
  table.Number("max_iterations", "", fit.max_iterations, {1, 10'000},
               "Maximum number of iterations per frame");
  table.Choice("precision", fit.precision,
               {{"single", PairPrecision::kSingle}, {"double", PairPrecision::kDouble}},
               "Floating-point precision of the loop over hand-object pairs");
}

void AddHandOverOptions(CarryOptions& carry, OptionTable& table) {
  table.Group("The hand-over");
  table.Flag("hand_over", carry.hand_over, "Fit an object that changes hands");
  table.Frames("switch_frames", "--switch", carry.handover.switch_frames,
               "Frames where the object changes hands, ascending: 60,140. Default: detected from "
               "the motion of the clip's object; if the clip has no object, where the hands meet");
  table.Choice("first_hand", carry.handover.first_hand,
               {{"auto", std::nullopt}, {"right", Side::kRight}, {"left", Side::kLeft}},
               "Hand that holds the object first");
  table.Number("max_switches", "", carry.handover.max_switches, {1, 100},
               "Maximum number of detected hand-overs");
  table.Number("dwell", "s", carry.handover.dwell_s, {0.0, 10.0},
               "Approximate time that both hands hold the object around a frame of --switch, s");
}

// Reads --first-grasp.
void ReadGiven(const FitJob& job, const ClipBody& body, CarryOptions& options) {
  const bool both = options.hands == GraspHands::kBoth;
  if (job.regrasp || job.keep_grasp || options.place || options.drink || both) {
    throw Error("--first-grasp",
                fmt::format("excludes {}", job.regrasp      ? "--regrasp"
                                           : job.keep_grasp ? "--keep-grasp"
                                           : options.place  ? "--at, --region and --avoid"
                                           : options.drink  ? "--drink"
                                                            : "--hand both"),
                "Give one of them");
  }
  std::optional<Side> side = options.handover.first_hand;
  if (options.hands == GraspHands::kRight) side = Side::kRight;
  if (options.hands == GraspHands::kLeft) side = Side::kLeft;
  options.given = ReadGivenGrasp(
      job.first_grasp,
      job.first_grasp_body.empty() ? body.model : BodyModel::Load(job.first_grasp_body), side);
  if (options.hand_over) {
    options.handover.first_hand = options.given->side;
  } else {
    options.hands = options.given->side == Side::kRight ? GraspHands::kRight : GraspHands::kLeft;
  }
}

// Selects the source of the grasp. Rejects objects that no hand can hold before any preparation.
void ChooseGrasp(const FitJob& job, const FitInput& input, CarryOptions& options,
                 std::vector<std::string>& notes) {
  const Clip& clip = input.motion.clip;
  options.grasp = GraspSource::kClipsOrNew;
  if (job.keep_grasp || input.made) options.grasp = GraspSource::kClips;
  if (job.regrasp || options.place || options.given) options.grasp = GraspSource::kNew;
  if (options.grasp == GraspSource::kClipsOrNew) {
    try {
      if (ClipObject own = FindClipObject(input.motion); !own.by_name) {
        options.clip_object = std::move(own.mesh);
      }
    } catch (const Error& error) {  // the motion is usable all the same
      notes.push_back(
          fmt::format("{}: {}: the clip's grasp is matched to {} by the object's name (--regrasp "
                      "makes a new grasp)",
                      error.Where(), error.Problem(), job.object));
    }
    if (input.motion.change) options.other_body = input.motion.change->from;
    if (const std::string why = WhyNewGrasp(clip, *input.object, job.object, options);
        !why.empty()) {
      notes.push_back(why + ": making a new grasp (--keep-grasp keeps the clip's)");
    }
  }
  const bool needed = NeedsGrasp(clip, *input.object, options);
  options.grasp = needed ? GraspSource::kNew : GraspSource::kClips;
  constexpr std::uint8_t kBothHands = kHoldsRight | kHoldsLeft;
  if (needed) {
    RequireGraspable(*input.object, options.hands == GraspHands::kBoth ||
                                        std::ranges::count(clip.holding_hand, kBothHands) > 0);
  }
}

void CutToRange(const FitJob& job, Clip& clip) {
  const int end = job.end < 0 ? clip.NumFrames() : std::min(job.end, clip.NumFrames());
  if (job.start >= end) {
    throw Error(
        job.clip,
        fmt::format("has {} frames: no frames between {} and {}", clip.NumFrames(), job.start, end),
        "Give --start and --end within the clip");
  }
  if (job.start > 0 || end < clip.NumFrames()) clip = Slice(clip, job.start, end);
}

// Whether a fit without --drink is one of a person who drinks from the object.
bool IsDrink(const FitJob& job, const FitRun& run, const Clip& clip) {
  const CarryOptions& options = run.options;
  const bool other = options.drink || options.hand_over || options.place || options.given ||
                     options.style || options.use || options.hands == GraspHands::kBoth;
  if (job.no_drink || other || options.recipe != FitRecipe::kHoldfast ||
      options.grasp != GraspSource::kNew) {
    return false;
  }
  const std::optional<Side> hand = DrinkingHand(clip, run.body, *run.object);
  if (!hand || options.hands == GraspHands::kAuto) return hand.has_value();
  return options.hands == (*hand == Side::kRight ? GraspHands::kRight : GraspHands::kLeft);
}

void RequireCarried(const FitJob& job, const CarryOptions& options, const CarryReport& report) {
  if (report.status == CarryStatus::kNoGrasp) {
    const std::uint8_t first = report.holding.hands.front();
    const std::string other =
        report.grasp.both ? "a first frame with both hands in front (--start)"
                          : fmt::format("--hand {}", first == kHoldsLeft ? "right" : "left");
    throw FitFailure(fmt::format("{}: {}. Try {}, {}", job.object, report.grasp.status, other,
                                 options.place   ? "or another place (--at, --region, --avoid)"
                                 : options.style ? "or another --style"
                                                 : "or another object size (--object-scale)"));
  }
  if (report.status == CarryStatus::kNoContact) {
    throw FitFailure(fmt::format(
        "{}: {} touches no hand in any frame, so nothing is written. {}", job.clip, job.object,
        report.grasp.made ? "Try another --hand, or another first frame (--start)"
                          : "Its trajectory belongs to another object, scale or body; --regrasp "
                            "makes a new grasp"));
  }
}

// Describes the hands that hold in some frame.
std::string_view HandsText(const HeldFrames& frames) {
  if (frames.left + frames.both == 0) return "the right hand";
  if (frames.right + frames.both == 0) return "the left hand";
  return frames.right + frames.left == 0 ? "both hands" : "the right and the left hand";
}

}  // namespace

OptionTable OptionsOf(FitJob& job) {
  CarryOptions& carry = job.carry;
  OptionTable table;
  table.Choice("hand", carry.hands,
               {{"auto", GraspHands::kAuto},
                {"right", GraspHands::kRight},
                {"left", GraspHands::kLeft},
                {"both", GraspHands::kBoth}},
               "Hand that holds the object; auto: as stored in the clip, else detected from the "
               "motion of the clip's object; right if the clip has no object");
  table.Choice(
      "recipe", carry.recipe,
      {{"holdfast", FitRecipe::kHoldfast},
       {"paper", FitRecipe::kPaper},
       {"imos-code", FitRecipe::kImosCode}},
      "holdfast: all terms; paper: only the three terms of the IMoS paper; imos-code: the method "
      "of the IMoS authors' code");
  table.Flag(
      "drink", carry.drink,
      "Fit a drinking motion: the cup stands on the table until the hand takes it, is at the mouth "
      "when the hand is there, and is put back; neck and head move to the cup's rim");
  table.Choice("drinking", job.no_drink, {{"auto", false}, {"off", true}},
               "auto: same as --drink if the clip shows drinking and the object is a vessel; off: "
               "hold the object throughout");
  table.Number("start", "", job.start, kNonNegative, "First frame to fit");
  table.Number("end", "", job.end, {}, "Frame to stop before; -1 is the clip's end");
  table.Number("object_scale", "", carry.object_scale, kPositive,
               "Multiplies the object's coordinates (0.001 for millimeters)");
  table.Flag("keep_motion", carry.keep_motion,
             "Do not adjust the arms; only report collisions with the body. Without this option, "
             "arms are adjusted slightly where the object, a hand or a forearm would penetrate the "
             "body");
  AddHandOverOptions(carry, table);
  AddGraspOptions(job, table);
  AddEnergyOptions(carry.fit, table);
  AddSolverOptions(job, table);
  return table;
}

bool FitRun::Sound() const {
  return report.sound && std::ranges::none_of(report.fit.frames, [](const FrameReport& frame) {
           return frame.stop == StopReason::kFailed;
         });
}

FitRun RunFit(const FitJob& job, FitInput input,
              const std::function<void(const std::string&)>& tell, const StagedProgress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  FitRun run;
  run.options = job.carry;
  if (run.options.recipe == FitRecipe::kPaper) run.options.fit = run.options.fit.OnlyPaper();
  const auto warn = [&](const std::string& warning) {
    run.warnings.push_back(warning);
    tell("warning: " + warning);
  };
  if (!input.made) {
    RequireMeters(job.clip, input.motion.clip, *input.motion.body.model);
    CutToRange(job, input.motion.clip);
  }
  if (!job.first_grasp.empty()) ReadGiven(job, input.motion.body, run.options);
  ChooseGrasp(job, input, run.options, run.notes);
  run.object = input.prepare();
  run.notes.insert(run.notes.end(), run.object->notes.begin(), run.object->notes.end());
  run.body = std::move(input.motion.body);
  const Clip& clip = input.motion.clip;
  if (IsDrink(job, run, clip)) {
    run.options.drink = true;
    run.notes.push_back(fmt::format(
        "{}: the person drinks: {} stands on a table and its rim comes to the mouth, as with "
        "--drink (--drinking off holds it throughout)",
        job.clip, job.object));
  }
  for (const std::string& note : run.notes) tell("note: " + note);
  if (run.options.grasp == GraspSource::kClips) {
    if (const auto away = WarnOfHeldDistance(clip, run.body, run.object->object.mesh)) {
      warn(fmt::format("{}: {}: {}", job.clip, *away, kHeldRemedy));
    }
  }
  run.report = NamingSource("the clip", job.clip, [&] {
    return CarryObject(clip, run.body, *run.object, run.options, progress);
  });
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (run.report.status == CarryStatus::kStopped) return run;
  for (const std::string& warning : run.report.grasp.warnings) warn(warning);
  RequireCarried(job, run.options, run.report);
  for (const std::string& warning : run.report.warnings) warn(warning);
  return run;
}

nlohmann::json FitMetricsJson(const FitJob& job, const FitRun& run) {
  const CarryReport& report = run.report;
  const FitOptions& fit = run.options.fit;
  FitJob used = job;
  used.carry = run.options;
  nlohmann::json options = OptionsJson(OptionsOf(used));
  options.update(WeightsJson(fit));
  options.update({{"clip", job.clip},
                  {"object", job.object},
                  {"drag_share", fit.drag_share},
                  {"soft_tissue_mm", 1e3 * fit.soft_tissue_m}});
  if (!fit.whole_clip) options["lambda_acceleration"] = options["lambda_support"] = 0.0;

  const Side side = (report.held_by & kHoldsRight) != 0 ? Side::kRight : Side::kLeft;
  const HeldFrames held = CountHeld(report.clip.holding_hand);
  nlohmann::json metrics = {{"options", std::move(options)}, {"held_by", HandsText(held)}};
  metrics["frames_held"] = {
      {"right", held.right}, {"left", held.left}, {"both", held.both}, {"none", held.none}};
  metrics["grasp"] = FirstGraspJson(report.grasp);
  if (report.drunk) metrics["drink"] = DrinkJson(report.drink, *report.drunk);
  if (run.options.place && report.grasp.one) {
    metrics["grasp"]["contacts_outside_place_ratio"] = report.grasp.one->outside_place;
    metrics["grasp"]["from_point_mm"] = 1000.0 * report.grasp.one->from_place_m;
  } else if (run.options.place && report.grasp.both) {
    const std::array<Grasp, 2>& hands = report.grasp.both->hands;
    metrics["grasp"]["contacts_outside_place_ratio"] =
        std::max(hands[0].outside_place, hands[1].outside_place);
  }
  metrics["switches"] = SwitchesJson(report.holding, report.handovers);
  metrics["protocol"] = ProtocolJson(run.options.protocol, run.object->solid,
                                     HandModel(run.body.model, run.body.betas, side));
  metrics["notes"] = run.notes;
  metrics["warnings"] = run.warnings;
  metrics["clearance"] = ClearanceJson(report.clearance);
  metrics["solver"] = SolverJson(fit);
  metrics["summary"] = FitSummaryJson(report.fit, report.contact);
  metrics["per_frame"] = FitFramesJson(report.fit, report.contact, report.clearance);
  metrics["per_frame"]["holding_hand"] = report.holding.hands;
  return metrics;
}

}  // namespace holdfast
