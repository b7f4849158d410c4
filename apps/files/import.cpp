// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/common.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/import/import_file.h"
#include "geometry/import/load_clip.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/retarget/skeleton_map.h"
#include "geometry/rotation.h"
#include "solver/body_ik/reach_clip.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct ImportCommand {
  CommonOptions common;
  std::string motion;
  std::string output;
  std::string body;
  ImportFileOptions import;
  std::vector<double> betas;
  std::vector<std::string> hand_models;
  std::string object_mesh;
  bool copy_mesh = false;
};

// Object mesh of an imported clip.
struct ObjectMesh {
  fs::path file;                        ///< empty: none found
  std::optional<TriangleMesh> surface;  ///< meters
  Eigen::Index vertices = 0;
  bool copied = false;
};

std::string DescribeMotion(const ImportCommand& options, const Clip& clip,
                           const ImportReport& report) {
  const RetargetReport& fit = report.retarget;
  std::string text = fmt::format(
      "{}: {} frames at {:g} Hz, of {} at {:g} Hz\n"
      "  {}, skeleton '{}': {} of its {} joints used{}\n"
      "  lengths scaled by {:.4f}, heights shifted by {:+.1f} mm to the ground\n",
      options.output, clip.NumFrames(), clip.frame_rate, report.source_frames,
      report.source_frame_rate, report.format, report.skeleton, report.mapped_joints,
      report.source_joints, fit.same_skeleton ? ", rest pose of SMPL-X: rotations copied" : "",
      fit.scale, 1e3 * fit.ground_offset_m);
  if (!report.missing_body_joints.empty()) {
    text += fmt::format("  not in the source, estimated: {}\n",
                        fmt::join(report.missing_body_joints, ", "));
  }
  text += fmt::format(
      "  limb error against the source with the body's bone lengths: mean {:.1f} mm, max {:.1f} "
      "mm\n"
      "  ankle error against the scaled source: mean {:.1f} mm, max {:.1f} mm\n"
      "  mean error against the source: worst joint {:.1f} mm ({}), trunk {:.1f} degrees, hands "
      "{:.1f} and {:.1f} degrees\n"
      "  soles on the ground: mean height {:+.1f} mm, lowest {:+.1f} mm\n",
      fit.mean_joint_error_mm, fit.max_joint_error_mm, fit.mean_ankle_error_mm,
      fit.max_ankle_error_mm, fit.worst_place_mm, kJointNames[fit.worst_place_joint],
      fit.trunk_error_rad / kDegree, fit.hand_error_rad[0] / kDegree,
      fit.hand_error_rad[1] / kDegree, 1e3 * fit.mean_sole_height_m, 1e3 * fit.min_sole_height_m);
  return text;
}

nlohmann::json MotionSummary(const ImportCommand& options, const Clip& clip,
                             const ImportReport& report) {
  const RetargetReport& fit = report.retarget;
  nlohmann::json summary = JsonHead("holdfast/import/1", options.common);
  summary["output"] = options.output;
  summary["format"] = report.format;
  summary["skeleton"] = report.skeleton;
  summary["source"] = {{"joints", report.source_joints},
                       {"joints_used", report.mapped_joints},
                       {"unused", report.unused_source_joints},
                       {"frames", report.source_frames},
                       {"frame_rate_hz", report.source_frame_rate},
                       {"notes", report.notes}};
  summary["up_axis"] = UpAxisName(report.up);
  summary["frames"] = clip.NumFrames();
  summary["frame_rate_hz"] = clip.frame_rate;
  summary["filled_in"] = report.missing_body_joints;
  summary["same_skeleton"] = fit.same_skeleton;
  summary["scale"] = fit.scale;
  summary["ground_offset_m"] = fit.ground_offset_m;
  summary["ground_slope"] = fit.ground_slope;
  summary["repaired_hand_frames"] = fit.repaired_hand_frames;
  summary["joint_error_mm"] = {{"mean", fit.mean_joint_error_mm}, {"max", fit.max_joint_error_mm}};
  summary["wrist_error_mm"] = {{"mean", fit.mean_wrist_error_mm}, {"max", fit.max_wrist_error_mm}};
  summary["ankle_error_mm"] = {{"mean", fit.mean_ankle_error_mm}, {"max", fit.max_ankle_error_mm}};
  summary["worst_joint"] = {{"name", kJointNames[fit.worst_place_joint]},
                            {"mean_error_mm", fit.worst_place_mm}};
  summary["trunk_error_deg"] = fit.trunk_error_rad / kDegree;
  summary["hand_error_deg"] = {{"left", fit.hand_error_rad[0] / kDegree},
                               {"right", fit.hand_error_rad[1] / kDegree}};
  summary["sole_height_mm"] = {{"mean", 1e3 * fit.mean_sole_height_m},
                               {"min", 1e3 * fit.min_sole_height_m}};
  summary["foot_skate_m_per_s"] = fit.foot_skate;
  summary["protocol"] =
      "joints: position error of knees, ankles, elbows and wrists relative to hip or shoulder, "
      "with each source bone scaled to the body's length, over the source frames; ankles: position "
      "error relative to the middle of the hips, source scaled; worst_joint: any joint if the "
      "source has SMPL-X's bones (source scaled, relative to the middle of the hips), else elbows, "
      "wrists and ankles; trunk: direction error of the hip line, the shoulder line and the line "
      "between their midpoints, largest of the three means; hands: direction error from wrist to "
      "knuckles; for a source without knuckles, of the end site of its hand, else of its forearm "
      "rotated by the hand's joint; soles and skate: lowest point of heels and balls of the feet "
      "while within 3 cm of the ground";
  return summary;
}

// Number of frames in which each hand holds.
std::array<int, 2> HoldingFrames(const Clip& clip) {
  std::array<int, 2> frames = {0, 0};
  for (const std::uint8_t bits : clip.holding_hand) {
    frames[0] += (bits & kHoldsRight) != 0;
    frames[1] += (bits & kHoldsLeft) != 0;
  }
  return frames;
}

std::string DescribeParameters(const ImportCommand& options, const ImportedFile& imported,
                               const ObjectMesh& mesh) {
  const Clip& clip = imported.clip;
  std::string text =
      fmt::format("{}: {} frames at {:g} Hz", options.output, clip.NumFrames(), clip.frame_rate);
  if (clip.NumFrames() != imported.source_frames) {
    text += fmt::format(", of {} at {:g} Hz", imported.source_frames, imported.source_frame_rate);
  }
  text += fmt::format("\n  {}", imported.format);
  if (!clip.subject.empty()) text += fmt::format(", subject {}", clip.subject);
  text += fmt::format(", {}", clip.gender);
  if (!clip.action.empty()) text += fmt::format(", '{}'", clip.action);
  text += '\n';
  if (clip.object) {
    text +=
        fmt::format("  object '{}': {}\n", clip.object->name,
                    mesh.file.empty() ? std::string("no mesh found")
                    : mesh.copied ? fmt::format("{}, {} vertices", clip.object->mesh, mesh.vertices)
                                  : fmt::format("{}, {} vertices (referenced, not copied)",
                                                clip.object->mesh, mesh.vertices));
    if (!clip.holding_hand.empty()) {
      const auto [right, left] = HoldingFrames(clip);
      text +=
          fmt::format("  held by the right hand in {} frames, by the left in {}\n", right, left);
    }
  }
  if (clip.v_template.cols() > 0) {
    text += fmt::format("  the subject's own surface, {} vertices\n", clip.v_template.cols());
  }
  for (const std::string& line : imported.conventions) text += fmt::format("  - {}\n", line);
  if (!imported.dropped.empty()) {
    text += "  left out:\n";
    for (const std::string& line : imported.dropped) text += fmt::format("  - {}\n", line);
  }
  return text;
}

nlohmann::json ToJson(const RotationDefects& defects) {
  return {{"matrices", defects.matrices},
          {"no_rotations", defects.bad},
          {"frames", defects.frames},
          {"first_frame", defects.first_frame},
          {"worst_frame", defects.worst_frame},
          {"reflections", defects.reflections},
          {"singular_values", {defects.min_singular, defects.max_singular}},
          {"determinants", {defects.min_determinant, defects.max_determinant}}};
}

nlohmann::json ParameterSummary(const ImportCommand& options, const ImportedFile& imported,
                                const ObjectMesh& mesh) {
  const Clip& clip = imported.clip;
  nlohmann::json summary = JsonHead("holdfast/import/1", options.common);
  summary["output"] = options.output;
  summary["format"] = imported.format;
  summary["source"] = {{"frames", imported.source_frames},
                       {"frame_rate_hz", imported.source_frame_rate},
                       {"notes", imported.notes}};
  summary["frames"] = clip.NumFrames();
  summary["frame_rate_hz"] = clip.frame_rate;
  summary["conventions"] = imported.conventions;
  summary["left_out"] = imported.dropped;
  summary["subject"] = clip.subject;
  summary["gender"] = clip.gender;
  summary["action"] = clip.action;
  summary["surface_model_type"] = clip.surface_model_type;
  summary["betas"] = clip.betas.size();
  summary["template_vertices"] = clip.v_template.cols();
  summary["has_table"] = clip.table.has_value();
  if (imported.goal) {
    summary["goal"] = {{"frame", imported.goal->frame}, {"wrist", SideName(imported.goal->wrist)}};
  }
  if (imported.body_defects.matrices > 0) {
    summary["body_rotations"] = ToJson(imported.body_defects);
  }
  if (clip.object) {
    summary["object"] = {{"name", clip.object->name},
                         {"mesh", clip.object->mesh},
                         {"mesh_vertices", mesh.vertices},
                         {"mesh_copied", mesh.copied}};
    if (imported.object_defects.matrices > 0) {
      summary["object"]["rotations"] = ToJson(imported.object_defects);
    }
    if (!clip.holding_hand.empty()) {
      const auto [right, left] = HoldingFrames(clip);
      summary["holding_frames"] = {{"right", right}, {"left", left}};
    }
  }
  return summary;
}

// Relative path from a folder to a file, as stored in a clip for its mesh.
std::string NameFrom(const fs::path& folder, const fs::path& file) {
  std::error_code error;
  const fs::path relative = fs::relative(file, folder.empty() ? "." : folder, error);
  return error || relative.empty() ? fs::absolute(file).string() : relative.generic_string();
}

fs::path MeshCopy(const fs::path& output) {
  return output.parent_path() / (output.stem().string() + "_object.ply");
}

// Sets the mesh path in the clip, and copies the mesh if requested or needed for its unit.
ObjectMesh SettleMesh(const ImportCommand& options, ImportedFile& imported) {
  ObjectMesh mesh;
  Clip& clip = imported.clip;
  const fs::path output = options.output;
  if (clip.table && !imported.table_mesh.empty()) {
    clip.table->mesh = NameFrom(output.parent_path(), imported.table_mesh);
  }
  const bool asked = !options.object_mesh.empty();
  mesh.file = asked ? fs::path(options.object_mesh) : imported.object_mesh;
  if (!clip.object) {
    if (asked) {
      throw Error("--object-mesh", "the file has no object that moves",
                  "Leave out --object-mesh; to fit an object to the motion, use 'holdfast fit CLIP "
                  "OBJECT'");
    }
    return mesh;
  }
  if (asked) {  // no advice to give it
    std::erase_if(imported.notes, [](const std::string& note) {
      return note.find("--object-mesh") != std::string::npos;
    });
  }
  const bool in_file = !asked && imported.object_surface.has_value();
  if (mesh.file.empty() && !in_file) return mesh;
  const bool plain = in_file || HasMeshFormat(mesh.file);
  TriangleMesh surface = in_file ? *imported.object_surface
                         : plain ? ReadMesh(mesh.file)
                                 : LoadObject(mesh.file.string()).mesh;
  mesh.vertices = surface.NumVertices();
  const double scale = asked ? 1.0 : imported.object_mesh_scale;
  surface.vertices *= scale;
  mesh.copied = in_file || !plain || options.copy_mesh || scale != 1;
  if (mesh.copied) {
    const fs::path copy = MeshCopy(output);
    RequireNew(copy, options.common);
    WriteMesh(surface, copy);
    clip.object->mesh = copy.filename().string();
    if (scale != 1) {
      imported.conventions.push_back(
          fmt::format("object mesh scaled by {:g} and written to {}", scale, clip.object->mesh));
    }
  } else {
    clip.object->mesh = NameFrom(output.parent_path(), mesh.file);
  }
  mesh.surface = std::move(surface);
  if (clip.contact && clip.contact->object.size() > 0 &&
      clip.contact->object.rows() != mesh.vertices) {
    imported.notes.push_back(fmt::format(
        "contact labels are for {} vertices, but the mesh has {}: they belong to another mesh",
        clip.contact->object.rows(), mesh.vertices));
  }
  return mesh;
}

// Adds notes on how the clip changes on the default body of other commands, or on the given body.
void NoteBody(const std::shared_ptr<const BodyModel>& body, const ObjectMesh& mesh,
              ImportedFile& imported) {
  const auto [change, held] =
      NotesOnBody(imported.clip, body, mesh.surface ? &*mesh.surface : nullptr);
  if (!change.empty()) {
    imported.notes.push_back(fmt::format(
        "the clip keeps the file's own trans; other commands convert it to their body model: {}",
        change));
  }
  if (held) imported.notes.push_back(fmt::format("{}: {}", *held, kHeldRemedy));
}

ImportFileOptions ToLibrary(const ImportCommand& options) {
  ImportFileOptions import = options.import;
  import.parameters.body = LoadBody(options.body);
  import.parameters.hand_models.assign(options.hand_models.begin(), options.hand_models.end());
  import.motion.betas = Eigen::Map<const Eigen::VectorXd>(
      options.betas.data(), static_cast<Eigen::Index>(options.betas.size()));
  return import;
}

// A goal is where the wrist of `body` is in its frame.
void WriteImported(const ImportedFile& imported, const ObjectMesh& mesh, const BodyModel& body,
                   const ImportCommand& options) {
  const Clip& clip = imported.clip;
  if (imported.goal && !mesh.surface) {
    BodyState state;
    ForwardJoints(body.RestJoints(body.Template()), clip.pose[imported.goal->frame],
                  clip.trans.col(imported.goal->frame), state);
    ReachLabel label;
    label.frame = imported.goal->frame;
    label.wrist = imported.goal->wrist;
    label.goal = state.joints.col(WristJoint(label.wrist));
    WriteGoalClip(clip, {&label, 1}, {{"source", options.motion}, {"format", imported.format}},
                  options.output);
    return;
  }
  mesh.surface ? WriteClip(clip, *mesh.surface, options.output) : WriteClip(clip, options.output);
}

int Run(const ImportCommand& options) {
  const CommonOptions& common = options.common;
  RequireNew(options.output, common);
  if (options.copy_mesh) RequireNew(MeshCopy(options.output), common);
  const ImportFileOptions import = ToLibrary(options);
  ImportedFile imported = ImportFile(options.motion, import);
  const ObjectMesh mesh = SettleMesh(options, imported);
  if (!imported.motion) NoteBody(import.parameters.body, mesh, imported);
  if (imported.goal && mesh.surface) {
    imported.notes.push_back(
        "warning: the goal is dropped: a clip with an object's mesh cannot store one");
  }
  for (const std::string& note : imported.notes) Note(common, "note: " + note);
  if (!imported.motion) {
    WriteImported(imported, mesh, *import.parameters.body, options);
    PrintResult(common, ParameterSummary(options, imported, mesh),
                DescribeParameters(options, imported, mesh));
    return kDone;
  }
  const ImportReport& report = *imported.motion;
  if (report.retarget.repaired_hand_frames > 0) {
    Note(common, fmt::format("note: in {} frames a wrist was bent beyond its joint limits; its "
                             "rotation there is interpolated from neighboring frames",
                             report.retarget.repaired_hand_frames));
  }
  WriteImported(imported, mesh, *import.parameters.body, options);
  PrintResult(common, MotionSummary(options, imported.clip, report),
              DescribeMotion(options, imported.clip, report));
  return kDone;
}

}  // namespace

void AddImportCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ImportCommand>();
  CLI::App* command = app.add_subcommand(
      "import",
      "Convert a downloaded motion to a clip: GRAB, AMASS, IMoS, ARCTIC, Motion-X, SMPL-X "
      "parameters, BVH, ASF/AMC, glTF, SkillMimic; the format is detected from the content");
  command
      ->add_option("motion", options->motion,
                   fmt::format("File or folder: {}", fmt::join(ImportableFormats(), "; ")))
      ->required();
  command->add_option("-o,--output", options->output, "Clip to write (.npz)")->required();
  AddOptions(*command, OptionsOf(options->import));
  command->add_option("--body", options->body, "Body model: SMPL-X .npz [the embedded body]");
  command->add_option("--betas", options->betas, "Shape coefficients of the body, comma-separated")
      ->delimiter(',')
      ->group("Motions with their own skeleton");
  const std::string parameters = "Parameters of a body model";
  command
      ->add_option("--hand-model", options->hand_models,
                   "SMPL-X file, or MANO_LEFT and MANO_RIGHT, for hands stored as principal "
                   "components (repeat the option for two files)")
      ->allow_extra_args(false)
      ->group(parameters);
  command
      ->add_option(
          "--object-mesh", options->object_mesh,
          std::string(kObjectHelp) + "; default: the mesh stored or referenced in the file")
      ->group(parameters);
  command
      ->add_flag("--copy-mesh", options->copy_mesh,
                 "Copy the object's mesh beside the clip instead of storing its path")
      ->group(parameters);
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast import GRAB/grab/s1/mug_drink_1.npz -o grab_drink.npz\n"
      "  holdfast import visualize_samples/s10_mug_drink_1_0.npz --data-root GRAB -o drink.npz\n"
      "  holdfast import smplifyx/results --hand-model SMPLX_NEUTRAL.npz -o person.npz\n"
      "  holdfast import 07_03.amc.gz --asf 07.asf.gz --fps 60 -o walk.npz --json\n"
      "  holdfast import dance.bvh --map map.json --up z --meters-per-unit 1 -o dance.npz\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
