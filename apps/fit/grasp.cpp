// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/grasp_place_input.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/rotation.h"
#include "solver/carry/first_grasp.h"
#include "solver/carry/standing_grasp.h"
#include "solver/fit/clip_state.h"
#include "solver/grasp/grasp_both.h"
#include "solver/grasp/grasp_set_output.h"

namespace holdfast::apps {
namespace {

struct GraspCommand {
  CommonOptions common;
  std::string object;
  std::string output;
  std::string body;
  std::string hand = "auto";
  std::string style = "auto";
  std::string use = "auto";
  std::string clip;
  int frame = 0;
  double object_scale = 1.0;
  GraspPlaceInput place;
  GraspOptions grasp;
  int count = 0;
  double apart_cm = 100.0 * GraspSetOptions{}.apart_m;
  double apart_deg = GraspSetOptions{}.apart_rad / kDegree;
};

// The hand that is to hold: the only one of a hand alone, else the right if nothing is asked for.
Side HandFor(const GraspCommand& options, const BodyModel& body) {
  const Side side = options.hand == "auto"   ? body.LoneHand().value_or(Side::kRight)
                    : options.hand == "left" ? Side::kLeft
                                             : Side::kRight;
  RequireHands(body, HoldingBit(side));
  return side;
}

std::vector<std::string> TouchingParts(const Grasp& grasp) {
  constexpr int kOrder[kNumFingers] = {kThumb, kIndex, kMiddle, kRing, kPinky};
  std::vector<std::string> names;
  for (const int finger : kOrder) {
    if (grasp.fingers_touching[finger]) names.emplace_back(kFingerNames[finger]);
  }
  if (grasp.palm_touching) names.emplace_back("palm");
  return names;
}

// Of skin in the object and the object's surface in the hand.
double Deepest_mm(const Grasp& grasp) {
  return std::max(grasp.max_penetration_mm, grasp.object_in_hand_mm);
}

nlohmann::json CertificateJson(const Grasp& grasp) {
  if (!grasp.certificate) return nullptr;
  const GraspCertificate& certificate = *grasp.certificate;
  return {
      {"least_friction", certificate.least_friction ? nlohmann::json(*certificate.least_friction)
                                                    : nlohmann::json(nullptr)},
      {"ball_lower", certificate.ball_lower},
      {"ball_upper", certificate.ball_upper},
      {"friction", certificate.friction},
      {"length_m", certificate.length_m},
      {"contacts", certificate.contacts}};
}

// What the certificate says, or why there is none.
std::string CertificateText(const Grasp& grasp, const TriangleMesh& object) {
  if (!grasp.certificate) return "no certificate: " + WhyNotSolid(object);
  const GraspCertificate& certificate = *grasp.certificate;
  if (!certificate.least_friction) return "does not hold gravity in every direction";
  return fmt::format("holds gravity in any direction with friction {:.2f} or more",
                     std::ceil(100.0 * *certificate.least_friction - 1e-6) / 100.0);
}

nlohmann::json GraspJson(const Grasp& grasp) {
  return {{"style", StyleName(grasp.style)},
          {"touching", TouchingParts(grasp)},
          {"fingers_through_handle",
           std::count(grasp.fingers_through.begin(), grasp.fingers_through.end(), true)},
          {"score", grasp.score},
          {"wrench_quality", grasp.wrench_quality},
          {"upright_cosine", grasp.upright},
          {"skin_in_object_mm", grasp.max_penetration_mm},
          {"object_in_hand_mm", grasp.object_in_hand_mm},
          {"fingers_in_each_other_mm", grasp.self_penetration_mm},
          {"limit_excess_deg", grasp.limit_excess_deg}};
}

// The two files that are written.
struct GraspFiles {
  std::filesystem::path clip, mesh;
};

// Throws Error unless both are new.
GraspFiles NewGraspFiles(const GraspCommand& options) {
  const std::filesystem::path output(options.output);
  std::filesystem::path mesh_path = output;
  mesh_path.replace_filename(output.stem().string() + "_object.ply");
  RequireNew(output, options.common);
  RequireNew(mesh_path, options.common);
  return {output, mesh_path};
}

LoadedObject LoadGraspable(const GraspCommand& options, bool both_hands) {
  LoadedObject object = LoadObject(options.object, options.object_scale);
  for (const std::string& note : object.notes) Note(options.common, "note: " + note);
  if (const auto why = WhyTooLarge(object, both_hands)) throw FitFailure(*why);
  return object;
}

std::string MeasuresText(const TriangleMesh& object) {
  const Eigen::Vector3d extent = 100.0 * Extent(object);
  return fmt::format("The object measures {:.1f} x {:.1f} x {:.1f} cm", extent.x(), extent.y(),
                     extent.z());
}

void WriteGrasp(const LoadedObject& object, const GraspFiles& files, Clip& clip) {
  clip.object->mesh = files.mesh.filename().string();
  WriteMesh(object.mesh, files.mesh);
  WriteClip(clip, object.mesh, files.clip);
}

nlohmann::json GraspSummaryHead(const char* schema, const CommonOptions& common,
                                const GraspFiles& files, const LoadedObject& object,
                                std::string_view hand) {
  nlohmann::json summary = JsonHead(schema, common);
  summary["output"] = files.clip.string();
  summary["object"] = object.name;
  summary["object_mesh"] = files.mesh.string();
  summary["hand"] = hand;
  return summary;
}

void RequireFound(const GraspCommand& options, const LoadedObject& object,
                  const GraspReport& report) {
  if (report.status == GraspStatus::kFound) return;
  std::string why = fmt::format("{}: {}", object.name, Describe(report.status));
  if (!report.candidates.empty()) why += " (best try: " + report.candidates.front().refused + ")";
  throw FitFailure(
      fmt::format("{}. {}; a hand spans about 10 cm. {}, or try --closings {} --seed {}", why,
                  MeasuresText(object.mesh),
                  options.grasp.place ? "Choose another place" : "Check its unit (--object-scale)",
                  4 * options.grasp.closings, options.common.seed + 1));
}

void PrintGrasp(const GraspCommand& options, const GraspFiles& files, const LoadedObject& object,
                Side side, const Grasp& grasp, const GraspReport& report) {
  nlohmann::json summary =
      GraspSummaryHead("holdfast/grasp/1", options.common, files, object, SideName(side));
  summary["grasp"] = GraspJson(grasp);
  summary["certificate"] = CertificateJson(grasp);
  summary["grasp"]["use"] = UseName(report.use);
  summary["contact"] = {{"hand_in_object_max_mm", grasp.metrics.max_penetration_mm},
                        {"hand_in_object_mean_mm", grasp.metrics.mean_penetration_mm},
                        {"contact_ratio", grasp.metrics.contact_ratio},
                        {"contact_threshold_mm", ContactProtocol{}.contact_threshold_mm},
                        {"intersection_volume_cm3", grasp.metrics.intersection_volume_cm3}};
  if (options.grasp.place) {
    summary["place"] = GraspPlaceJson(options.place);
    summary["place"]["contacts_outside_ratio"] = grasp.outside_place;
    summary["place"]["from_point_mm"] = 1000.0 * grasp.from_place_m;
  }
  summary["search"] = {{"places", report.oppositions},
                       {"placements", report.placements},
                       {"closed", report.closings},
                       {"refined", report.refinements},
                       {"search_ms", report.search_ms},
                       {"closing_ms", report.closing_ms},
                       {"refinement_ms", report.refinement_ms}};
  PrintResult(
      options.common, summary,
      fmt::format(
          "{}: {} grasp of {} ({}) with the {} hand ({})\n"
          "  {:.2f} mm deepest penetration, {:.0f} % of the hand in contact, quality {:.2f}\n"
          "  {}\n"
          "  {} of {} placements closed, {} refined in {:.1f} s\n",
          files.clip.string(), StyleName(grasp.style), object.name, UseName(report.use),
          SideName(side), fmt::join(TouchingParts(grasp), ", "), Deepest_mm(grasp),
          100.0 * grasp.metrics.contact_ratio, grasp.wrench_quality,
          CertificateText(grasp, object.mesh), report.closings, report.placements,
          report.refinements,
          1e-3 * (report.search_ms + report.closing_ms + report.refinement_ms)));
}

// Fills in what the command line says of the search.
void PrepareSearch(const LoadedObject& object, GraspCommand& options) {
  options.grasp.style = StyleByName(options.style);
  options.grasp.use = UseByName(options.use);
  if (const auto wanted = WantedPlace(options.place, options.object, options.object_scale)) {
    options.grasp.place = std::make_shared<const GraspPlace>(object.mesh, *wanted);
  }
  options.grasp.seed = options.common.seed;
  options.grasp.threads = NumThreads(options.common);
}

void WriteGrasps(const GraspCommand& options, const LoadedObject& object, Side side,
                 StandingGraspSet& held) {
  const std::filesystem::path folder(options.output);
  NpzWriter arrays;
  for (auto& [name, array] : GraspSetArrays(held.set, object.name, side)) {
    arrays.Add(name, std::move(array));
  }
  std::filesystem::create_directories(folder);
  arrays.Write(folder / "grasps.npz");
  WriteAtomically(folder / "grasps.csv", GraspSetCsv(held.set));
  WriteGrasp(object, {folder / "clip.npz", folder / "object.ply"}, held.clip);
}

void PrintGrasps(const GraspCommand& options, const LoadedObject& object, Side side,
                 const GraspSet& set) {
  nlohmann::json summary = JsonHead("holdfast/grasps/1", options.common);
  summary["output"] = options.output;
  summary["object"] = object.name;
  summary["hand"] = SideName(side);
  summary["use"] = UseName(set.use);
  summary["asked"] = options.count;
  summary["found"] = set.grasps.size();
  std::vector<double> frictions, depths;
  std::map<std::string, int> styles;
  for (const CertifiedGrasp& one : set.grasps) {
    frictions.push_back(one.grasp.certificate->least_friction.value_or(0.0));
    depths.push_back(Deepest_mm(one.grasp));
    ++styles[std::string(StyleName(one.grasp.style))];
  }
  const double seconds = 1e-3 * set.milliseconds;
  const double friction = *std::max_element(frictions.begin(), frictions.end());
  const double depth = *std::max_element(depths.begin(), depths.end());
  summary["styles"] = styles;
  summary["least_friction_max"] = friction;
  summary["deepest_mm_max"] = depth;
  summary["search"] = {{"placements", set.placements},
                       {"closed", set.closings},
                       {"refined", set.refinements},
                       {"search_ms", set.milliseconds}};
  PrintResult(options.common, summary,
              fmt::format("{}: {} distinct grasps of {} with the {} hand\n"
                          "  at most {:.2f} mm deep; each holds gravity in any direction with "
                          "friction {:.3f}\n"
                          "  {} placements closed, {} refined in {:.1f} s: {:.0f} grasps a second\n"
                          "  grasps.npz, grasps.csv; clip.npz shows the first {}, a frame each\n",
                          options.output, set.grasps.size(), object.name, SideName(side), depth,
                          friction, set.closings, set.refinements, seconds,
                          static_cast<double>(set.grasps.size()) / seconds,
                          std::min<std::size_t>(set.grasps.size(), kMostShown)));
}

// Many distinct grasps into a folder; fewer than asked for are written, too, and after Ctrl-C those
// found until then.
int RunMany(GraspCommand options) {
  const CommonOptions& common = options.common;
  RequireNewFolder(options.output, common);
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  const Side side = HandFor(options, *body);
  const LoadedObject object = LoadGraspable(options, false);
  PrepareSearch(object, options);
  GraspSetOptions set_options;
  set_options.count = options.count;
  set_options.apart_m = 0.01 * options.apart_cm;
  set_options.apart_rad = options.apart_deg * kDegree;
  set_options.search = options.grasp;
  StandingGraspSet held;
  {
    Progress progress(common, "grasps");
    held = GraspsStanding(body, side, object, set_options, [&](double share) {
      progress.Update(static_cast<int>(options.count * share), options.count);
      return !Interrupted();
    });
  }
  const bool stopped = held.set.status == GraspStatus::kStopped;
  if (stopped && held.set.grasps.empty()) return kInterrupted;
  if (held.set.grasps.empty()) {
    throw FitFailure(fmt::format("{}: {} ({} hands closed). {}", object.name,
                                 Describe(held.set.status), held.set.closings,
                                 MeasuresText(object.mesh)));
  }
  WriteGrasps(options, object, side, held);
  PrintGrasps(options, object, side, held.set);
  if (stopped) {
    Note(common, fmt::format("warning: interrupted: {} of the {} grasps asked for were found until "
                             "then, and are in {}",
                             held.set.grasps.size(), options.count, options.output));
    return kInterrupted;
  }
  if (held.set.status == GraspStatus::kFound) return kDone;
  Note(common, fmt::format("warning: {} of the {} grasps asked for were found. For more, let them "
                           "be closer together (--apart, --apart-angle)",
                           held.set.grasps.size(), options.count));
  return kFitFault;
}

int Run(GraspCommand options) {
  const CommonOptions& common = options.common;
  const GraspFiles files = NewGraspFiles(options);
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  const Side side = HandFor(options, *body);
  const LoadedObject object = LoadGraspable(options, false);
  PrepareSearch(object, options);
  StandingGrasp held;
  {
    Progress progress(common, "grasp");
    held = GraspStanding(body, side, object, options.grasp, [&](double share) {
      progress.Update(static_cast<int>(100 * share), 100);
      return !Interrupted();
    });
  }
  if (Interrupted()) return kInterrupted;
  RequireFound(options, object, held.report);
  WriteGrasp(object, files, held.clip);
  PrintGrasp(options, files, object, side, held.grasp, held.report);
  return kDone;
}

// The clip of one frame that both hands start from; `person` becomes its body.
Clip StartForBoth(const GraspCommand& options, ClipBody& person) {
  if (options.clip.empty()) return StandWithForearmsForward(person.model);
  LoadedClip loaded = LoadClip(options.clip, std::move(person.model), options.common);
  const Clip clip = std::move(loaded.clip);
  person = std::move(loaded.body);
  if (options.frame >= clip.NumFrames()) {
    throw Error(options.clip,
                fmt::format("has {} frames: none is number {}", clip.NumFrames(), options.frame),
                "Give --frame within the clip, counted from 0");
  }
  return Slice(clip, options.frame, options.frame + 1);
}

void PrintBothHandsGrasp(const GraspCommand& options, const GraspFiles& files,
                         const LoadedObject& object, const BothHandsGrasp& grasp, bool has_place) {
  nlohmann::json summary =
      GraspSummaryHead("holdfast/grasp_both/1", options.common, files, object, "both");
  summary["width_mm"] = 1000.0 * grasp.width_m;
  summary["upright_cosine"] = grasp.upright;
  summary["body_in_object_mm"] = grasp.in_body_mm;
  if (has_place) {
    summary["place"] = GraspPlaceJson(options.place);
    summary["place"]["contacts_outside_ratio"] =
        std::max(grasp.hands[0].outside_place, grasp.hands[1].outside_place);
  }
  std::string text = fmt::format("{}: {} between both hands, {:.0f} mm apart\n",
                                 files.clip.string(), object.name, 1000.0 * grasp.width_m);
  for (int h = 0; h < 2; ++h) {
    const char* name = h == 0 ? "right" : "left";
    summary[name] = GraspJson(grasp.hands[h]);
    summary[name].erase("style");
    summary[name].erase("fingers_through_handle");
    summary[name]["wrist_shift_mm"] = grasp.wrist_shift_mm[h];
    summary[name]["wrist_turn_deg"] = grasp.wrist_turn_deg[h];
    text += fmt::format(
        "  {}: {} touch, {:.2f} mm deepest penetration, wrist moved {:.0f} mm and {:.0f} degrees\n",
        name, fmt::join(TouchingParts(grasp.hands[h]), ", "), Deepest_mm(grasp.hands[h]),
        grasp.wrist_shift_mm[h], grasp.wrist_turn_deg[h]);
  }
  PrintResult(options.common, summary, text);
}

// An object between both hands: of a person who stands with the forearms forward, or of a frame.
int RunBoth(const GraspCommand& options) {
  const CommonOptions& common = options.common;
  const GraspFiles files = NewGraspFiles(options);
  ClipBody person{LoadBody(options.body), {}};
  RequireHands(*person.model, kHoldsRight | kHoldsLeft);
  const LoadedObject object = LoadGraspable(options, true);

  Clip clip = StartForBoth(options, person);
  const std::shared_ptr<const BodyModel> body = std::move(person.model);
  const Eigen::VectorXd betas = std::move(person.betas);
  const HandModel right(body, betas, Side::kRight), left(body, betas, Side::kLeft);
  const SignedDistance surface(object.mesh);
  DistanceGridOptions grid_options;
  grid_options.threads = NumThreads(common);
  const DistanceGrid grid(surface, grid_options);
  BothHandsOptions both_options;
  both_options.seed = common.seed;
  both_options.threads = NumThreads(common);
  if (auto wanted = WantedPlace(options.place, options.object, options.object_scale)) {
    wanted->span_m = both_options.max_width_m;
    both_options.place = std::make_shared<const GraspPlace>(object.mesh, *wanted);
  }
  const BothHandsGrasp grasp = HoldInBothHands(right, left, BodySurface(body, betas), clip.pose[0],
                                               clip.trans.col(0), object.mesh, grid, both_options);
  if (Interrupted()) return kInterrupted;
  if (grasp.status != GraspStatus::kFound) {
    throw FitFailure(fmt::format(
        "{} in both hands: {}. {}. {}, or take a pose with both hands in front (--clip, --frame)",
        object.name, Describe(grasp.status), MeasuresText(object.mesh),
        both_options.place ? "Choose another place" : "Check its unit (--object-scale)"));
  }

  clip.pose[0] = grasp.pose;
  PutInHands(kHoldsRight | kHoldsLeft, object.name, grasp.world_from_object, clip);
  WriteGrasp(object, files, clip);
  PrintBothHandsGrasp(options, files, object, grasp, both_options.place != nullptr);
  return kDone;
}

}  // namespace

void AddGraspCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<GraspCommand>();
  CLI::App* command = app.add_subcommand(
      "grasp", "Close a hand around an object: a clip of one frame, the start of a fit");
  command
      ->add_option("object", options->object,
                   "Mesh (.obj .ply .stl .off .glb .gltf) or embedded object")
      ->required();
  command
      ->add_option("-o,--output", options->output,
                   "Clip to write (.npz); the mesh goes beside it. With --count: a folder")
      ->required();
  AddOption(*command, "--hand", options->hand,
            "right, left, both: the object between them; auto: the right, or the only one of "
            "a MANO model",
            CLI::IsMember({"auto", "right", "left", "both"}));
  CLI::Option* const clip = command->add_option(
      "--clip", options->clip, "With --hand both: take the pose from this clip; else standing");
  AddOption(*command, "--frame", options->frame, "Frame of --clip, from 0")
      ->needs(clip)
      ->check(CLI::NonNegativeNumber);
  AddOption(*command, "--style", options->style,
            "power, precision, handle (fingers through it), or auto: the best of all, by its "
            "handle what has one",
            CLI::IsMember({"auto", "power", "precision", "handle"}));
  AddUseOption(*command, options->use);
  command->add_option(
      "--body", options->body,
      "Body model: SMPL-X, SMPL-H, or MANO for a hand alone (.npz, .pkl); default: the "
      "embedded one");
  AddOption(*command, "--object-scale", options->object_scale,
            "Multiplies the mesh: 0.001 for millimetres", CLI::PositiveNumber);
  AddGraspPlaceOptions(*command, options->place);
  AddOption(*command, "--closings", options->grasp.closings,
            "Placements that the fingers are closed for", CLI::Range(1, 100'000));
  AddOption(*command, "--refinements", options->grasp.refinements, "Closed hands that are refined",
            CLI::Range(1, 100'000));
  CLI::Option* const count = command
                                 ->add_option("--count", options->count,
                                              "Write so many distinct grasps to the folder -o "
                                              "instead: each touches, is at most 1 mm deep "
                                              "and holds the object's weight in any direction with "
                                              "friction 0.5. Fewer are written with a "
                                              "warning, exit code 3")
                                 ->check(CLI::Range(1, 1'000'000));
  AddOption(*command, "--apart", options->apart_cm,
            "With --count: distinct wrists are so far apart, cm, in the object's frame ...")
      ->needs(count)
      ->check(CLI::NonNegativeNumber);
  AddOption(*command, "--apart-angle", options->apart_deg, "... or turned by this much, degrees")
      ->needs(count)
      ->check(CLI::Range(0.0, 180.0));
  AddOption(*command, "--friction", options->grasp.friction,
            "Friction coefficient of skin on the object", CLI::Range(0.01, 2.0));
  AddOption(*command, "--upright", options->grasp.upright_weight,
            "How much an object that stays upright is preferred", CLI::NonNegativeNumber);
  AddCommonOptions(*command, options->common, true,
                   "  holdfast grasp mug -o mug_grasp.npz\n"
                   "  holdfast grasp hammer.obj -o hammer.npz --hand left --seed 3 --json\n"
                   "  holdfast grasp mug -o rim.npz --use vessel\n"
                   "  holdfast grasp bottle -o neck.npz --at 0,0,0.18\n"
                   "  holdfast grasp mug --count 50 -o mug_grasps\n"
                   "  holdfast grasp box.obj -o box.npz --hand both --clip carry.npz --frame 60\n");
  command->callback([options, &exit_code] {
    if (options->count > 0 && options->hand == "both") {
      throw CLI::ValidationError("--count", "is for one hand");
    }
    if (options->hand == "both") {
      exit_code = RunBoth(*options);
      return;
    }
    if (!options->clip.empty()) throw CLI::ValidationError("--clip", "needs --hand both");
    exit_code = options->count > 0 ? RunMany(*options) : Run(*options);
  });
}

}  // namespace holdfast::apps
