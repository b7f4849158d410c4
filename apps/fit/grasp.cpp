// SPDX-License-Identifier: MIT
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/fit/fit_library.h"
#include "apps/fit/grasp_place_input.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"
#include "solver/grasp/grasp.h"
#include "solver/grasp/grasp_both.h"

namespace holdfast::apps {
namespace {

struct GraspCommand {
  CommonOptions common;
  std::string object;
  std::string output;
  std::string body;
  std::string hand = "auto";
  std::string style = "auto";
  std::string clip;
  int frame = 0;
  double object_scale = 1.0;
  GraspPlaceInput place;
  GraspOptions grasp;
};

// Standing, both arms down, the holding forearm forward and turned by `pronation` (0 has the thumb
// up) and away from the body by `outward`, which leaves up where it is in the wrist's frame.
JointPose StandingPose(Side side, double pronation, double outward) {
  JointPose right = JointPose::Zero();
  const auto joint = [&](const char* name) { return right.col(*FindJoint(name)); };
  joint("pelvis") = 90.0 * kDegree * Eigen::Vector3d::UnitX();
  joint("right_shoulder") = LogSO3(ExpSO3(-outward * Eigen::Vector3d::UnitY()) *
                                   ExpSO3(-12.0 * kDegree * Eigen::Vector3d::UnitX()) *
                                   ExpSO3(76.0 * kDegree * Eigen::Vector3d::UnitZ()));
  // A forearm turns over its length: half at the elbow, half at the wrist.
  const Eigen::Vector3d half_turn = 0.5 * pronation * Eigen::Vector3d::UnitX();
  joint("right_elbow") =
      LogSO3(ExpSO3(80.0 * kDegree * Eigen::Vector3d::UnitY()) * ExpSO3(half_turn));
  joint("right_wrist") = half_turn;
  joint("left_shoulder") = -74.0 * kDegree * Eigen::Vector3d::UnitZ();
  joint("left_elbow") = -15.0 * kDegree * Eigen::Vector3d::UnitY();
  return side == Side::kRight ? right : MirrorPose(right);
}

constexpr double kHandAloneHeight_m = 1.0;  // of the wrist, where nothing else says

// The hand that is to hold: the only one of a hand alone, else the right if nothing is asked for.
Side HandFor(const GraspCommand& options, const BodyModel& body) {
  const Side side = options.hand == "auto"   ? body.LoneHand().value_or(Side::kRight)
                    : options.hand == "left" ? Side::kLeft
                                             : Side::kRight;
  RequireHands(body, HoldingBit(side));
  return side;
}

std::vector<std::string> TouchingParts(const Grasp& grasp) {
  constexpr const char* kNames[kNumFingers] = {"index", "middle", "pinky", "ring", "thumb"};
  constexpr int kOrder[kNumFingers] = {kThumb, kIndex, kMiddle, kRing, kPinky};
  std::vector<std::string> names;
  for (const int finger : kOrder) {
    if (grasp.fingers_touching[finger]) names.emplace_back(kNames[finger]);
  }
  if (grasp.palm_touching) names.emplace_back("palm");
  return names;
}

// Of skin in the object and the object's surface in the hand.
double Deepest_mm(const Grasp& grasp) {
  return std::max(grasp.max_penetration_mm, grasp.object_in_hand_mm);
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

// Who holds the object, in the world.
struct Holder {
  JointPose pose = JointPose::Zero();
  Eigen::Vector3d trans = Eigen::Vector3d::Zero();
};

// A hand on nothing, turned as a standing person's would be.
Holder HandAlone(const HandModel& hand, double pronation, const Grasp& grasp) {
  HandState state(hand);
  state.SetBody(StandingPose(hand.HandSide(), pronation, 0.0), Eigen::Vector3d::Zero());
  Holder holder;
  holder.pose.col(0) = LogSO3(state.WristRotation());
  SetFingers(holder.pose, hand.HandSide(), grasp.fingers);
  holder.trans = kHandAloneHeight_m * Eigen::Vector3d::UnitZ() - state.WristPosition();
  return holder;
}

// A standing person, the arm as far out as the object needs to clear the body.
Holder Standing(const std::shared_ptr<const BodyModel>& body, const HandModel& hand,
                double pronation, const Grasp& grasp, const DistanceGrid& grid) {
  const Side side = hand.HandSide(), other = OtherSide(side);
  const HandAxes other_hand(HandModel(body, {}, other));
  const FingerPose other_fingers = other_hand.PoseOf(other_hand.Relaxed());
  const BodySurface whole(body);
  const std::vector<int>& hand_ids = body->HandVertexIds(side);
  HandState state(hand);
  Holder holder;
  for (const double outward : {0.0, 20.0, 40.0, 60.0}) {
    holder.pose = StandingPose(side, pronation, outward * kDegree);
    SetFingers(holder.pose, side, grasp.fingers);
    SetFingers(holder.pose, other, other_fingers);
    BodyState posed;
    Forward(whole, holder.pose, Eigen::Vector3d::Zero(), posed);
    holder.trans = {0.0, 0.0, -posed.vertices.row(2).minCoeff()};  // feet on the ground
    state.SetBody(holder.pose, holder.trans);
    const Eigen::Isometry3d object_from_world =
        ObjectInWorld(grasp, state.WristRotation(), state.WristPosition()).inverse();
    bool clear = true;
    for (int i = 0; i < whole.NumVertices() && clear; ++i) {
      if (std::binary_search(hand_ids.begin(), hand_ids.end(), i)) continue;
      clear = grid.Distance(object_from_world * (posed.vertices.col(i) + holder.trans)) > 0.0;
    }
    if (clear) break;
  }
  return holder;
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
  LoadedObject object = LoadObjectInput(options.object, options.object_scale);
  for (const std::string& note : object.notes) Note(options.common, "note: " + note);
  RequireGraspable(object, both_hands);
  return object;
}

DistanceGrid GraspGrid(const SignedDistance& surface, const CommonOptions& common) {
  DistanceGridOptions grid_options;
  grid_options.threads = NumThreads(common);
  return DistanceGrid(surface, grid_options);
}

std::string MeasuresText(const TriangleMesh& object) {
  const Eigen::Vector3d extent = 100.0 * Extent(object);
  return fmt::format("The object measures {:.1f} x {:.1f} x {:.1f} cm", extent.x(), extent.y(),
                     extent.z());
}

// Writes the object's mesh and the clip, in which `hands` hold it there.
void WriteGrasp(const LoadedObject& object, const Eigen::Isometry3d& world_from_object,
                std::uint8_t hands, const GraspFiles& files, Clip& clip) {
  clip.object = ObjectTrack{world_from_object.translation(), LogSO3(world_from_object.linear()),
                            object.name, files.mesh.filename().string()};
  clip.holding_hand = {hands};
  WriteMesh(object.mesh, files.mesh);
  WriteClip(clip, files.clip);
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

// The ways a forearm can turn; however it does, up is there in the wrist's frame.
std::vector<double> AddPronations(const HandModel& hand, GraspOptions& grasp) {
  std::vector<double> pronations;
  HandState state(hand);
  for (double degrees = -75.0; degrees <= 75.0; degrees += 15.0) {
    pronations.push_back(degrees * kDegree);
    state.SetBody(StandingPose(hand.HandSide(), pronations.back(), 0.0), Eigen::Vector3d::Zero());
    grasp.up_in_wrist.emplace_back(state.WristRotation().transpose() * Eigen::Vector3d::UnitZ());
  }
  return pronations;
}

// The pronation that leaves the object as upright as can be.
double UprightPronation(const std::vector<double>& pronations,
                        const std::vector<Eigen::Vector3d>& up_in_wrist, const Grasp& grasp) {
  const Eigen::Vector3d object_up = grasp.wrist_from_object.linear().col(2);
  std::size_t best = 0;
  for (std::size_t i = 1; i < pronations.size(); ++i) {
    if (up_in_wrist[i].dot(object_up) > up_in_wrist[best].dot(object_up)) best = i;
  }
  return pronations[best];
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
          "{}: {} grasp of {} with the {} hand ({})\n"
          "  {:.2f} mm deepest penetration, {:.0f} % of the hand in contact, quality {:.2f}\n"
          "  {} of {} placements closed, {} refined in {:.1f} s\n",
          files.clip.string(), StyleName(grasp.style), object.name, SideName(side),
          fmt::join(TouchingParts(grasp), ", "), Deepest_mm(grasp),
          100.0 * grasp.metrics.contact_ratio, grasp.wrench_quality, report.closings,
          report.placements, report.refinements,
          1e-3 * (report.search_ms + report.closing_ms + report.refinement_ms)));
}

int Run(GraspCommand options) {
  const CommonOptions& common = options.common;
  const GraspFiles files = NewGraspFiles(options);
  const std::shared_ptr<const BodyModel> body = LoadBody(options.body);
  const Side side = HandFor(options, *body);
  const LoadedObject object = LoadGraspable(options, false);

  const HandModel hand(body, {}, side);
  const SignedDistance surface(object.mesh);
  const DistanceGrid grid = GraspGrid(surface, common);

  const std::vector<double> pronations = AddPronations(hand, options.grasp);
  options.grasp.style = StyleByName(options.style);
  if (const auto wanted = WantedPlace(options.place, options.object, options.object_scale)) {
    options.grasp.place = std::make_shared<const GraspPlace>(object.mesh, *wanted);
  }
  options.grasp.seed = common.seed;
  options.grasp.threads = NumThreads(common);
  GraspReport report;
  Grasp grasp;
  {
    Progress progress(common, "grasp");
    grasp = CloseHand(hand, object.mesh, surface, grid, options.grasp, &report, [&](double share) {
      progress.Update(static_cast<int>(100 * share), 100);
      return !Interrupted();
    });
  }
  if (Interrupted()) return kInterrupted;
  RequireFound(options, object, report);

  const double pronation = UprightPronation(pronations, options.grasp.up_in_wrist, grasp);
  const Holder holder = body->LoneHand() ? HandAlone(hand, pronation, grasp)
                                         : Standing(body, hand, pronation, grasp, grid);
  Clip clip;
  clip.trans = holder.trans;
  clip.pose = {holder.pose};
  clip.betas = Eigen::VectorXd::Zero(10);
  clip.body_model = body->Name();
  if (body->LoneHand()) MarkHandAlone(clip);
  HandState state(hand);
  state.SetBody(holder.pose, holder.trans);
  WriteGrasp(object, ObjectInWorld(grasp, state.WristRotation(), state.WristPosition()),
             HoldingBit(side), files, clip);
  PrintGrasp(options, files, object, side, grasp, report);
  return kDone;
}

// Feet on the ground.
Eigen::Vector3d Standing(const BodySurface& body, const JointPose& pose) {
  BodyState state;
  Forward(body, pose, Eigen::Vector3d::Zero(), state);
  return {0.0, 0.0, -state.vertices.row(2).minCoeff()};
}

// One frame of a person who stands with both forearms forward.
Clip StandingForBoth(const std::shared_ptr<const BodyModel>& body) {
  Clip clip;
  JointPose pose = StandingPose(Side::kRight, 0.0, 0.0);
  const JointPose left = StandingPose(Side::kLeft, 0.0, 0.0);
  for (const char* joint : {"left_shoulder", "left_elbow", "left_wrist"}) {
    pose.col(*FindJoint(joint)) = left.col(*FindJoint(joint));
  }
  clip.pose = {pose};
  clip.betas = Eigen::VectorXd::Zero(10);
  clip.body_model = body->Name();
  clip.trans = Standing(BodySurface(body), pose);
  return clip;
}

// The clip of one frame that both hands start from; `person` becomes its body.
Clip StartForBoth(const GraspCommand& options, ClipBody& person) {
  if (options.clip.empty()) return StandingForBoth(person.model);
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
  const DistanceGrid grid = GraspGrid(surface, common);
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
  WriteGrasp(object, grasp.world_from_object, static_cast<std::uint8_t>(kHoldsRight | kHoldsLeft),
             files, clip);
  PrintBothHandsGrasp(options, files, object, grasp, both_options.place != nullptr);
  return kDone;
}

}  // namespace

void AddGraspCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<GraspCommand>();
  CLI::App* command = app.add_subcommand(
      "grasp", "Close a hand around an object: a clip of one frame, the start of a fit");
  command->add_option("object", options->object, "Mesh (.obj .ply .stl .off) or embedded object")
      ->required();
  command
      ->add_option("-o,--output", options->output, "Clip to write (.npz); the mesh goes beside it")
      ->required();
  command
      ->add_option(
          "--hand", options->hand,
          "right, left, both: the object between them; auto: the right, or the only one of "
          "a MANO model")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "right", "left", "both"}));
  CLI::Option* const clip = command->add_option(
      "--clip", options->clip, "With --hand both: take the pose from this clip; else standing");
  command->add_option("--frame", options->frame, "Frame of --clip, from 0")
      ->capture_default_str()
      ->needs(clip)
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option(
          "--style", options->style,
          "power, precision, handle (fingers through it), or auto: the best of all, by its "
          "handle what has one")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "power", "precision", "handle"}));
  command->add_option(
      "--body", options->body,
      "Body model: SMPL-X, SMPL-H, or MANO for a hand alone (.npz, .pkl); default: the "
      "embedded one");
  command
      ->add_option("--object-scale", options->object_scale,
                   "Multiplies the mesh: 0.001 for millimetres")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  AddGraspPlaceOptions(*command, options->place);
  command
      ->add_option("--closings", options->grasp.closings,
                   "Placements that the fingers are closed for")
      ->capture_default_str()
      ->check(CLI::Range(1, 100'000));
  command->add_option("--refinements", options->grasp.refinements, "Closed hands that are refined")
      ->capture_default_str()
      ->check(CLI::Range(1, 100'000));
  command
      ->add_option("--upright", options->grasp.upright_weight,
                   "How much an object that stays upright is preferred")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  AddCommonOptions(*command, options->common, true,
                   "  holdfast grasp mug -o mug_grasp.npz\n"
                   "  holdfast grasp hammer.obj -o hammer.npz --hand left --seed 3 --json\n"
                   "  holdfast grasp bottle -o neck.npz --at 0,0,0.18\n"
                   "  holdfast grasp box.obj -o box.npz --hand both --clip carry.npz --frame 60\n");
  command->callback([options, &exit_code] {
    if (options->hand == "both") {
      exit_code = RunBoth(*options);
      return;
    }
    if (!options->clip.empty()) throw CLI::ValidationError("--clip", "needs --hand both");
    exit_code = Run(*options);
  });
}

}  // namespace holdfast::apps
