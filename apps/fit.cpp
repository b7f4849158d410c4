// SPDX-License-Identifier: MIT
#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "apps/common.h"
#include "apps/fit_metrics.h"
#include "apps/result_folder.h"
#include "geometry/clip_contact.h"
#include "geometry/distance_grid.h"
#include "geometry/error.h"
#include "geometry/io/atomic_file.h"
#include "geometry/io/mesh_io.h"
#include "geometry/rotation.h"
#include "solver/fit.h"
#include "solver/grasp.h"
#include "solver/grasp_obstacles.h"

namespace holdfast::apps {
namespace {

struct Options {
  CommonOptions common;
  std::string clip;
  std::string object;
  std::string output;
  std::string body;
  std::string hand = "right";
  std::string precision = "single";
  int object_vertices = 300;
  double object_scale = 1.0;
  int start = 0;
  int end = -1;
  bool regrasp = false;
  FitOptions fit;
  double contact_threshold_mm = 10.0;
  ContactProtocol protocol;
};

// Closes the hand around the object in the clip's first frame and writes both into the clip.
// Returns false when there is nothing to hold on to.
bool GraspFirstFrame(const Options& options, const HandModel& hand, const LoadedObject& object,
                     const SignedDistance& surface, const BodySurface& body, Clip& clip,
                     nlohmann::json& summary) {
  const CommonOptions& common = options.common;
  HandState state(hand);
  state.SetBody(clip.pose[0], clip.trans.col(0));
  GraspOptions grasp_options;
  grasp_options.seed = common.seed;
  grasp_options.threads = NumThreads(common);
  grasp_options.up_in_wrist = {state.WristRotation().transpose() * Eigen::Vector3d::UnitZ()};
  // A hand is about 20 cm long: nothing farther than that and the object's own size is met.
  grasp_options.obstacles_in_wrist =
      BodyAroundWrist(clip, body, hand.HandSide(), 0.2 + Extent(object.mesh).norm());
  DistanceGridOptions grid_options;
  grid_options.threads = NumThreads(common);
  const DistanceGrid grid(surface, grid_options);
  GraspReport report;
  Progress progress(common, "grasp");
  const Grasp grasp =
      CloseHand(hand, object.mesh, surface, grid, grasp_options, &report, [&](double share) {
        progress.Update(static_cast<int>(100 * share), 100);
        return !Interrupted();
      });
  summary = {{"made", true},
             {"status", Describe(report.status)},
             {"style", StyleName(grasp.style)},
             {"score", grasp.score},
             {"wrench_quality", grasp.wrench_quality},
             {"max_penetration_mm", grasp.max_penetration_mm},
             {"frames_through_body_ratio", grasp.blocked},
             {"search_ms", report.search_ms + report.closing_ms + report.refinement_ms}};
  if (report.status == GraspStatus::kNothingToGrasp || report.status == GraspStatus::kNoRoom ||
      report.status == GraspStatus::kStopped) {
    return false;
  }
  if (report.status == GraspStatus::kNoCleanGrasp) {
    Note(common,
         fmt::format("warning: {}: the least bad grasp is carried on", Describe(report.status)));
  }
  if (grasp.blocked > 0.0) {
    Note(common, fmt::format("warning: the object meets the body in about {:.0f} % of the frames",
                             100.0 * grasp.blocked));
  }
  const Eigen::Isometry3d pose = ObjectInWorld(grasp, state.WristRotation(), state.WristPosition());
  clip.object.emplace();
  clip.object->trans.setZero(3, clip.NumFrames());
  clip.object->orient.setZero(3, clip.NumFrames());
  clip.object->trans.col(0) = pose.translation();
  clip.object->orient.col(0) = LogSO3(pose.linear());
  SetFingers(clip.pose[0], hand.HandSide(), grasp.fingers);
  return true;
}

nlohmann::json OptionsJson(const Options& options) {
  return {{"clip", options.clip},
          {"object", options.object},
          {"object_scale", options.object_scale},
          {"hand", options.hand},
          {"body", options.body.empty() ? "holdfast_neutral" : options.body},
          {"start", options.start},
          {"end", options.end},
          {"object_vertices", options.object_vertices},
          {"lambda_distance", options.fit.lambda_distance},
          {"lambda_contact", options.fit.lambda_contact},
          {"lambda_temporal", options.fit.lambda_temporal},
          {"contact_threshold_mm", options.contact_threshold_mm},
          {"precision", options.precision},
          {"max_iterations", options.fit.max_iterations}};
}

int Run(Options options) {
  const CommonOptions& common = options.common;
  ResultFolder folder(options.output, common.force);
  const Side side = options.hand == "left" ? Side::kLeft : Side::kRight;
  options.fit.contact_threshold_m = 1e-3 * options.contact_threshold_mm;
  options.fit.precision =
      options.precision == "double" ? PairPrecision::kDouble : PairPrecision::kSingle;
  options.protocol.threads = NumThreads(common);

  const auto body = LoadBody(options.body);
  Clip clip = LoadClip(options.clip);
  const int end = options.end < 0 ? clip.NumFrames() : std::min(options.end, clip.NumFrames());
  if (options.start >= end) {
    throw Error(options.clip,
                fmt::format("has {} frames: nothing between {} and {}", clip.NumFrames(),
                            options.start, end),
                "Give --start and --end within the clip");
  }
  clip = Slice(clip, options.start, end);
  const LoadedObject object = LoadObject(options.object, options.object_scale);
  for (const std::string& note : object.notes) Note(common, "note: " + note);
  const bool needs_grasp = !clip.object || options.regrasp;
  if (needs_grasp) RequireHandheld(object);
  std::vector<std::string> decimation_notes;
  const TriangleMesh simplified = ForFitting(object, options.object_vertices, &decimation_notes);
  for (const std::string& note : decimation_notes) Note(common, "note: " + note);
  const Eigen::VectorXd betas = BetasFor(clip, *body, common);
  const HandModel hand(body, betas, side);
  const SignedDistance surface(object.mesh);

  nlohmann::json grasp = {{"made", false}};
  if (needs_grasp) {
    const bool held =
        GraspFirstFrame(options, hand, object, surface, BodySurface(body, betas), clip, grasp);
    if (Interrupted()) return kInterrupted;
    if (!held) {
      throw FitFailure(fmt::format("{}: {}. Try --hand {}, or another object size (--object-scale)",
                                   options.object, grasp["status"].get<std::string>(),
                                   side == Side::kRight ? "left" : "right"));
    }
  }
  clip.object->name = object.name;
  clip.object->mesh = "object.ply";

  const auto fit_begin = std::chrono::steady_clock::now();
  Progress fit_progress(common, "fit");
  const FitResult result =
      FitClip(clip, hand, simplified.vertices, options.fit, [&](int done, int total) {
        fit_progress.Update(done, total);
        return !Interrupted();
      });
  const double fit_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - fit_begin).count();
  if (Interrupted()) return kInterrupted;
  Progress metric_progress(common, "metrics");
  const std::vector<ContactMetrics> contact =
      MeasureClipContact(result.clip, hand, surface, options.protocol, [&](int done, int total) {
        metric_progress.Update(done, total);
        return !Interrupted();
      });
  if (Interrupted()) return kInterrupted;

  const FitSummary summary = SummarizeFit(result, contact);
  nlohmann::json metrics = JsonHead("holdfast/fit/1", common);
  metrics["options"] = OptionsJson(options);
  metrics["grasp"] = grasp;
  metrics["protocol"] = ProtocolJson(options.protocol, object.mesh, surface, hand);
  metrics["notes"] = object.notes;
  metrics["summary"] = SummaryJson(summary);
  metrics["per_frame"] = PerFrameJson(result, contact);

  WriteClip(result.clip, folder / "clip.npz");
  WriteMesh(object.mesh, folder / "object.ply");
  WriteAtomically(folder / "metrics.json", metrics.dump(1) + "\n");
  folder.Commit();

  nlohmann::json printed = metrics;
  printed.erase("per_frame");
  printed["output"] = options.output;
  PrintResult(
      common, printed,
      fmt::format("{}/clip.npz: {} held by the {} hand through {} frames\n{}  whole fit {:.2f} s\n",
                  options.output, object.name, SideName(side), summary.frames,
                  SummaryText(summary, options.protocol), fit_s));
  return summary.failed > 0 ? kFitFault : kDone;
}

}  // namespace

void AddFitCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "fit", "Carry an object through a motion: object pose and fingers, frame by frame");
  command->add_option("clip", options->clip, "Clip (.npz) or embedded clip")->required();
  command->add_option("object", options->object, "Mesh (.obj .ply .stl .off) or embedded object")
      ->required();
  command
      ->add_option("-o,--output", options->output,
                   "Folder to make: clip.npz, object.ply, metrics.json")
      ->required();
  command->add_option("--hand", options->hand, "The hand that holds")
      ->capture_default_str()
      ->check(CLI::IsMember({"right", "left"}));
  command->add_option("--body", options->body,
                      "Body model (SMPLX_*.npz); the embedded body if left out");
  command->add_option("--start", options->start, "First frame to fit")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command->add_option("--end", options->end, "Frame to stop before; -1 is the clip's end")
      ->capture_default_str();
  command->add_flag("--regrasp", options->regrasp,
                    "Make a new grasp even if the clip has an object");
  command
      ->add_option("--object-scale", options->object_scale,
                   "Multiplies the object's coordinates (0.001 for millimetres)")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--object-vertices", options->object_vertices,
                   "Vertices that the object is simplified to")
      ->capture_default_str()
      ->check(CLI::Range(4, 100'000));
  command
      ->add_option("--lambda-distance", options->fit.lambda_distance,
                   "Weight of E_d: hand and object keep their distances (paper eq. 7)")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--lambda-contact", options->fit.lambda_contact,
                   "Weight of E_c: what touched stays together (paper eq. 8)")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--lambda-temporal", options->fit.lambda_temporal,
                   "Weight of E_t: little change between frames (paper eq. 9)")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--contact-threshold", options->contact_threshold_mm,
                   "tau: pairs closer than this in the first frame are in contact, mm")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  command->add_option("--max-iterations", options->fit.max_iterations, "Per frame")
      ->capture_default_str()
      ->check(CLI::Range(1, 10'000));
  command->add_option("--precision", options->precision, "Arithmetic of the pair loop")
      ->capture_default_str()
      ->check(CLI::IsMember({"single", "double"}));
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast fit demo_drink mug -o held\n"
      "  holdfast fit reach.npz banana.obj -o held --hand left --json\n"
      "  holdfast fit grab_clip.npz phone -o held --body SMPLX_NEUTRAL.npz --start 40\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
