// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cctype>
#include <mutex>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/fit_metrics.h"
#include "apps/render_output.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/import/import_file.h"
#include "geometry/import/import_motion.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/gzip.h"
#include "geometry/io/gltf/gltf_onto.h"
#include "geometry/io/gltf/gltf_writer.h"
#include "geometry/io/gltf/mjcf_writer.h"
#include "geometry/io/gltf/usda_writer.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/io/motion/bvh_writer.h"
#include "geometry/parallel.h"
#include "geometry/retarget/retarget_onto.h"
#include "geometry/score/contact_metrics.h"
#include "geometry/score/contact_writer.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kGenerator = "Holdfast " HOLDFAST_VERSION;
constexpr double kLooseCorrectivesMm = 0.1;  // worth a note

struct ExportCommand {
  CommonOptions common;
  ClipInputOptions input;
  std::string clip;
  std::string output;
  std::string onto;
  bool no_object = false;
  bool no_correctives = false;
  double tolerance_mm = 0.02;
  double density_kg_m3 = 1000.0;
  int start = 0;
  std::optional<int> end;
  int every = 1;
};

std::string ExtensionOf(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

// What a result's metrics.json has for each frame, in a table that is called after it.
bool IsMetrics(const fs::path& output) {
  return ExtensionOf(output) == ".csv" && output.stem().string().ends_with("metrics");
}

// Contacts are any other table, or arrays in a file that is called after them.
bool IsContacts(const fs::path& output) {
  const std::string extension = ExtensionOf(output);
  return (extension == ".csv" && !IsMetrics(output)) ||
         (extension == ".npz" && output.stem().string().ends_with("contacts"));
}

// Empty for a file name that `export` can write, else what is wrong with it.
std::string FaultOfOutput(const std::string& output) {
  const std::string extension = ExtensionOf(output);
  const bool numbered = output.find('%') != std::string::npos;
  const bool sequence = extension == ".ply" || extension == ".obj";
  const bool single = extension == ".glb" || extension == ".bvh" || extension == ".usda" ||
                      extension == ".npz" || extension == ".csv" || extension == ".xml";
  if (!sequence && !single) {
    return fmt::format(
        "'{}': {}. Use .glb .bvh .usda .xml .npz, contacts.npz / .csv, metrics.csv, or "
        "name_%04d.ply / name_%04d.obj for one mesh per frame",
        output, extension == ".fbx" ? kFbxProblem : "is not a format to export");
  }
  if (sequence) {
    try {
      if (ParseNumberedName(output)) return {};
    } catch (const Error&) {
      // Told below, in words that fit meshes.
    }
    return fmt::format("'{}' does not number one mesh per frame: write it like name_%04d{}", output,
                       extension);
  }
  if (numbered) return fmt::format("'{}': {} holds the whole clip", output, extension);
  return {};
}

// The frames asked for.
void Cut(Clip& clip, const ExportCommand& options) {
  const int end = options.end.value_or(clip.NumFrames());
  if (options.start >= end || end > clip.NumFrames()) {
    throw Error(options.clip,
                fmt::format("has frames 0 to {}; {} to {} were asked for", clip.NumFrames() - 1,
                            options.start, end - 1),
                "Give --start and --end within them (--end is the first frame left out)");
  }
  if (options.start > 0 || end < clip.NumFrames()) clip = Slice(clip, options.start, end);
}

// One mesh per frame of the body, and of the object beside it under a name with "object_" in it.
int WriteSequence(const ClipInput& input, const TriangleMesh* object, const ExportCommand& options,
                  nlohmann::json& summary, std::string& text) {
  const CommonOptions& common = options.common;
  const NumberedName body_name = *ParseNumberedName(options.output);
  NumberedName object_name = body_name;
  object_name.before += "object_";
  const Clip& clip = input.clip;
  const std::vector<int> frames = EveryFrame(clip.NumFrames(), options.every);
  for (const int t : frames) {
    RequireNew(body_name.Name(options.start + t), common);
    if (object != nullptr) RequireNew(object_name.Name(options.start + t), common);
  }
  const BodySurface surface = input.Surface();
  Progress progress(common, "export");
  std::mutex lock;
  int finished = 0;
  ParallelFor(static_cast<int>(frames.size()), NumThreads(common), [&](int k) {
    if (Interrupted()) return;
    const int t = frames[k];
    BodyState state;
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    WriteMesh({state.vertices, surface.Faces()}, body_name.Name(options.start + t));
    if (object != nullptr) {
      TriangleMesh placed = *object;
      placed.vertices = clip.object->Pose(t) * object->vertices;
      WriteMesh(placed, object_name.Name(options.start + t));
    }
    const std::scoped_lock guard(lock);
    progress.Update(++finished, static_cast<int>(frames.size()));
  });
  summary["files"] = frames.size() * (object != nullptr ? 2 : 1);
  text += fmt::format("  {} files\n", frames.size() * (object != nullptr ? 2 : 1));
  return Interrupted() ? kInterrupted : kDone;
}

// Of the object that the clip of a glTF file carries.
std::optional<TexturedMesh> LookInScene(const fs::path& path, double scale) {
  std::optional<TexturedMesh> look;
  try {
    look = ImportFile(path, {}).object_look;
  } catch (const Error&) {
  }
  if (look) Transform(scale * Eigen::Matrix3d::Identity(), *look);
  return look;
}

Eigen::AlignedBox3d BoxOf(const TexturedMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const TexturedMesh::Part& part : mesh.parts) {
    for (const Eigen::Vector3d v : part.mesh.vertices.colwise()) box.extend(v);
  }
  return box;
}

// How the object looks, where that is known: of the clip's own file, of --object, or of what the
// command that wrote the result was given, unless it is another mesh by now.
std::optional<TexturedMesh> ObjectLook(const ClipInput& input, const TriangleMesh& object,
                                       const ExportCommand& options) {
  fs::path path = options.input.object;
  double scale = options.input.object_scale;
  if (path.empty() && input.metrics.is_object() && input.metrics.contains("options")) {
    const nlohmann::json& made = input.metrics["options"];
    if (made.contains("object") && made["object"].is_string()) {
      path = made["object"].get<std::string>();
    }
    if (made.contains("object_scale") && made["object_scale"].is_number()) {
      scale = made["object_scale"].get<double>();
    }
  }
  std::optional<TexturedMesh> look = input.object_look;
  if (!look) {
    const std::string kind = ExtensionOf(path);
    const bool is_scene = kind == ".glb" || kind == ".gltf";
    if (kind != ".obj" && !is_scene) return std::nullopt;
    const bool exists = fs::exists(path);
    if (exists) look = is_scene ? LookInScene(path, scale) : ReadTexturedObj(path, scale);
    const Eigen::AlignedBox3d held(object.vertices.rowwise().minCoeff(),
                                   object.vertices.rowwise().maxCoeff());
    if (!exists || (look && !BoxOf(*look).isApprox(held, 1e-4))) {
      Note(options.common,
           fmt::format("note: the object is plain: {} {} (give it with --object)", path.string(),
                       look ? "is another mesh by now" : "is not there any more"));
      return std::nullopt;
    }
  }
  for (std::size_t k = 0; look && k < look->notes.size(); ++k) {
    Note(options.common,
         fmt::format("note: {}: {}", path.empty() ? input.source : path.string(), look->notes[k]));
  }
  return look;
}

std::string ClipName(const ClipInput& input) {
  return input.file.empty() ? input.source : input.file.stem().string();
}

// The motion on the skeleton of a character, which keeps its skin.
void WriteOnto(const ClipInput& input, const TriangleMesh* object, const ExportCommand& options,
               nlohmann::json& summary, std::string& text) {
  if (input.body->LoneHand()) {
    throw Error(options.clip, "is a hand alone, which no character can take over",
                "Export it without --onto");
  }
  if (!LooksLikeGltf(ReadGzipHead(options.onto, 4096))) {
    throw Error(options.onto, ExtensionOf(options.onto) == ".fbx" ? kFbxProblem : "is not glTF",
                "Give --onto a character as .glb or .gltf");
  }
  const GltfAsset asset = GltfAsset::Read(options.onto);
  const GltfRig rig = ReadGltfRig(asset);
  const SkeletonMap map = RecognizeSkeleton(rig.motion, options.onto);
  const SourceMotion motion =
      RetargetOnto(input.clip, RetargetBodyOf(*input.body, input.betas), rig.motion, map);
  std::optional<TexturedMesh> look;
  if (object != nullptr) {
    look = ObjectLook(input, *object, options);
    if (!look) look = PlainMesh(*object, ObjectMaterial());
  }
  WriteGltfOnto(options.onto, asset, rig, motion, map.source[0], look ? &*look : nullptr,
                {ClipName(input), kGenerator}, options.output);
  summary["skeleton"] = map.name;
  summary["joints"] = map.NumMapped();
  text += fmt::format("  on the skeleton of {} ({}): {} of its {} joints\n", options.onto, map.name,
                      map.NumMapped(), rig.motion.NumJoints());
}

// Tells what `format` leaves of the pose correctives, for people and machines.
void WriteGlbFile(const ClipInput& input, const TriangleMesh* object, const ExportCommand& options,
                  nlohmann::json& summary, std::string& text) {
  GlbOptions glb;
  glb.generator = kGenerator;
  glb.clip_name = ClipName(input);
  glb.correctives = !options.no_correctives;
  glb.corrective_tolerance_m = 1e-3 * options.tolerance_mm;
  glb.threads = NumThreads(options.common);
  if (input.table && !options.no_object) glb.table = &*input.table;
  std::optional<TexturedMesh> look;
  if (object != nullptr) look = ObjectLook(input, *object, options);
  if (look) glb.object_look = &*look;
  const GlbReport report = WriteGlb(input.clip, input.Surface(), object, glb, options.output);
  const double error_mm = 1e3 * report.corrective_error_m;
  summary["morph_targets"] = report.morph_targets;
  summary["influences_per_vertex"] = report.influences;
  summary["surface_error_mm"] = error_mm;
  text += fmt::format(
      "  skin of 55 joints, {} per vertex; {} morph targets; surface within {:.3f} "
      "mm of the body model\n",
      report.influences, report.morph_targets, error_mm);
  if (!options.no_correctives && error_mm > std::max(options.tolerance_mm, kLooseCorrectivesMm)) {
    Note(options.common, fmt::format("note: {} morph targets leave {:.2f} mm between the file's "
                                     "surface and the body model's (--start and --end export less)",
                                     report.morph_targets, error_mm));
  }
}

// The second table beside contacts.csv.
fs::path PosesPath(const fs::path& output) {
  return output.parent_path() / (output.stem().string() + "_poses.csv");
}

// Where the hands touch the object, and the poses of wrists and fingertips.
void WriteContacts(const ClipInput& input, const TriangleMesh* object, const ExportCommand& options,
                   nlohmann::json& summary, std::string& text) {
  if (object == nullptr) {
    throw Error(options.clip,
                input.clip.object ? "its object's mesh is not there: " + input.object_missing
                                  : "has no object to touch",
                input.clip.object ? "Give it with --object" : "Fit one first ('holdfast fit')");
  }
  const ClipContactPoints contacts =
      FindContactPoints(input.clip, input.body, input.betas, SignedDistance(*object),
                        1e-3 * ContactProtocol().contact_threshold_mm, NumThreads(options.common));
  if (ExtensionOf(options.output) == ".csv") {
    WriteContactsCsv(contacts, options.output, PosesPath(options.output));
  } else {
    WriteContactsNpz(contacts, options.output);
  }
  std::set<int> touching;
  for (const ContactPoint& point : contacts.points) touching.insert(point.frame);
  summary["contact_points"] = contacts.points.size();
  summary["frames_in_contact"] = touching.size();
  text += fmt::format("  {} contact points in {} frames; poses of {} wrists and their fingertips\n",
                      contacts.points.size(), touching.size(), contacts.hands.size());
}

// Object and hands for MuJoCo.
void WriteScene(const ClipInput& input, const TriangleMesh* object, const ExportCommand& options,
                nlohmann::json& summary, std::string& text) {
  MjcfOptions mjcf;
  mjcf.generator = kGenerator;
  mjcf.model_name = ClipName(input);
  mjcf.every = options.every;
  mjcf.density_kg_m3 = options.density_kg_m3;
  if (input.table && !options.no_object) mjcf.table = &*input.table;
  const MjcfReport report = WriteMjcf(input.clip, input.Surface(), object, mjcf, options.output);
  if (report.mass_of_hull) {
    Note(options.common,
         fmt::format("note: the object is not a closed surface with faces outwards: {} that of its "
                     "convex hull",
                     report.mesh_is_hull ? "mesh and mass are" : "its mass is"));
  }
  summary["hand_pieces"] = report.hand_pieces;
  summary["object_mass_kg"] = report.object_mass_kg;
  text += fmt::format(
      "  {} hand pieces (mocap bodies){}; {} key frames; meshes in {}\n", report.hand_pieces,
      object == nullptr ? "" : fmt::format(", object of {:.3g} kg", report.object_mass_kg),
      report.key_frames, MjcfAssets(options.output).string());
}

int Run(const ExportCommand& options) {
  const CommonOptions& common = options.common;
  const std::string extension = ExtensionOf(options.output);
  const bool is_metrics = IsMetrics(options.output);
  const bool is_contacts = IsContacts(options.output);
  const bool has_meshes =
      is_contacts || (!is_metrics && extension != ".bvh" && extension != ".npz");
  const bool is_sequence = extension == ".ply" || extension == ".obj";
  if (options.every > 1 && !is_sequence && extension != ".usda" && extension != ".xml") {
    throw CLI::ValidationError("--every", "is for mesh sequences, .usda and .xml");
  }
  if (!options.onto.empty() && extension != ".glb") {
    throw CLI::ValidationError("--onto", "writes a .glb");
  }
  if (!is_sequence) RequireNew(options.output, common);
  if (extension == ".csv" && is_contacts) RequireNew(PosesPath(options.output), common);
  if (extension == ".xml") RequireNewFolder(MjcfAssets(options.output), common);
  ClipInput input = LoadClipInput(options.clip, options.input, common);
  const int frames_of_clip = input.clip.NumFrames();
  Cut(input.clip, options);
  if (options.no_object) input.clip.object.reset();
  const TriangleMesh* object = nullptr;
  if (has_meshes && input.clip.object) {
    if (input.object) {
      object = &*input.object;
    } else if (!is_contacts) {
      Note(common, "note: the body is exported alone: " + input.object_missing);
    }
  }
  if (extension == ".bvh" && input.clip.object) {
    Note(common, "note: a .bvh holds the skeleton alone: the object is left out (.glb has both)");
  }
  if (has_meshes && !input.clip.object && !options.input.object.empty() && !options.no_object) {
    throw Error(options.clip, "has no object track for the mesh of --object to move along",
                "Leave --object out, or fit the object first ('holdfast fit')");
  }

  nlohmann::json summary = JsonHead("holdfast/export/1", common);
  summary["output"] = options.output;
  summary["format"] = extension.substr(1);
  const std::size_t frames = EveryFrame(input.clip.NumFrames(), options.every).size();
  summary["frames"] = frames;
  summary["frame_rate"] = input.clip.frame_rate / options.every;
  summary["object"] =
      object != nullptr || (!has_meshes && extension == ".npz" && input.clip.object);
  std::string text = fmt::format("{}: {} frames at {:g} Hz{}\n", options.output, frames,
                                 input.clip.frame_rate / options.every,
                                 object != nullptr ? ", body and object" : "");
  int exit_code = kDone;
  if (is_metrics) {
    WriteAtomically(options.output,
                    PerFrameCsv(input.metrics, options.clip, input.clip.frame_rate, frames_of_clip,
                                options.start, input.clip.NumFrames()));
  } else if (is_contacts) {
    WriteContacts(input, object, options, summary, text);
  } else if (is_sequence) {
    exit_code = WriteSequence(input, object, options, summary, text);
  } else if (!options.onto.empty()) {
    WriteOnto(input, object, options, summary, text);
  } else if (extension == ".glb") {
    WriteGlbFile(input, object, options, summary, text);
  } else if (extension == ".bvh") {
    WriteBvh(input.clip, input.Surface(), options.output);
  } else if (extension == ".xml") {
    WriteScene(input, object, options, summary, text);
  } else if (extension == ".usda") {
    Progress progress(common, "export");
    UsdaOptions usda;
    usda.generator = kGenerator;
    usda.every = options.every;
    usda.threads = NumThreads(common);
    usda.progress = [&](int done, int total) { progress.Update(done, total); };
    WriteUsda(input.clip, input.Surface(), object, usda, options.output);
  } else {
    WriteClip(input.clip, options.output);
  }
  if (exit_code == kDone) PrintResult(common, summary, text);
  return exit_code;
}

}  // namespace

void AddExportCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ExportCommand>();
  CLI::App* command = app.add_subcommand(
      "export",
      "Writes a clip for other programs: .glb .bvh .usda .xml .npz .csv, or a mesh per frame");
  command->add_option("clip", options->clip, kClipHelp)->required();
  command
      ->add_option("-o,--output", options->output,
                   "File to write; its extension gives the format (below)")
      ->required()
      ->check(FaultOfOutput);
  AddClipInputOptions(*command, options->input);
  command->add_option("--onto", options->onto,
                      ".glb: the motion on the skeleton of this character (.glb, .gltf), which "
                      "keeps its skin");
  command->add_flag("--no-object", options->no_object, "The body alone");
  AddOption(*command, "--start", options->start, "First frame, from 0", CLI::NonNegativeNumber);
  command->add_option("--end", options->end, "First frame left out; all by default")
      ->check(CLI::PositiveNumber);
  AddOption(*command, "--every", options->every, "Sequences, .usda and .xml: each n-th frame",
            CLI::PositiveNumber);
  command->add_flag(
      "--no-correctives", options->no_correctives,
      ".glb: no morph targets; smaller, the skin is off by centimetres at bent joints");
  AddOption(*command, "--tolerance", options->tolerance_mm,
            ".glb: largest distance from the body model's surface, mm", CLI::Range(1e-3, 100.0));
  AddOption(*command, "--density", options->density_kg_m3,
            ".xml: of the object, kg/m3 (water: 1000)", CLI::Range(1.0, 30'000.0));
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast export held -o held.glb\n"
      "  holdfast export held -o animated.glb --onto character.glb\n"
      "  holdfast export walk.npz -o walk_%04d.ply --every 5\n"
      "  holdfast export held -o scene.xml --density 600\n"
      "  holdfast export held -o metrics.csv\n"
      "Formats:\n"
      "  .glb   glTF 2.0, metres, y up: skinned body with pose correctives as morph targets,\n"
      "         the object, animated, with the materials and textures of its .obj, and the table "
      "it\n"
      "         stood on where the clip has one\n"
      "  .bvh   55 joints with the shaped body's offsets, centimetres, y up, Euler Z X Y\n"
      "  .usda  USD text, metres, z up: the body's points in every frame, the object's transform\n"
      "  .xml   MJCF for MuJoCo, metres, z up: the object as a free body, the hands as mocap "
      "bodies "
      "of\n"
      "         convex pieces, a floor, a key frame for each frame; meshes in scene_assets/\n"
      "  .npz   the clip itself (AMASS layout, z up), cut to --start and --end\n"
      "  contacts.npz, .csv  where the hands touch the object in each frame, normals, depth, and\n"
      "         the poses of wrists and fingertips (docs/formats.md); x_contacts.npz does too\n"
      "  metrics.csv  what fit, offhand, refine and reach measured in each frame (x_metrics.csv "
      "does\n"
      "         too): the columns of metrics.json's per_frame\n"
      "  .ply .obj  x_%04d.ply is the body in each frame (metres, z up, numbered from the clip's\n"
      "         first), x_object_%04d.ply the object\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
