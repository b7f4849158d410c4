// SPDX-License-Identifier: MIT
#include "apps/fit_job.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <memory>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/first_grasp.h"
#include "apps/fit_metrics.h"
#include "apps/report.h"
#include "apps/result_folder.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/fit/grip_from_clip.h"
#include "solver/handover/grip_by_transfer.h"
#include "solver/handover/holding.h"
#include "solver/recipes/imos_code.h"

namespace holdfast::apps {
namespace {

constexpr std::uint8_t kHoldsBoth = kHoldsRight | kHoldsLeft;

std::uint8_t BitsOf(const std::string& hand) {
  if (hand == "left") return kHoldsLeft;
  return hand == "both" ? kHoldsBoth : kHoldsRight;
}

std::string_view HandsText(std::uint8_t bits) {
  switch (bits) {
    case kHoldsRight:
      return "the right hand";
    case kHoldsLeft:
      return "the left hand";
    default:
      return "both hands";
  }
}

}  // namespace

nlohmann::json FitOptionsJson(const FitJob& job) {
  const FitOptions& fit = job.fit;
  nlohmann::json options = {{"clip", job.clip},
                            {"object", job.object},
                            {"object_scale", job.object_scale},
                            {"hand", job.hand},
                            {"style", job.style},
                            {"body", job.body.empty() ? "holdfast_neutral" : job.body},
                            {"start", job.start},
                            {"end", job.end},
                            {"object_vertices", job.object_vertices},
                            {"recipe", job.recipe},
                            {"solve", job.solve},
                            {"lambda_distance", fit.lambda_distance},
                            {"lambda_contact", fit.lambda_contact},
                            {"lambda_temporal", fit.lambda_temporal},
                            {"lambda_penetration", fit.lambda_penetration},
                            {"lambda_object_in_hand", fit.lambda_object_in_hand},
                            {"lambda_limits", fit.lambda_limits},
                            {"lambda_wrist", fit.lambda_wrist},
                            {"slip", fit.slip},
                            {"lambda_slip", fit.lambda_slip},
                            {"drag_share", fit.drag_share},
                            {"lambda_fingers", fit.lambda_fingers},
                            {"lambda_object", fit.lambda_object},
                            {"lambda_acceleration", fit.whole_clip ? fit.lambda_acceleration : 0.0},
                            {"soft_tissue_mm", 1e3 * fit.soft_tissue_m},
                            {"contact_threshold_mm", job.contact_threshold_mm},
                            {"precision", job.precision},
                            {"max_iterations", fit.max_iterations}};
  if (job.place.Given()) options["place"] = GraspPlaceJson(job.place);
  return options;
}

namespace {

// The motion and its person, cut to the frames asked for.
LoadedClip LoadRange(const FitJob& job, const std::shared_ptr<const BodyModel>& body,
                     const CommonOptions& common) {
  if (job.motion) {
    LoadedClip loaded;
    loaded.clip = *job.motion;
    loaded.body = BodyOfClip(job.clip, loaded.clip, body, loaded.notes);
    for (const std::string& note : loaded.notes) Note(common, "note: " + note);
    return loaded;
  }
  LoadedClip loaded = LoadClip(job.clip, body, common);
  Clip& clip = loaded.clip;
  const int end = job.end < 0 ? clip.NumFrames() : std::min(job.end, clip.NumFrames());
  if (job.start >= end) {
    throw Error(
        job.clip,
        fmt::format("has {} frames: nothing between {} and {}", clip.NumFrames(), job.start, end),
        "Give --start and --end within the clip");
  }
  clip = Slice(clip, job.start, end);
  return loaded;
}

// Whether the object that a clip has is the one given: the surface that the clip names is the same,
// or, where there is none to look at, one of its names.
bool IsObjectOf(const Clip& clip, const FitJob& job, const LoadedObject& object) {
  if (std::optional<TriangleMesh> own = MeshNamedBy(clip, job.clip)) {
    if (SameSurface(*own, object.mesh)) return true;
    own->vertices *= job.object_scale;
    return job.object_scale != 1.0 && SameSurface(*own, object.mesh);
  }
  const auto same = [](unsigned char a, unsigned char b) {
    return std::tolower(a) == std::tolower(b);
  };
  const std::string mesh = std::filesystem::path(clip.object->mesh).stem().string();
  return clip.object->name.empty() || std::ranges::equal(clip.object->name, object.name, same) ||
         std::ranges::equal(mesh, object.name, same);
}

// Whether a grasp has to be made. Objects that no hand can hold are refused here, before anything
// is prepared for them.
bool NeedsGrasp(const FitJob& job, const Clip& clip, const LoadedObject& object,
                std::vector<std::string>& notes) {
  bool needed = !clip.object || job.regrasp || job.place.Given();
  if (!needed && !job.keep_grasp && !job.motion && !IsObjectOf(clip, job, object)) {
    needed = true;
    notes.push_back(fmt::format(
        "the clip's grasp is of {}, not of {}: a new one is made (--keep-grasp keeps it)",
        clip.object->name.empty() ? "another mesh" : clip.object->name, job.object));
  }
  const bool both = job.hand == "both" || std::ranges::count(clip.holding_hand, kHoldsBoth) > 0;
  if (needed) RequireGraspable(object, both);
  return needed;
}

// A grasp of a clip's own that the terms cannot mend any more: soft tissue gives less.
constexpr double kBadGripMm = 3.0;

// Everything that a fit works on.
struct Scene {
  Scene(const FitJob& job, const CommonOptions& common, FitLibrary& library)
      : Scene(job, common, library, LoadRange(job, library.Body(job.body), common)) {}
  Scene(const FitJob& job, const CommonOptions& common, FitLibrary& library, LoadedClip loaded)
      : clip(std::move(loaded.clip)),
        body(loaded.body.model),
        needs_grasp(NeedsGrasp(job, clip, *library.Loaded(job.object, job.object_scale), notes)),
        prepared(
            library.Object(job.object, job.object_scale, job.object_vertices, NumThreads(common))),
        betas(loaded.body.betas),
        right(body, betas, Side::kRight),
        left(body, betas, Side::kLeft) {
    notes.insert(notes.end(), prepared->notes.begin(), prepared->notes.end());
    for (const std::string& note : notes) Note(common, "note: " + note);
  }
  const HandModel& Hand(Side side) const { return side == Side::kRight ? right : left; }
  const LoadedObject& Object() const { return prepared->object; }

  Clip clip;
  std::shared_ptr<const BodyModel> body;
  std::vector<std::string> notes;  ///< for people, and for metrics.json
  bool needs_grasp;                ///< the clip has none of this object
  std::shared_ptr<const PreparedObject> prepared;
  Eigen::VectorXd betas;
  HandModel right, left;
};

Holding Always(std::uint8_t bits, std::size_t frames) {
  return {std::vector<std::uint8_t>(frames, bits), {}, std::vector<double>(frames, 1.0)};
}

// Who is to hold an object that the clip does not have: who held the clip's own in most frames.
std::uint8_t UsualHolder(const Scene& scene) {
  if (const std::optional<Side> lone = scene.body->LoneHand()) return HoldingBit(*lone);
  const auto frames = [&](std::uint8_t bits) {
    return std::ranges::count(scene.clip.holding_hand, bits);
  };
  const std::uint8_t one = frames(kHoldsLeft) > frames(kHoldsRight) ? kHoldsLeft : kHoldsRight;
  return frames(kHoldsBoth) > frames(one) ? kHoldsBoth : one;
}

// Who holds the object in each frame, before the fit.
Holding WhoHolds(const FitJob& job, const Scene& scene, const CommonOptions& common) {
  const Clip& clip = scene.clip;
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  const bool has_track = !scene.needs_grasp;
  // Without the object's own trajectory, somebody has to hold it in every frame.
  const bool labelled =
      !clip.holding_hand.empty() && (has_track || std::ranges::count(clip.holding_hand, 0) == 0);
  Holding holding;
  if (labelled && (job.offhand || job.hand == "auto") && job.handover.switch_frames.empty()) {
    holding = {clip.holding_hand, SwitchesOf(clip.holding_hand), {}};
  } else if (job.offhand && !(has_track && job.handover.switch_frames.empty())) {
    Eigen::Vector3d extent = Extent(scene.Object().mesh);
    std::sort(extent.begin(), extent.end());
    return FindHandovers(clip, scene.right, scene.left, extent(1), job.handover);
  } else if (!job.offhand && job.hand != "auto") {
    return Always(BitsOf(job.hand), frames);
  } else if (!has_track) {
    return Always(UsualHolder(scene), frames);
  } else {
    HoldingOptions options;
    options.threads = NumThreads(common);
    holding = FindHolding(clip, scene.right, scene.left, *scene.prepared->fit.distance, options);
  }
  if (std::ranges::all_of(holding.hands, [](std::uint8_t bits) { return bits == 0; })) {
    throw Error(job.clip, "has an object that no hand holds",
                "Say which hand does with --hand, or make a new grasp with --regrasp");
  }
  return holding;
}

nlohmann::json SwitchesJson(const Holding& holding, const std::vector<Handover>& handovers) {
  nlohmann::json list = nlohmann::json::array();
  for (const HandSwitch& change : holding.switches) {
    nlohmann::json entry = {{"frame", change.frame},
                            {"from", SideName(change.from)},
                            {"to", SideName(change.to)},
                            {"both_hold_from_frame", change.both_begin},
                            {"both_hold_to_frame", change.both_end},
                            {"confidence", change.confidence}};
    for (const Handover& handover : handovers) {
      if (handover.to != change.to || handover.frame < change.both_begin ||
          handover.frame > std::max(change.frame, change.both_end)) {
        continue;
      }
      const GraspTransfer& transfer = handover.transfer;
      entry["grasp"] = {
          {"clean", transfer.found},
          {"method", MethodName(transfer.method)},
          {"refused", transfer.refused},
          {"wrist_correction_mm", 1e3 * transfer.correction_m},
          {"wrist_correction_deg", transfer.correction_rad * 180.0 / std::numbers::pi},
          {"hand_overlap_mm", transfer.hand_overlap_mm},
          {"skin_in_object_mm", transfer.grasp.max_penetration_mm}};
    }
    list.push_back(std::move(entry));
  }
  return list;
}

std::string SwitchesText(const nlohmann::json& switches) {
  std::string text;
  for (const nlohmann::json& change : switches) {
    text += fmt::format("  hands over          frame {}, {} to {} (confidence {:.2f})",
                        change["frame"].get<int>(), change["from"].get<std::string>(),
                        change["to"].get<std::string>(), change["confidence"].get<double>());
    if (change.contains("grasp")) {
      text += fmt::format(", wrist moved by {:.0f} mm and {:.0f} deg",
                          change["grasp"]["wrist_correction_mm"].get<double>(),
                          change["grasp"]["wrist_correction_deg"].get<double>());
    }
    text += "\n";
  }
  return text;
}

void RemoveTimings(nlohmann::json& metrics) {
  metrics["grasp"].erase("search_ms");
  metrics["summary"].erase("solve_ms_median");
  metrics["per_frame"].erase("solve_ms");
}

void RequireGrasp(bool held, const FitJob& job, const nlohmann::json& grasp, std::uint8_t holding) {
  if (held) return;
  const std::string other =
      holding == kHoldsBoth ? "a first frame with both hands in front (--start)"
                            : fmt::format("--hand {}", holding == kHoldsLeft ? "right" : "left");
  throw FitFailure(fmt::format("{}: {}. Try {}, {}", job.object, grasp["status"].get<std::string>(),
                               other,
                               job.place.Given() ? "or another place (--at, --region, --avoid)"
                                                 : "or another object size (--object-scale)"));
}

void RequireContact(const ContactScore& contact, const FitJob& job, bool grasped) {
  if (contact.contact_frames_ratio.value_or(0.0) > 0.0) return;
  throw FitFailure(fmt::format(
      "{}: {} touches no hand in any frame, so that nothing is written. {}", job.clip, job.object,
      grasped ? "Try another --hand, or another frame to take hold in (--start)"
              : "Its trajectory is of another object, scale or body: --regrasp makes a new grasp"));
}

}  // namespace

FitOutcome RunFitJob(const FitJob& asked, const CommonOptions& common, FitLibrary& library) {
  FitJob job = asked;
  ResultFolder folder(job.output, common.force);
  job.fit.contact_threshold_m = 1e-3 * job.contact_threshold_mm;
  job.fit.precision = job.precision == "double" ? PairPrecision::kDouble : PairPrecision::kSingle;
  job.fit.whole_clip = job.solve == "batch";
  job.fit.threads = NumThreads(common);
  if (job.recipe == "paper") job.fit = job.fit.OnlyPaper();
  job.protocol.threads = NumThreads(common);
  const FitOutcome stopped{kInterrupted, {}, {}};

  Scene scene(job, common, library);
  const bool needs_grasp = scene.needs_grasp;
  if (job.offhand) RequireHands(*scene.body, kHoldsBoth);
  const Holding held = WhoHolds(job, scene, common);
  const std::vector<std::uint8_t>& holding = held.hands;
  std::uint8_t all_bits = 0;
  for (const std::uint8_t bits : holding) all_bits |= bits;
  RequireHands(*scene.body, all_bits);

  if (!needs_grasp) {
    WarnIfAway(job.clip, scene.clip, {scene.body, scene.betas}, scene.Object().mesh, common);
  }

  const std::shared_ptr<const GraspPlace> place =
      MakeGraspPlace(job.place, scene.Object(), job.object, job.object_scale);
  if (place && holding.front() == kHoldsBoth) {
    throw Error(job.clip,
                "is held by both hands in its first frame: --at, --region and --avoid are "
                "for one",
                "Say which with --hand");
  }
  nlohmann::json grasp = {{"made", false}};
  std::optional<std::array<GripPose, 2>> both_grips;
  if (needs_grasp && holding.front() == kHoldsBoth) {
    both_grips =
        HoldInFirstFrame(scene.right, scene.left, scene.Object(), *scene.prepared->fit.distance,
                         BodySurface(scene.body, scene.betas), common, scene.clip, grasp);
    if (Interrupted()) return stopped;
    RequireGrasp(both_grips.has_value(), job, grasp, kHoldsBoth);
  } else if (needs_grasp) {
    const Side side = holding.front() == kHoldsLeft ? Side::kLeft : Side::kRight;
    const auto alone = std::ranges::find_if_not(
        holding, [&](std::uint8_t bits) { return bits == holding.front(); });
    const bool grasped = GraspInFirstFrame(
        scene.Hand(side), scene.Object(), scene.prepared->solid.distance,
        *scene.prepared->fit.distance, BodySurface(scene.body, scene.betas),
        static_cast<int>(alone - holding.begin()), job.style, place, common, scene.clip, grasp);
    if (Interrupted()) return stopped;
    RequireGrasp(grasped, job, grasp, holding.front());
  }
  scene.clip.object->name = scene.Object().name;
  scene.clip.object->mesh = "object.ply";
  // Betas keep the name of the body they belong to; without any, this is the body's own clip now.
  if (scene.clip.betas.size() == 0 || scene.clip.betas.isZero(0.0)) {
    scene.clip.body_model = scene.body->Name();
  }

  std::vector<const HandModel*> hands;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    if ((all_bits & HoldingBit(side)) != 0) {
      hands.push_back(&scene.Hand(side));
    }
  }
  std::vector<Handover> handovers;
  GraspTransferOptions transfer;
  transfer.seed = common.seed;
  transfer.threads = NumThreads(common);
  const bool hands_change =
      std::ranges::adjacent_find(holding, std::ranges::not_equal_to{}) != holding.end();
  const GripMaker later_grips =
      job.offhand || (needs_grasp && hands_change)
          ? GripsByTransfer(scene.right, scene.left, scene.Object().mesh,
                            scene.prepared->solid.distance, *scene.prepared->fit.distance, transfer,
                            &handovers)
          : GripsFromClip(scene.clip, hands);
  const GripMaker grips = [&](const GripRequest& request) {
    const bool first = request.frame == 0 && both_grips;
    return first ? (*both_grips)[request.side == Side::kRight ? 0 : 1] : later_grips(request);
  };
  const auto fit_begin = std::chrono::steady_clock::now();
  Progress fit_progress(common, "fit");
  const auto report_progress = [&](int done, int total) {
    fit_progress.Update(done, total);
    return !Interrupted();
  };
  const FitResult result = job.recipe == "imos-code"
                               ? FitClipImosCode(scene.clip, *hands.front(),
                                                 scene.prepared->fit.vertices, {}, report_progress)
                               : FitClip(scene.clip, hands, scene.prepared->fit, holding, job.fit,
                                         grips, report_progress);
  const double fit_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - fit_begin).count();
  if (Interrupted()) return stopped;

  const std::vector<HandObjectScore> scores =
      MeasureHands(result.clip, hands, holding, scene.prepared->solid, job.protocol, common);
  if (Interrupted()) return stopped;
  const FitSummary summary = SummarizeFit(result, ScoreContact(scores));
  RequireContact(summary.contact, job, needs_grasp);
  nlohmann::json metrics = JsonHead("holdfast/fit/1", common);
  metrics["options"] = FitOptionsJson(job);
  metrics["held_by"] = HandsText(all_bits);
  metrics["grasp"] = grasp;
  metrics["switches"] = SwitchesJson(held, handovers);
  metrics["protocol"] = ProtocolJson(job.protocol, scene.prepared->solid, *hands.front());
  metrics["notes"] = scene.notes;
  metrics["summary"] = SummaryJson(summary);
  metrics["per_frame"] = PerFrameJson(result, summary.contact);
  metrics["per_frame"]["holding_hand"] = holding;

  if (!job.extra.is_null()) metrics.update(job.extra);
  if (!job.write_timings) RemoveTimings(metrics);

  WriteClip(result.clip, folder / "clip.npz");
  WriteMesh(scene.Object().mesh, folder / "object.ply");
  WriteAtomically(folder / "metrics.json", metrics.dump(1) + "\n");
  if (job.write_report) {
    ClipInput shown;
    shown.source = job.output;
    shown.file = std::filesystem::path(job.output) / "clip.npz";
    shown.clip = result.clip;
    shown.body = scene.body;
    shown.betas = scene.betas;
    shown.object = scene.Object().mesh;
    shown.metrics = metrics;
    WriteReportBeside({&shown, 1}, folder / "report.html", common);
    if (Interrupted()) return stopped;
  }
  folder.Commit();
  if (!needs_grasp && summary.contact.penetration_mean_max_mm > kBadGripMm) {
    Note(common, fmt::format("warning: the clip's own grasp holds the object {:.0f} mm deep in the "
                             "hand; --regrasp makes a new one",
                             summary.contact.penetration_mean_max_mm));
  }
  for (const Handover& handover : handovers) {
    if (handover.transfer.found) continue;
    Note(common, fmt::format("warning: the {} hand's grasp of frame {} is the least bad try: {}",
                             SideName(handover.to), handover.frame, handover.transfer.refused));
  }

  FitOutcome outcome;
  outcome.exit_code = summary.failed > 0 ? kFitFault : kDone;
  outcome.text =
      fmt::format("{}/clip.npz: {} held by {} through {} frames\n{}{}  whole fit {:.2f} s\n",
                  job.output, scene.Object().name, HandsText(all_bits), summary.frames,
                  SummaryText(summary, job.protocol), SwitchesText(metrics["switches"]), fit_s);
  metrics.erase("per_frame");
  metrics["output"] = job.output;
  outcome.summary = std::move(metrics);
  return outcome;
}

void AddFitJobOptions(CLI::App& command, FitJob& job) {
  command.add_option(
      "--body", job.body,
      "Body model: SMPL-X, SMPL-H, or MANO for a hand alone (.npz, .pkl); the embedded "
      "body if left out");
  command
      .add_option("--style", job.style,
                  "How a new grasp holds: power, precision, handle (fingers through it), or auto")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "power", "precision", "handle"}));
  AddGraspPlaceOptions(command, job.place);
  CLI::Option* const regrasp = command.add_flag(
      "--regrasp", job.regrasp, "Make a new grasp even if the clip has one of this object");
  command
      .add_flag("--keep-grasp", job.keep_grasp,
                "Keep the clip's own grasp and trajectory even if they are another object's")
      ->excludes(regrasp)
      ->excludes(command.get_option("--at"))
      ->excludes(command.get_option("--region"))
      ->excludes(command.get_option("--avoid"));
  command.add_option("--start", job.start, "First frame to fit")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command.add_option("--end", job.end, "Frame to stop before; -1 is the clip's end")
      ->capture_default_str();
  command
      .add_option("--object-scale", job.object_scale,
                  "Multiplies the object's coordinates (0.001 for millimetres)")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  command
      .add_option("--object-vertices", job.object_vertices,
                  "Vertices that the object is simplified to")
      ->capture_default_str()
      ->check(CLI::Range(4, 100'000));
  const auto weight = [&](const char* name, double& value, const char* help) {
    command.add_option(name, value, help)->capture_default_str()->check(CLI::NonNegativeNumber);
  };
  weight("--lambda-distance", job.fit.lambda_distance,
         "Weight of E_d: hand and object keep their distances (paper eq. 7)");
  weight("--lambda-contact", job.fit.lambda_contact,
         "Weight of E_c: what touched stays together (paper eq. 8)");
  weight("--lambda-temporal", job.fit.lambda_temporal,
         "Weight of E_t: little change between frames (paper eq. 9)");
  weight("--lambda-penetration", job.fit.lambda_penetration,
         "Weight of E_p: the hand stays out of the object");
  weight("--lambda-object-in-hand", job.fit.lambda_object_in_hand,
         "Weight of E_o: the object stays out of the hand (thin walls, blades)");
  weight("--lambda-limits", job.fit.lambda_limits, "Weight of angles beyond a joint's range");
  weight("--lambda-wrist", job.fit.lambda_wrist,
         "Weight of E_w: two hands that hold stay where the clip has them");
  command.add_flag("--slip", job.fit.slip,
                   "Contacts may travel along the surface, not off it: E_s in place of E_d and "
                   "E_c, for objects turned or squeezed in the fingers");
  weight("--lambda-slip", job.fit.lambda_slip, "Weight of E_s");
  weight("--lambda-fingers", job.fit.lambda_fingers,
         "Weight of the fingers' way from the clip's own; what moves them with --slip");
  weight("--lambda-object", job.fit.lambda_object,
         "Weight of the object's way from the clip's own trajectory");
  command
      .add_option("--solve", job.solve,
                  "sequential: frame after frame; batch: then all frames at once, with little "
                  "change of velocity")
      ->capture_default_str()
      ->check(CLI::IsMember({"sequential", "batch"}));
  weight("--lambda-acceleration", job.fit.lambda_acceleration,
         "With --solve batch, weight of second differences");
  command
      .add_option("--contact-threshold", job.contact_threshold_mm,
                  "tau: pairs closer than this when the hand takes hold are in contact, mm")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  command.add_flag("--no-report{false}", job.write_report, "Leave out report.html");
  command.add_option("--max-iterations", job.fit.max_iterations, "Per frame")
      ->capture_default_str()
      ->check(CLI::Range(1, 10'000));
  command.add_option("--precision", job.precision, "Arithmetic of the pair loop")
      ->capture_default_str()
      ->check(CLI::IsMember({"single", "double"}));
}

}  // namespace holdfast::apps
