// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/fit/transfer_robot.h"
#include "apps/fit_job.h"
#include "apps/output.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/retarget/convert_parameters.h"
#include "geometry/rotation.h"
#include "solver/carry/carry_json.h"
#include "solver/carry/first_grasp.h"
#include "solver/transfer/transfer.h"
#include "solver/transfer/variants.h"

namespace holdfast::apps {
namespace {

struct TransferCommand {
  CommonOptions common;
  std::string clip, output;
  ClipInputOptions input;  // of the source clip
  std::string object;
  double object_scale = 1.0;
  std::vector<double> scale;
  std::string map;
  std::string body;
  std::vector<double> betas;
  TransferOptions transfer;
  bool write_report = true;
  int variants = 0;
  std::vector<double> scale_range = {VariantOptions{}.scale_low, VariantOptions{}.scale_high};
  double yaw_deg = 180.0;
  VariantOptions spread;  // other variant options
  RobotTransferInput robot;
};

// Source and target of a transfer.
struct TransferInput {
  ClipInput input;
  Clip clip;  // on the model of the target body
  ClipBody from, to;
  std::optional<OntoBody> onto;  // for clips of another model: that motion on the target body
  std::shared_ptr<const PreparedObject> from_object, to_object;
  std::optional<SurfaceMap> map;
};

Eigen::Vector3d ScaleOf(const TransferCommand& options) {
  if (options.scale.empty()) return Eigen::Vector3d::Ones();
  if (options.scale.size() == 2) {
    throw Error("--scale", "has two factors", "Give one factor, or one per axis: 1,1,1.3");
  }
  if (options.scale.size() == 1) return Eigen::Vector3d::Constant(options.scale.front());
  return Eigen::Map<const Eigen::Vector3d>(options.scale.data());
}

// Loads the clip and checks that it has an object. Throws Error if it has none.
ClipInput LoadHeld(const TransferCommand& options) {
  ClipInput input = LoadClipInput(options.clip, options.input, options.common);
  RequireMeters(options.clip, input.clip, *input.body);
  if (!input.clip.object) {
    throw Error(options.clip, "has no object: there is nothing to transfer",
                "Fit one to it first: holdfast fit " + options.clip + " mug -o held");
  }
  if (!input.object) {
    throw Error(options.clip, "its object's mesh is missing: " + input.object_missing,
                "Give its file with --from-object");
  }
  return input;
}

// Converts the clip if the target has another body model.
void ConvertToTarget(TransferInput& scene) {
  const Clip before = std::move(scene.clip);
  const ClipBody body = scene.from;
  scene.clip = ConvertClip(before, body.model, body.betas, scene.to.model).clip;
  scene.from = {scene.to.model, scene.clip.betas};
  if (body.model->LoneHand() != scene.to.model->LoneHand()) return;
  Clip standing = scene.clip;  // its rotations; joints that only the clip's model has at rest
  standing.trans = before.trans;
  scene.onto = OntoOtherBody(standing, body, scene.to);
}

void SetBetas(const TransferCommand& options, TransferInput& scene) {
  if (options.betas.empty()) return;
  for (const double beta : options.betas) {
    constexpr double kMost = 10.0;
    if (std::abs(beta) <= kMost) continue;
    throw Error("--betas", fmt::format("has the coefficient {:g}", beta),
                "Give coefficients from -10 to 10");
  }
  if (scene.to.model->IsSubject()) {
    throw Error("--betas", "has no effect: the clip contains its own body surface",
                "Give another body model with --body");
  }
  scene.to.betas = Eigen::Map<const Eigen::VectorXd>(
      options.betas.data(), static_cast<Eigen::Index>(options.betas.size()));
}

// Sets the source and target body.
void SetBodies(const TransferCommand& options, TransferInput& scene) {
  scene.from = {scene.input.body, scene.input.betas};
  scene.to = scene.from;
  if (!options.body.empty()) scene.to = {LoadBody(options.body), Eigen::VectorXd::Zero(0)};
  SetBetas(options, scene);
  const BodyModel &from = *scene.from.model, &to = *scene.to.model;
  const bool same = from.Kind() == to.Kind() && from.NumVertices() == to.NumVertices() &&
                    from.Template() == to.Template();
  if (same) {
    scene.from.model = scene.to.model;
  } else {
    ConvertToTarget(scene);
  }
}

LoadedObject TargetObject(const TransferCommand& options, const ClipInput& input) {
  const Eigen::Vector3d scale = ScaleOf(options);
  if (!scale.allFinite()) {
    throw Error("--scale", "is not a number", "Give one factor, or one per axis: 1,1,1.3");
  }
  if (!options.object.empty()) {
    LoadedObject object = LoadObject(options.object, options.object_scale);
    RequireHandheld(object);
    object.mesh.vertices = scale.asDiagonal() * object.mesh.vertices;
    RequireHandheld(object);
    return object;
  }
  TriangleMesh mesh = *input.object;
  mesh.vertices = scale.asDiagonal() * mesh.vertices;
  LoadedObject object = ObjectOfMesh(mesh, input.clip.object->name, input.object_source);
  RequireHandheld(object);
  return object;
}

TransferInput LoadScene(const TransferCommand& options, int threads) {
  TransferInput scene{LoadHeld(options), {}, {}, {}, std::nullopt, nullptr, nullptr, std::nullopt};
  scene.clip = scene.input.clip;
  SetBodies(options, scene);
  LoadedObject target = TargetObject(options, scene.input);
  const auto prepare = [&](LoadedObject object) {
    return std::make_shared<const PreparedObject>(
        PrepareObject(std::move(object), options.transfer.object_vertices, threads));
  };
  scene.from_object = prepare(
      ObjectOfMesh(*scene.input.object, scene.input.clip.object->name, scene.input.object_source));
  const TriangleMesh& first = scene.from_object->object.mesh;
  const bool same = options.object.empty();
  if (same && ScaleOf(options).isOnes(0.0)) {
    scene.to_object = scene.from_object;
  } else {
    scene.to_object = prepare(std::move(target));
  }
  const TriangleMesh& second = scene.to_object->object.mesh;
  if (!options.map.empty()) {
    scene.map = SurfaceMap::FromFile(first, second, options.map);
  } else {
    scene.map =
        same ? SurfaceMap::Scaled(first, ScaleOf(options)) : SurfaceMap::Registered(first, second);
  }
  for (const std::string& note : scene.to_object->notes) Note(options.common, "note: " + note);
  return scene;
}

TransferOptions ToLibrary(const TransferCommand& options, int threads) {
  TransferOptions transfer = options.transfer;
  transfer.carry.seed = options.common.seed;
  transfer.carry.threads = threads;
  return transfer;
}

nlohmann::json MetricsOf(const TransferCommand& options, const TransferInput& scene,
                         const TransferReport& report) {
  const CarryReport& carried = report.carried;
  const Side side = (carried.held_by & kHoldsRight) != 0 ? Side::kRight : Side::kLeft;
  nlohmann::json metrics = JsonHead("holdfast/transfer/1", options.common);
  TransferOptions transfer = options.transfer;
  metrics["options"] = OptionsJson(OptionsOf(transfer));
  metrics["options"].update({{"clip", options.clip},
                             {"from_object", scene.input.object_source},
                             {"object", scene.to_object->object.source},
                             {"scale", options.scale},
                             {"map", options.map},
                             {"body", scene.to.model->Name()},
                             {"betas", options.betas}});
  metrics["map"] = MapJson(scene.map->Report());
  metrics["holds"] = TransferredHoldsJson(report.holds);
  metrics["following"] = FollowingJson(report);
  metrics["protocol"] = ProtocolJson(options.transfer.carry.protocol, scene.to_object->solid,
                                     HandModel(scene.to.model, scene.to.betas, side));
  metrics["warnings"] = report.warnings;
  metrics["clearance"] = ClearanceJson(carried.clearance);
  metrics["summary"] = FitSummaryJson(carried.fit, carried.contact);
  return metrics;
}

std::string Text(const TransferCommand& options, const TransferInput& scene,
                 const TransferReport& report) {
  const SurfaceMapReport& map = scene.map->Report();
  std::string text = fmt::format(
      "{}/clip.npz: {} held by {}\n"
      "  map                 {}, stretch up to {:.2f}, {:.1f} mm between the surfaces\n",
      options.output, scene.to_object->object.name,
      HoldersText(CountHeld(report.carried.clip.holding_hand)), map.method, map.stretch_most,
      map.residual_mm);
  for (const TransferredHold& hold : report.holds) {
    const CarriedGrasp& grasp = hold.grasp;
    text += fmt::format(
        "  frames {}-{}{}{} hand, {}; contacts {:.1f} mm and wrist {:.0f} mm from the mapped "
        "grasp\n",
        hold.begin, hold.end - 1, std::string(std::max(1, 13 - (hold.end > 100) * 2), ' '),
        SideName(hold.side), grasp.searched ? "new grasp near the contacts" : "grasp transferred",
        grasp.contact_off_mm, 1e3 * grasp.wrist_shift_m);
  }
  return text +
         SummaryText(FitSummaryJson(report.carried.fit, report.carried.contact),
                     options.transfer.carry.protocol) +
         ClearanceText(report.carried.clearance);
}

void WriteTransfer(const TransferCommand& options, const TransferInput& scene,
                   const CarryReport& carried, const nlohmann::json& metrics,
                   ResultFolder& folder) {
  WriteClipFiles(carried.clip, scene.to_object->object.mesh, folder / "");
  nlohmann::json written = folder.WriteMetrics(metrics);
  if (options.write_report) {
    ReportInput shown;
    shown.source = options.output;
    shown.file = std::filesystem::path(options.output) / "clip.npz";
    shown.clip = carried.clip;
    shown.body = scene.to.model;
    shown.betas = scene.to.betas;
    shown.object = scene.to_object->object.mesh;
    shown.metrics = std::move(written);
    WriteReportBeside({&shown, 1}, folder / "report.html", options.common);
  }
  folder.Commit();
}

int TransferOne(const TransferCommand& options) {
  ResultFolder folder(options.output, options.common.force);
  const int threads = NumThreads(options.common);
  const TransferInput scene = LoadScene(options, threads);
  StageProgress progress(options.common);
  const TransferReport report = NamingSource("the clip", options.clip, [&] {
    return TransferClip(
        scene.clip, scene.from, *scene.from_object, scene.to, *scene.to_object, *scene.map,
        ToLibrary(options, threads),
        [&](const char* stage, int done, int total) {
          progress.Update(stage, done, total);
          return !Interrupted();
        },
        scene.onto ? &*scene.onto : nullptr);
  });
  progress.End();
  if (Interrupted()) return kInterrupted;
  for (const std::string& warning : report.warnings) Note(options.common, "warning: " + warning);
  if (report.carried.status == CarryStatus::kNoContact) {
    throw FitFailure(
        fmt::format("{}: no hand touches {} in any frame, so nothing is written. Check that the "
                    "objects are of the same kind, or give corresponding points with --map",
                    options.clip, scene.to_object->object.name));
  }
  nlohmann::json metrics = MetricsOf(options, scene, report);
  nlohmann::json summary = metrics;
  summary["output"] = options.output;
  metrics["per_frame"] =
      FitFramesJson(report.carried.fit, report.carried.contact, report.carried.clearance);
  metrics["per_frame"]["holding_hand"] = report.carried.holding.hands;
  WriteTransfer(options, scene, report.carried, metrics, folder);
  for (const std::string& warning : report.carried.warnings) {
    Note(options.common, "warning: " + warning);
  }
  PrintResult(options.common, summary, Text(options, scene, report));
  return Interrupted() ? kInterrupted : kDone;
}

std::string VariantsText(const TransferCommand& options, const VariantReport& report) {
  std::string text = fmt::format(
      "{}/manifest.jsonl: {} variants kept of {} tried{}\n", options.output, report.kept,
      report.tried, report.had > 0 ? fmt::format(" ({} from an earlier run)", report.had) : "");
  for (const auto& [reason, count] : report.refused) {
    text += fmt::format("  dropped: {:<10}{:>6}\n", reason, count);
  }
  if (report.tried > report.had) {
    text += fmt::format("  {:.0f} ms per attempt (wall clock)\n",
                        1e3 * report.seconds / (report.tried - report.had));
  }
  return text;
}

int TransferMany(const TransferCommand& options) {
  const ClipInput input = LoadHeld(options);
  const int threads = NumThreads(options.common);
  VariantOptions variants = options.spread;
  variants.count = options.variants;
  variants.scale_low = options.scale_range.front();
  variants.scale_high = options.scale_range.back();
  variants.yaw_rad = options.yaw_deg * kDegree;
  variants.seed = options.common.seed;
  variants.threads = threads;
  const PreparedObject object = PrepareObject(
      ObjectOfMesh(*input.object, input.clip.object->name, input.object_source), 300, threads);
  RequireHandheld(object.object);
  StageProgress progress(options.common);
  const VariantReport report = NamingSource("the clip", options.clip, [&] {
    return MakeVariants(input.clip, {input.body, input.betas}, object, options.output, variants,
                        [&](const char* stage, int done, int total) {
                          progress.Update(stage, done, total);
                          return !Interrupted();
                        });
  });
  progress.End();
  if (!report.complete) return kInterrupted;
  nlohmann::json summary = JsonHead("holdfast/variants/1", options.common);
  summary.update({{"output", options.output},
                  {"kept", report.kept},
                  {"tried", report.tried},
                  {"had", report.had},
                  {"dropped", report.refused},
                  {"seconds", report.seconds}});
  PrintResult(options.common, summary, VariantsText(options, report));
  if (report.kept == 0) throw FitFailure(options.clip + ": no attempted variant was clean");
  return report.kept == options.variants ? kDone : kFitFault;
}

int Transfer(const TransferCommand& options) {
  if (!options.robot.robots.empty()) {
    return RunRobotTransfer(options.clip, options.input, options.robot, options.output,
                            options.common);
  }
  if (options.variants > 0) return TransferMany(options);
  if (options.object.empty() && options.scale.empty() && options.body.empty() &&
      options.betas.empty()) {
    throw CLI::ValidationError(
        "transfer", "Give a target: --object, --scale, --body, --betas, --robot or --variants");
  }
  return TransferOne(options);
}

// Returns --object, which other options need or exclude.
CLI::Option* AddObjectOptions(CLI::App& command, TransferCommand& options) {
  const char* const group = "Target object";
  CLI::Option* const object = command
                                  .add_option("--object", options.object,
                                              "Target object of the same kind: mesh (.obj .ply "
                                              ".stl .off .glb .gltf) or embedded object")
                                  ->group(group);
  AddOption(command, "--object-scale", options.object_scale,
            "Multiplies the target object's coordinates (0.001 for millimeters)",
            CLI::PositiveNumber)
      ->group(group);
  command
      .add_option("--scale", options.scale,
                  "Scale of the object: one factor, or one per axis: 1,1,1.3")
      ->delimiter(',')
      ->expected(1, 3)
      ->check(CLI::Range(0.05, 20.0))
      ->group(group);
  command
      .add_option("--map", options.map,
                  "Text file of correspondences: 'x y z x y z' per row (clip's object, target "
                  "object), or for each vertex of the clip's object the index of a target vertex. "
                  "Default: found from the shapes")
      ->needs(object)
      ->group(group);
  return object;
}

void AddBodyOptions(CLI::App& command, TransferCommand& options) {
  const char* const group = "Target body";
  command
      .add_option("--body", options.body,
                  "Body model of the new person: SMPL-X or SMPL-H (.npz, .pkl)")
      ->group(group);
  command.add_option("--betas", options.betas, "First shape coefficients of the new person: -2,1")
      ->delimiter(',')
      ->group(group);
}

void AddVariantOptions(CLI::App& command, CLI::Option* object, TransferCommand& options) {
  const char* const group = "Variants";
  CLI::Option* const variants =
      command
          .add_option("--variants", options.variants,
                      "Number of variants of the clip to write to the folder -o, with "
                      "manifest.jsonl. Attempts with too much penetration, lost contact or an "
                      "object out of reach are dropped. To resume an interrupted run, run it again")
          ->check(CLI::Range(1, 1'000'000))
          ->excludes(object)
          ->group(group);
  AddOption(command, "--scale-range", options.scale_range,
            "Range of the object's random scale: 0.85,1.2")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::Range(0.05, 20.0))
      ->needs(variants)
      ->group(group);
  VariantOptions& spread = options.spread;
  AddOption(command, "--axis-spread", spread.axis_spread,
            "Additional random scale of each axis, up to this fraction", CLI::Range(0.0, 0.49))
      ->needs(variants)
      ->group(group);
  AddOption(command, "--betas-sigma", spread.betas_sigma,
            "Standard deviation of the first two shape coefficients", CLI::Range(0.0, 3.0))
      ->needs(variants)
      ->group(group);
  AddOption(command, "--mirrored", spread.mirrored,
            "Fraction of mirrored variants, held by the other hand", CLI::Range(0.0, 1.0))
      ->needs(variants)
      ->group(group);
  AddOption(command, "--yaw", options.yaw_deg,
            "Random rotation about the vertical, up to this many degrees", CLI::Range(0.0, 180.0))
      ->needs(variants)
      ->group(group);
  AddOption(command, "--place", spread.place_m,
            "Random displacement on the ground along x and y, up to this many meters",
            CLI::Range(0.0, 100.0))
      ->needs(variants)
      ->group(group);
}

void AddHowOptions(CLI::App& command, TransferCommand& options) {
  const char* const group = "General";
  AddOptions(command, OptionsOf(options.transfer));
  command
      .add_option("--from-object", options.input.object,
                  "Mesh of the clip's own object, in place of the referenced one")
      ->group(group);
  command
      .add_option("--from-body", options.input.body,
                  "Body model of the clip, in place of the embedded one")
      ->group(group);
  command
      .add_flag_callback(
          "--no-report", [&options] { options.write_report = false; }, "Leave out report.html")
      ->group(group);
}

}  // namespace

void AddTransferCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<TransferCommand>();
  CLI::App* command = app.add_subcommand(
      "transfer",
      "Transfer a clip with a held object to another object, body or robot hand, keeping contacts");
  command->add_option("clip", options->clip, kClipHelp)->required();
  command
      ->add_option("-o,--output", options->output,
                   "Output folder: clip.npz, object.ply, metrics.json, report.html; with --robot: "
                   "robot.npz, robot.csv, motion_v1.npz, scene.xml, report.html and metrics.json")
      ->required();
  CLI::Option* const object = AddObjectOptions(*command, *options);
  AddBodyOptions(*command, *options);
  AddRobotOptions(*command, options->robot);
  AddVariantOptions(*command, object, *options);
  AddHowOptions(*command, *options);
  AddCommonOptions(*command, options->common, true,
                   "  holdfast transfer held --scale 1.3 -o held_large\n"
                   "  holdfast transfer held --object jug.obj -o held_jug --json\n"
                   "  holdfast transfer held --robot hand.urdf -o robot\n"
                   "  holdfast transfer held --betas -2,1 -o held_by_another\n"
                   "  holdfast transfer held --variants 500 -o many\n");
  command->callback([options, &exit_code] { exit_code = Transfer(*options); });
}

}  // namespace holdfast::apps
