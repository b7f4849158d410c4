// SPDX-License-Identifier: MIT
#include "apps/fit_job.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <map>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/fit_metrics.h"
#include "apps/report_writer.h"
#include "apps/result_folder.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "solver/carry/carry.h"
#include "solver/carry/carry_json.h"

namespace holdfast::apps {
namespace {

// Which hands hold at some time.
std::string_view HandsText(const HeldFrames& frames) {
  if (frames.left + frames.both == 0) return "the right hand";
  if (frames.right + frames.both == 0) return "the left hand";
  return frames.right + frames.left == 0 ? "both hands" : "the right and the left hand";
}

}  // namespace

void RequireGraspable(const LoadedObject& object, bool both) {
  if (const std::optional<std::string> why = WhyTooLarge(object, both)) throw FitFailure(*why);
}

nlohmann::json FitOptionsJson(const FitJob& job) {
  const FitOptions& fit = job.fit;
  nlohmann::json options = {{"clip", job.clip},
                            {"object", job.object},
                            {"object_scale", job.object_scale},
                            {"hand", job.hand},
                            {"style", job.style},
                            {"use", job.use},
                            {"body", job.body.empty() ? "holdfast_neutral" : job.body},
                            {"start", job.start},
                            {"end", job.end},
                            {"object_vertices", job.object_vertices},
                            {"recipe", job.recipe},
                            {"solve", job.solve},
                            {"slip", fit.slip},
                            {"drag_share", fit.drag_share},
                            {"soft_tissue_mm", 1e3 * fit.soft_tissue_m},
                            {"contact_threshold_mm", job.contact_threshold_mm},
                            {"normalize", job.normalize},
                            {"keep_motion", job.keep_motion},
                            {"drink", job.drink},
                            {"precision", job.precision},
                            {"max_iterations", fit.max_iterations}};
  options.update(WeightsJson(fit));
  if (!fit.whole_clip) options["lambda_acceleration"] = options["lambda_support"] = 0.0;
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
  RequireMetres(job.clip, clip, *loaded.body.model);
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

// The job as the library takes it.
CarryOptions ToLibrary(const FitJob& job, const CommonOptions& common) {
  CarryOptions options;
  options.hands = job.hand == "right"  ? CarryHands::kRight
                  : job.hand == "left" ? CarryHands::kLeft
                  : job.hand == "both" ? CarryHands::kBoth
                                       : CarryHands::kAuto;
  options.object_scale = job.object_scale;
  options.style = StyleByName(job.style);
  options.use = UseByName(job.use);
  options.keep_motion = job.keep_motion;
  options.clear_passages = job.clear_passages;
  options.drink = job.drink;
  options.hand_over = job.offhand;
  options.handover = job.handover;
  options.recipe = job.recipe == "paper"       ? FitRecipe::kPaper
                   : job.recipe == "imos-code" ? FitRecipe::kImosCode
                                               : FitRecipe::kHoldfast;
  options.fit = job.fit;
  options.fit.contact_threshold_m = 1e-3 * job.contact_threshold_mm;
  options.fit.normalize = job.normalize == "mean" ? Normalization::kMean : Normalization::kSum;
  options.fit.precision =
      job.precision == "double" ? PairPrecision::kDouble : PairPrecision::kSingle;
  options.fit.whole_clip = job.solve == "batch";
  if (job.recipe == "paper") options.fit = options.fit.OnlyPaper();
  options.protocol = job.protocol;
  options.seed = common.seed;
  options.threads = NumThreads(common);
  return options;
}

// Decides whether a grasp has to be made. Objects that no hand can hold are refused here, before
// anything is prepared for them.
void ChooseGrasp(const FitJob& job, const LoadedClip& loaded, const LoadedObject& object,
                 CarryOptions& options, std::vector<std::string>& notes) {
  const Clip& clip = loaded.clip;
  if (job.keep_grasp || job.motion) options.grasp = GraspSource::kClips;
  if (job.regrasp || job.place.Given()) options.grasp = GraspSource::kNew;
  if (options.grasp == GraspSource::kClipsOrNew) {
    try {
      if (ClipObject own = FindClipObject(loaded); !own.by_name) {
        options.clip_object = std::move(own.mesh);
      }
    } catch (const Error& error) {  // the motion is there all the same
      notes.push_back(
          fmt::format("{}: {}: whether the clip's grasp is of {} is judged by "
                      "the object's name (--regrasp makes a new one)",
                      error.Where(), error.Problem(), job.object));
    }
    if (loaded.change) options.other_body = loaded.change->from;
    if (const std::string why = WhyNewGrasp(clip, object, job.object, options); !why.empty()) {
      notes.push_back(why + ": a new one is made (--keep-grasp keeps it)");
    }
  }
  const bool needed = NeedsGrasp(clip, object, options);
  options.grasp = needed ? GraspSource::kNew : GraspSource::kClips;
  constexpr std::uint8_t kHoldsBoth = kHoldsRight | kHoldsLeft;
  if (needed) {
    RequireGraspable(object,
                     job.hand == "both" || std::ranges::count(clip.holding_hand, kHoldsBoth) > 0);
  }
}

std::string SwitchesText(const nlohmann::json& switches) {
  std::string text;
  for (const nlohmann::json& change : switches) {
    text += fmt::format("  hands over          frame {}, {} to {} (confidence {:.2f})",
                        change["frame"].get<int>(), change["from"].get<std::string>(),
                        change["to"].get<std::string>(), change["confidence"].get<double>());
    if (change.contains("grasp")) {
      const nlohmann::json& grasp = change["grasp"];
      text += fmt::format(
          ", wrists moved by {:.0f} mm and {:.0f} deg ({}), {:.0f} mm and {:.0f} deg ({})",
          grasp["giver_moved_mm"].get<double>(), grasp["giver_turned_deg"].get<double>(),
          change["from"].get<std::string>(), grasp["receiver_moved_mm"].get<double>(),
          grasp["receiver_turned_deg"].get<double>(), change["to"].get<std::string>());
    }
    text += "\n";
  }
  return text;
}

std::string DrinkText(const CarryReport& report) {
  if (!report.drunk) return {};
  const DrinkTimes& times = report.drink->times;
  return fmt::format(
      "  drinks             frames {} to {}; rim {:.0f} mm from the mouth in frame {}, tilted "
      "{:.0f} "
      "deg\n",
      times.lift, times.put_down, 1e3 * report.drunk->rim_from_mouth_m, times.drink,
      report.drunk->tilt_rad / kDegree);
}

void RequireCarried(const CarryReport& report, const FitJob& job) {
  if (report.status == CarryStatus::kNoGrasp) {
    const std::uint8_t first = report.holding.hands.front();
    const std::string other =
        report.grasp.both ? "a first frame with both hands in front (--start)"
                          : fmt::format("--hand {}", first == kHoldsLeft ? "right" : "left");
    throw FitFailure(fmt::format("{}: {}. Try {}, {}", job.object, report.grasp.status, other,
                                 job.place.Given() ? "or another place (--at, --region, --avoid)"
                                                   : "or another object size (--object-scale)"));
  }
  if (report.status == CarryStatus::kNoContact) {
    throw FitFailure(fmt::format(
        "{}: {} touches no hand in any frame, so that nothing is written. {}", job.clip, job.object,
        report.grasp.made
            ? "Try another --hand, or another frame to take hold in (--start)"
            : "Its trajectory is of another object, scale or body: --regrasp makes a new grasp"));
  }
}

nlohmann::json MetricsOf(const FitJob& job, const CarryReport& report, const PreparedObject& object,
                         const ClipBody& body, const std::vector<std::string>& notes,
                         const CommonOptions& common) {
  const Side side = (report.held_by & kHoldsRight) != 0 ? Side::kRight : Side::kLeft;
  nlohmann::json metrics = JsonHead("holdfast/fit/1", common);
  metrics["options"] = FitOptionsJson(job);
  const HeldFrames held = CountHeld(report.clip.holding_hand);
  metrics["held_by"] = HandsText(held);
  metrics["frames_held"] = {
      {"right", held.right}, {"left", held.left}, {"both", held.both}, {"none", held.none}};
  metrics["grasp"] = FirstGraspJson(report.grasp);
  if (report.drunk) metrics["drink"] = DrinkJson(report.drink, *report.drunk);
  if (report.grasp.one && job.place.Given()) {
    metrics["grasp"]["contacts_outside_place_ratio"] = report.grasp.one->outside_place;
    metrics["grasp"]["from_point_mm"] = 1000.0 * report.grasp.one->from_place_m;
  } else if (report.grasp.both && job.place.Given()) {
    const std::array<Grasp, 2>& hands = report.grasp.both->hands;
    metrics["grasp"]["contacts_outside_place_ratio"] =
        std::max(hands[0].outside_place, hands[1].outside_place);
  }
  metrics["switches"] = SwitchesJson(report.holding, report.handovers);
  metrics["protocol"] =
      ProtocolJson(job.protocol, object.solid, HandModel(body.model, body.betas, side));
  metrics["notes"] = notes;
  metrics["warnings"] = report.grasp.warnings;
  for (const std::string& warning : report.warnings) metrics["warnings"].push_back(warning);
  metrics["clearance"] = ClearanceJson(report.clearance);
  metrics["solver"] = SolverJson(job.fit);
  metrics["summary"] = FitSummaryJson(report.fit, report.contact);
  metrics["per_frame"] = FitFramesJson(report.fit, report.contact, report.clearance);
  metrics["per_frame"]["holding_hand"] = report.holding.hands;
  if (!job.extra.is_null()) metrics.update(job.extra);
  if (job.measure) job.measure(report.clip, metrics);
  return metrics;
}

void WriteResult(const FitJob& job, const CarryReport& report, const PreparedObject& object,
                 const ClipBody& body, const nlohmann::json& metrics, ResultFolder& folder,
                 const CommonOptions& common) {
  WriteClip(report.clip, object.object.mesh, folder / "clip.npz");
  WriteMesh(object.object.mesh, folder / "object.ply");
  nlohmann::json written = folder.WriteMetrics(metrics);
  if (job.write_report) {
    ReportInput shown;
    shown.source = job.output;
    shown.file = std::filesystem::path(job.output) / "clip.npz";
    shown.clip = report.clip;
    shown.body = body.model;
    shown.betas = body.betas;
    shown.object = object.object.mesh;
    shown.metrics = std::move(written);
    WriteReportBeside({&shown, 1}, folder / "report.html", common);
  }
  folder.Commit();
}

// Of --verbose: how the solver ended, frame by frame in numbers.
void TellConvergence(const FitResult& fit, const CommonOptions& common) {
  std::map<std::string, int> stops;
  int iterations = 0;
  double most_ms = 0.0;
  for (const FrameReport& frame : fit.frames) {
    ++stops[std::string(StopReasonName(frame.stop))];
    iterations += frame.iterations;
    most_ms = std::max(most_ms, frame.solve_ms);
  }
  std::vector<std::string> parts;
  for (const auto& [stop, count] : stops) parts.push_back(fmt::format("{} {}", count, stop));
  Detail(common, "solver",
         fmt::format("solver: frames: {}; {} iterations in all, slowest frame {:.1f} ms",
                     fmt::join(parts, ", "), iterations, most_ms),
         {{"stops", stops}, {"iterations", iterations}, {"slowest_frame_ms", most_ms}});
}

}  // namespace

Outcome RunFitJob(const FitJob& asked, const CommonOptions& common, FitLibrary& library) {
  const auto begin = std::chrono::steady_clock::now();
  ResultFolder folder(asked.output, common.force);
  CarryOptions options = ToLibrary(asked, common);
  FitJob job = asked;
  if (IsOneOfMany()) job.write_report = false;  // megabytes each: made for those that are looked at
  job.fit = options.fit;                        // as metrics.json records them
  // The object is read meanwhile; its faults are told after the motion's, by whoever asks again.
  const auto object_read =
      std::async(options.threads > 1 ? std::launch::async : std::launch::deferred,
                 [&] { library.Loaded(job.object, job.object_scale); });
  const LoadedClip loaded = LoadRange(job, library.Body(job.body), common);
  std::vector<std::string> notes;
  ChooseGrasp(job, loaded, *library.Loaded(job.object, job.object_scale), options, notes);
  const std::shared_ptr<const PreparedObject> object =
      library.Object(job.object, job.object_scale, job.object_vertices, options.threads);
  notes.insert(notes.end(), object->notes.begin(), object->notes.end());
  for (const std::string& note : notes) Note(common, "note: " + note);
  const auto vertices = object->object.mesh.NumVertices();
  Detail(common, "loaded", fmt::format("loaded {}: {} vertices", job.object, vertices),
         {{"file", job.object}, {"vertices", vertices}});
  if (options.grasp == GraspSource::kClips) {
    WarnIfAway(job.clip, loaded.clip, loaded.body, object->object.mesh, common);
  }
  options.place = WantedPlace(job.place, job.object, job.object_scale);

  StageProgress progress(common);
  const CarryReport report = NamingSource("the clip", job.clip, [&] {
    return CarryObject(loaded.clip, loaded.body, *object, options,
                       [&](const char* stage, int done, int total) {
                         progress.Update(stage, done, total);
                         return !Interrupted();
                       });
  });
  progress.End();
  if (Interrupted()) return {kInterrupted, {}, {}};
  for (const std::string& warning : report.grasp.warnings) Note(common, "warning: " + warning);
  RequireCarried(report, job);

  TellConvergence(report.fit, common);
  nlohmann::json metrics = MetricsOf(job, report, *object, loaded.body, notes, common);
  const nlohmann::json summary = FitSummaryJson(report.fit, report.contact);  // timings too
  WriteResult(job, report, *object, loaded.body, metrics, folder, common);
  for (const std::string& warning : report.warnings) Note(common, "warning: " + warning);

  Outcome outcome;
  const bool falls_short = !report.sound || summary["frames_failed"] > 0;
  outcome.exit_code = Interrupted() ? kInterrupted : falls_short ? kFitFault : kDone;
  outcome.text = fmt::format(
      "{}/clip.npz: {} held by {}\n{}{}{}{}  whole fit {:.2f} s, grasp search "
      "included\n",
      job.output, object->object.name, HoldersText(CountHeld(report.clip.holding_hand)),
      SummaryText(summary, job.protocol), ClearanceText(report.clearance), DrinkText(report),
      SwitchesText(metrics["switches"]),
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  metrics.erase("per_frame");
  metrics["output"] = job.output;
  outcome.summary = std::move(metrics);
  return outcome;
}

namespace {

void AddGraspOptions(CLI::App& command, FitJob& job) {
  const char* const group = "The grasp";
  AddOption(command, "--style", job.style,
            "How a new grasp holds: power, precision, handle (fingers through it), or auto",
            CLI::IsMember({"auto", "power", "precision", "handle"}))
      ->group(group);
  AddUseOption(command, job.use)->group(group);
  AddGraspPlaceOptions(command, job.place, group);
  CLI::Option* const regrasp = command.add_flag(
      "--regrasp", job.regrasp, "Make a new grasp even if the clip has one of this object");
  regrasp->group(group);
  command
      .add_flag("--keep-grasp", job.keep_grasp,
                "Keep the clip's own grasp and trajectory even if they are another object's")
      ->excludes(regrasp)
      ->excludes(command.get_option("--at"))
      ->excludes(command.get_option("--region"))
      ->excludes(command.get_option("--avoid"))
      ->group(group);
}

void AddEnergyOptions(CLI::App& command, FitJob& job) {
  const char* const group = "Terms of the energy";
  for (const EnergyTermInfo& info : EnergyTerms()) {
    if (info.term != EnergyTerm::kSupport)
      AddWeightOption(command, info.term, job.fit)->group(group);
  }
  command
      .add_flag("--slip", job.fit.slip,
                "Contacts may travel along the surface, not off it: E_s in place of E_d and "
                "E_c, for objects turned or squeezed in the fingers")
      ->group(group);
  AddOption(command, "--contact-threshold", job.contact_threshold_mm,
            "tau: pairs closer than this when the hand takes hold are in contact, mm",
            CLI::PositiveNumber)
      ->group(group);
  AddOption(command, "--normalize", job.normalize,
            "What the weights of E_c and E_t multiply: sum, as the paper writes them, or mean over "
            "pairs and coordinates, as its code has them (E_d stays as it is)",
            CLI::IsMember({"sum", "mean"}))
      ->group(group);
}

void AddSolverOptions(CLI::App& command, FitJob& job) {
  const char* const group = "The solver";
  AddOption(command, "--object-vertices", job.object_vertices,
            "Vertices that the object is simplified to", CLI::Range(4, 100'000))
      ->group(group);
  command
      .add_option("--solve", job.solve,
                  "sequential: frame after frame; batch: then all frames at once, with little "
                  "change of velocity")
      ->capture_default_str()
      ->check(CLI::IsMember({"sequential", "batch"}))
      ->group(group);
  command.add_option("--max-iterations", job.fit.max_iterations, "Per frame")
      ->capture_default_str()
      ->check(CLI::Range(1, 10'000))
      ->group(group);
  AddOption(command, "--precision", job.precision, "Arithmetic of the pair loop",
            CLI::IsMember({"single", "double"}))
      ->group(group);
}

}  // namespace

void AddFitJobOptions(CLI::App& command, FitJob& job) {
  command.add_option(
      "--body", job.body,
      "Body model: SMPL-X, SMPL-H, or MANO for a hand alone (.npz, .pkl); the embedded "
      "body if left out");
  AddOption(command, "--start", job.start, "First frame to fit", CLI::NonNegativeNumber);
  AddOption(command, "--end", job.end, "Frame to stop before; -1 is the clip's end");
  AddOption(command, "--object-scale", job.object_scale,
            "Multiplies the object's coordinates (0.001 for millimetres)", CLI::PositiveNumber);
  command.add_flag("--keep-motion", job.keep_motion,
                   "Leave the clip's motion as it is. Without it, arms give way, smoothly and by "
                   "little, where the object, hand or forearm would go through the person's own "
                   "body; with it that is only reported");
  command.add_flag_callback(
      "--no-report", [&out = job.write_report] { out = false; }, "Leave out report.html");
  AddGraspOptions(command, job);
  AddEnergyOptions(command, job);
  AddSolverOptions(command, job);
}

}  // namespace holdfast::apps
