// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/fit_library.h"
#include "apps/fit_metrics.h"
#include "apps/result_folder.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/score/contact_score.h"
#include "solver/fit/clip_refinement.h"
#include "solver/fit/clip_state.h"
#include "solver/handover/holding.h"

namespace holdfast::apps {
namespace {

struct RefineCommand {
  CommonOptions common;
  ClipInputOptions input;
  std::string clip;
  std::string output;
  std::string hand = "auto";
  int object_vertices = 300;
  FitOptions fit = RefinementOptions();
  ContactProtocol protocol;
};

// One clip in numbers, over the hands that hold.
struct Measured {
  ContactScore contact;
  CarryJitter jitter;
};

Measured Measure(const Clip& clip, const std::vector<const HandModel*>& hands,
                 const std::vector<std::uint8_t>& holding, const PreparedObject& object,
                 const RefineCommand& options) {
  const std::vector<HandObjectScore> scores =
      MeasureHands(clip, hands, holding, object.solid, options.protocol, options.common);
  if (Interrupted()) return {};
  return {ScoreContact(scores), MeanJitter(scores)};
}

nlohmann::json OrNull(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json();
}

nlohmann::json MeasuredJson(const Measured& measured) {
  const ContactScore& contact = measured.contact;
  const Unevenness& object = measured.jitter.object;
  return {{"max_penetration_depth_mm", contact.penetration_max_mm},
          {"mean_max_penetration_depth_mm", contact.penetration_mean_max_mm},
          {"frames_deeper_than_2_mm", contact.deep_frames},
          {"mean_intersection_volume_cm3", contact.voxel_volume_cm3},
          {"frames_in_contact_ratio", OrNull(contact.contact_frames_ratio)},
          {"object_acceleration_m_s2", OrNull(object.acceleration_m_s2)},
          {"object_jerk_m_s3", OrNull(object.jerk_m_s3)},
          {"object_angular_acceleration_rad_s2", OrNull(object.angular_acceleration_rad_s2)},
          {"object_acceleration_against_hand", OrNull(measured.jitter.acceleration_ratio)}};
}

// How far the refined object is from the data, per frame.
struct Distance {
  Distance(const Clip& data, const Clip& refined) {
    const std::vector<Eigen::Isometry3d> from = ObjectPoses(data), to = ObjectPoses(refined);
    double shift = 0.0, turn = 0.0;
    for (std::size_t t = 0; t < from.size(); ++t) {
      mm.push_back(1e3 * (to[t].translation() - from[t].translation()).norm());
      degrees.push_back(180.0 / std::numbers::pi *
                        Eigen::AngleAxisd(from[t].linear().transpose() * to[t].linear()).angle());
      shift += mm.back() * mm.back();
      turn += degrees.back() * degrees.back();
    }
    const auto count = static_cast<double>(from.size());
    rms_mm = std::sqrt(shift / count);
    rms_degrees = std::sqrt(turn / count);
  }
  std::vector<double> mm, degrees;
  double rms_mm, rms_degrees;
};

std::vector<std::uint8_t> WhoHolds(const RefineCommand& options, const Clip& clip,
                                   const HandModel& right, const HandModel& left,
                                   const DistanceGrid& object) {
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  if (options.hand == "right") return std::vector<std::uint8_t>(frames, kHoldsRight);
  if (options.hand == "left") return std::vector<std::uint8_t>(frames, kHoldsLeft);
  if (options.hand == "both") {
    return std::vector<std::uint8_t>(frames, kHoldsRight | kHoldsLeft);
  }
  if (options.hand == "clip") {
    if (clip.holding_hand.empty()) {
      throw Error(options.clip, "has no holding_hand", "Leave out --hand clip");
    }
    return clip.holding_hand;
  }
  HoldingOptions holding;
  holding.threads = NumThreads(options.common);
  return FindHolding(clip, right, left, object, holding).hands;
}

std::string Text(const RefineCommand& options, const Measured& before, const Measured& after,
                 const Distance& distance, const RefineResult& result) {
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
  for (const RefinedHold& hold : result.holds) {
    text += fmt::format("  frames {}-{}: {} hand, {} (moves {:.1f} mm, {:.1f} degrees in it)\n",
                        hold.begin, hold.end - 1, SideName(hold.side),
                        hold.rigid ? "held firmly" : "slips", hold.movement_mm, hold.movement_deg);
  }
  for (const RefinedRest& rest : result.rests) {
    text += fmt::format("  frames {}-{}: at rest, {:.3f} m above the ground\n", rest.begin,
                        rest.end - 1, rest.height_m);
  }
  return text + fmt::format("  solved in {:.0f} ms, {} iterations\n", result.report.solve_ms,
                            result.report.iterations);
}

nlohmann::json HoldsJson(const RefineResult& result) {
  nlohmann::json holds = nlohmann::json::array(), rests = nlohmann::json::array();
  for (const RefinedHold& hold : result.holds) {
    holds.push_back({{"hand", SideName(hold.side)},
                     {"begin", hold.begin},
                     {"end", hold.end},
                     {"rigid", hold.rigid},
                     {"noise_mm", hold.noise_mm},
                     {"movement_mm", hold.movement_mm},
                     {"movement_deg", hold.movement_deg}});
  }
  for (const RefinedRest& rest : result.rests) {
    rests.push_back({{"begin", rest.begin}, {"end", rest.end}, {"height_m", rest.height_m}});
  }
  return {{"holds", holds}, {"rests", rests}};
}

int Refine(RefineCommand& options) {
  ResultFolder folder(options.output, options.common.force);
  const int threads = NumThreads(options.common);
  options.protocol.threads = options.fit.threads = threads;
  ClipInput input = LoadClipInput(options.clip, options.input, options.common);
  if (!input.clip.object) {
    throw Error(options.clip, "has no object trajectory to refine",
                "Make one with 'holdfast fit', or give a clip with object_trans and object_orient");
  }
  if (!input.object) {
    throw Error(options.clip, "its object's mesh is missing: " + input.object_missing,
                "Say where it is with --object");
  }
  if (input.object_source.empty()) {
    throw Error(options.clip, "holds its object's mesh itself",
                "Make a clip and a mesh of it first, with 'holdfast import'");
  }
  if (!options.input.object.empty()) {
    const std::optional<TriangleMesh> own = MeshNamedBy(input.clip, options.clip);
    if (own && !SameSurface(*own, *input.object)) {
      throw Error(options.input.object,
                  "is not the object whose trajectory the clip has: " + input.clip.object->mesh,
                  fmt::format("Leave out --object, or fit it anew: holdfast fit {} {}",
                              options.clip, options.input.object));
    }
  }
  FitLibrary library;
  const auto object =
      library.Object(input.object_source, input.object_scale, options.object_vertices, threads);
  for (const std::string& note : object->notes) Note(options.common, "note: " + note);
  const HandModel right(input.body, input.betas, Side::kRight);
  const HandModel left(input.body, input.betas, Side::kLeft);
  const std::vector<std::uint8_t> holding =
      WhoHolds(options, input.clip, right, left, *object->fit.distance);
  std::vector<const HandModel*> hands;
  for (const HandModel* hand : {&right, &left}) {
    const std::uint8_t bit = HoldingBit(hand->HandSide());
    if (std::ranges::any_of(holding, [&](std::uint8_t bits) { return (bits & bit) != 0; })) {
      hands.push_back(hand);
    }
  }
  for (const HandModel* hand : hands) RequireHands(*input.body, HoldingBit(hand->HandSide()));
  if (hands.empty()) {
    throw Error(options.clip, "has an object that no hand holds in any frame",
                "Say which hand does with --hand");
  }

  Progress progress(options.common, "refine");
  RefineResult result =
      RefineClip(input.clip, hands, object->fit, holding, options.fit, [&](int done, int total) {
        progress.Update(done, total);
        return !Interrupted();
      });
  if (Interrupted()) return kInterrupted;
  if (result.report.failed) {
    throw FitFailure(options.clip + ": the solve came to numbers that are not finite");
  }
  result.clip.object->name = object->object.name;
  result.clip.object->mesh = "object.ply";

  const std::vector<std::uint8_t>& held = result.clip.holding_hand;
  const Measured before = Measure(input.clip, hands, held, *object, options);
  if (Interrupted()) return kInterrupted;
  const Measured after = Measure(result.clip, hands, held, *object, options);
  if (Interrupted()) return kInterrupted;
  if (after.contact.contact_frames_ratio.value_or(0.0) == 0.0) {
    throw FitFailure(fmt::format(
        "{}: no hand that holds touches {} in any frame, so that nothing is written. Say who holds "
        "with --hand, or make a new grasp with 'holdfast fit --regrasp'",
        options.clip, input.object_source));
  }
  const Distance distance(input.clip, result.clip);

  nlohmann::json metrics = JsonHead("holdfast/refine/1", options.common);
  metrics["options"] = {{"clip", options.clip},
                        {"hand", options.hand},
                        {"object", input.object_source},
                        {"object_vertices", options.object_vertices},
                        {"lambda_distance", options.fit.lambda_distance},
                        {"lambda_contact", options.fit.lambda_contact},
                        {"lambda_slip", options.fit.lambda_slip},
                        {"lambda_penetration", options.fit.lambda_penetration},
                        {"lambda_object_in_hand", options.fit.lambda_object_in_hand},
                        {"lambda_fingers", options.fit.lambda_fingers},
                        {"lambda_object", options.fit.lambda_object},
                        {"lambda_support", options.fit.lambda_support},
                        {"lambda_acceleration", options.fit.lambda_acceleration}};
  metrics["protocol"] = ProtocolJson(options.protocol, object->solid, *hands.front());
  metrics["before"] = MeasuredJson(before);
  metrics["after"] = MeasuredJson(after);
  metrics["distance_to_data"] = {{"rms_mm", distance.rms_mm}, {"rms_deg", distance.rms_degrees}};
  metrics.update(HoldsJson(result));
  metrics["solve"] = {{"iterations", result.report.iterations},
                      {"converged", result.report.converged},
                      {"cost_before", result.report.cost_before},
                      {"cost_after", result.report.cost_after}};
  nlohmann::json summary = metrics;
  summary["output"] = options.output;
  nlohmann::json depth_before = nlohmann::json::array(), depth_after = nlohmann::json::array();
  for (const auto& frame : before.contact.frames) depth_before.push_back(frame.penetration_mm);
  for (const auto& frame : after.contact.frames) depth_after.push_back(frame.penetration_mm);
  metrics["per_frame"] = {{"holding_hand", held},
                          {"penetration_depth_before_mm", depth_before},
                          {"penetration_depth_mm", depth_after},
                          {"distance_to_data_mm", distance.mm},
                          {"distance_to_data_deg", distance.degrees}};

  WriteClip(result.clip, folder / "clip.npz");
  WriteMesh(object->object.mesh, folder / "object.ply");
  WriteAtomically(folder / "metrics.json", metrics.dump(1) + "\n");
  folder.Commit();
  PrintResult(options.common, summary, Text(options, before, after, distance, result));
  return kDone;
}

}  // namespace

void AddRefineCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<RefineCommand>();
  CLI::App* command = app.add_subcommand(
      "refine", "Clean a clip that has its object's trajectory: penetration, jitter, lost contact");
  command->add_option("clip", options->clip, kClipHelp)->required();
  command
      ->add_option("-o,--output", options->output,
                   "Folder to make: clip.npz, object.ply, metrics.json with before and after")
      ->required();
  command
      ->add_option("--hand", options->hand,
                   "Who holds. auto: found in the clip; clip: as its holding_hand says")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "clip", "right", "left", "both"}));
  AddClipInputOptions(*command, options->input);
  command
      ->add_option("--object-vertices", options->object_vertices,
                   "Vertices that the object is simplified to")
      ->capture_default_str()
      ->check(CLI::Range(4, 100'000));
  const auto weight = [&](const char* name, double& value, const char* help) {
    command->add_option(name, value, help)->capture_default_str()->check(CLI::NonNegativeNumber);
  };
  weight("--lambda-object", options->fit.lambda_object,
         "Weight of the object's way from the data, per m2 and frame");
  weight("--lambda-fingers", options->fit.lambda_fingers,
         "Weight of the fingers' way from the data, per rad2 and frame");
  weight("--lambda-acceleration", options->fit.lambda_acceleration,
         "Weight of second differences: more removes more jitter");
  weight("--lambda-support", options->fit.lambda_support,
         "Weight of where an object that nobody holds lies");
  weight("--lambda-penetration", options->fit.lambda_penetration,
         "Weight of E_p: the hand stays out of the object");
  weight("--lambda-object-in-hand", options->fit.lambda_object_in_hand,
         "Weight of E_o: the object stays out of the hand (thin walls, blades)");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast refine captured.npz --object mug.obj -o clean\n"
                   "  holdfast refine held -o refined --hand right --json\n");
  command->callback([options, &exit_code] { exit_code = Refine(*options); });
}

}  // namespace holdfast::apps
