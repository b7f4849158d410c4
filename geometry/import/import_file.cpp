// SPDX-License-Identifier: MIT
#include "geometry/import/import_file.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/import/amass.h"
#include "geometry/import/body_sets.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/fields.h"
#include "geometry/import/file_kind.h"
#include "geometry/import/grab_sequence.h"
#include "geometry/import/hand_sets.h"
#include "geometry/import/imos_result.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/mano_parameters.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/smplx_parameters.h"
#include "geometry/import/world_frame.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/retarget/skeleton_map.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

bool IsClip(const DataFile& file, const Fields& fields) {
  return file.Format() == DataFormat::kNpz && IsHoldfastClip(fields.Names()) &&
         !NeedsImport(NpzReader(file.Path()));
}

ImportedClip ImportClip(const DataFile& file, const Fields& fields,
                        const ParameterOptions& options) {
  const fs::path& path = file.Path();
  ImportedClip imported;
  imported.format = "clip";
  imported.clip = ReadClip(path);
  imported.object_mesh = MeshBeside(path, imported.clip.object);
  if (!imported.object_mesh.empty() && fields.Has("object_checksum")) {
    RequireMeshOf(path, ReadMesh(imported.object_mesh), imported.object_mesh.string());
  }
  imported.table_mesh = MeshBeside(path, imported.clip.table);
  if (auto note = OldPelvisNote(NpzReader(path))) imported.notes.push_back(std::move(*note));
  SettleWorld(imported, options, UpAxis::kZ, false);
  return imported;
}

// Values without names: an array, or a list with the parameters of one frame per item.
bool IsArray(const DataFile& file, const Fields&) {
  return file.Format() != DataFormat::kNpz && file.Root().Kind() == DataKind::kArray;
}

ImportedClip ImportArray(const DataFile& file, const Fields&, const ParameterOptions& options) {
  const DataValue root = file.Root();
  if (LooksLikeHandArray(root)) return ImportHandArray(root, file.Path(), options);
  return ImportParameterArray(root, options);
}

bool IsListOfParameters(const DataFile& file, const Fields&) {
  if (file.Format() == DataFormat::kNpz) return false;
  const DataValue root = file.Root();
  return root.Kind() == DataKind::kList && root.Size() > 1 &&
         LooksLikeParameters(Fields(root[std::size_t{0}]));
}

ImportedClip ImportList(const DataFile& file, const Fields&, const ParameterOptions& options) {
  const DataValue root = file.Root();
  ParameterCollector collector(options);
  for (std::size_t i = 0; i < root.Size(); ++i) collector.Add(Fields(root[i]));
  ImportedClip imported = collector.Collect();
  imported.format = "SMPL-X parameters, a list of frames";
  SettleWorld(imported, options, {}, true);
  return imported;
}

// {0: {...}, 1: {...}}: one track per person.
bool IsPeople(const DataFile&, const Fields& fields) {
  const std::vector<std::string> names = fields.Names();
  const auto is_number = [](const std::string& name) {
    return !name.empty() && std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; });
  };
  return !names.empty() && std::ranges::all_of(names, is_number) &&
         LooksLikeParameters(fields.In(names[0]));
}

ImportedClip ImportPerson(const DataFile& file, const Fields& fields,
                          const ParameterOptions& options) {
  const std::vector<std::string> names = fields.Names();
  if (static_cast<std::size_t>(options.person) >= names.size()) {
    throw Error(file.Path().string(), fmt::format("has {} people", names.size()),
                "Choose one with --person, counted from 0");
  }
  const std::string& name = names[options.person];
  ImportedClip imported = ImportParameters(fields.In(name), file.Path(), options);
  imported.format = "SMPL-X parameters by person";
  imported.notes.push_back(
      fmt::format("person '{}' of {} is used (choose with --person)", name, names.size()));
  return imported;
}

// The person of that number in a file of one frame: EasyMocap's lists have an `id` in each.
Fields PersonIn(const DataFile& file, int person) {
  if (file.Format() == DataFormat::kNpz) return Fields(file);
  const DataValue root = file.Root();
  if (root.Kind() != DataKind::kList || root.Size() < 2) return Fields(file);
  for (std::size_t i = 0; i < root.Size(); ++i) {
    const Fields one(root[i]);
    const auto id = one.Find("id");
    if (id && id->Kind() == DataKind::kInteger && id->Number() == person) return one;
  }
  throw Error(file.Path().string(),
              fmt::format("has {} people, none with id {}", root.Size(), person),
              "Choose another with --person");
}

// Data file formats: the first importer that recognizes a file reads it. A new format needs one
// line here and one file in this folder.
struct Importer {
  std::string_view reads;
  bool (*recognizes)(const DataFile&, const Fields&);
  ImportedClip (*import)(const DataFile&, const Fields&, const ParameterOptions&);
};

// Those that need only the fields of a file, and its path.
template <auto kLooksLike>
bool TellsByFields(const DataFile&, const Fields& fields) {
  return kLooksLike(fields);
}
template <auto kImport>
ImportedClip FromFields(const DataFile& file, const Fields& fields,
                        const ParameterOptions& options) {
  return kImport(fields, file.Path(), options);
}

// Those of JSON files.
template <auto kLooksLike>
bool TellsByRoot(const DataFile& file, const Fields&) {
  return file.Format() == DataFormat::kJson && kLooksLike(file.Root());
}
template <auto kImport>
ImportedClip FromRoot(const DataFile& file, const Fields&, const ParameterOptions& options) {
  return kImport(file.Root(), file.Path(), options);
}

constexpr Importer kImporters[] = {
    {"GRAB sequence", TellsByFields<LooksLikeGrab>, FromFields<ImportGrab>},
    {"IMoS result", TellsByFields<LooksLikeImos>, FromFields<ImportImos>},
    {"Holdfast clip", IsClip, ImportClip},
    {"AMASS (SMPL-X, SMPL-H, SMPL)", TellsByFields<LooksLikeAmass>, FromFields<ImportAmass>},
    {"ARCTIC .smplx.npy, .mano.npy", LooksLikeArctic, FromFields<ImportArctic>},
    {"HIMO", LooksLikeHimo, ImportHimo},
    {"ParaHome smplx_pose.pkl", LooksLikeParaHome, ImportParaHome},
    {"SMPL-X parameters (.npz .pkl .npy .json .pt; names of the smplx package and others)",
     TellsByFields<LooksLikeParameters>, FromFields<ImportParameters>},
    {"MANO parameters (the smplx package's names)", TellsByFields<LooksLikeMano>,
     FromFields<ImportMano>},
    {"hands with objects: HO-3D, DexYCB, OakInk, TACO, GigaHands", TellsByFields<LooksLikeHandSet>,
     FromFields<ImportHandSet>},
    {"HOT3D mano_hand_pose_trajectory.jsonl", TellsByRoot<LooksLikeHot3d>, FromRoot<ImportHot3d>},
    {"ContactPose mano_fits_15.json", TellsByRoot<LooksLikeContactPose>,
     FromRoot<ImportContactPose>},
    {"OakInk2", TellsByFields<LooksLikeOakInk2>, FromFields<ImportOakInk2>},
    {"OMOMO", TellsByFields<LooksLikeOmomo>, FromFields<ImportOmomo>},
    {"MDM's SMPL parameters", TellsByFields<LooksLikeMdm>, FromFields<ImportMdm>},
    {"a list of SMPL-X parameters, one item per frame", IsListOfParameters, ImportList},
    {"a dict of SMPL-X parameters, one entry per person", IsPeople, ImportPerson},
    {"arrays: Motion-X (frames, 322), poses (frames, 165 or 156), MANO (frames, 48), HO-Cap "
     "(2, frames, 51)",
     IsArray, ImportArray},
};

// Names in the first of a list of dicts, which stands for all.
std::vector<std::string> NamesOfItems(const DataValue& root) {
  if (root.Kind() != DataKind::kList || root.Size() == 0) return {};
  const DataValue first = root[std::size_t{0}];
  return first.Kind() == DataKind::kDict ? first.Names() : std::vector<std::string>();
}

ImportedClip ImportDataFile(const fs::path& path, const ParameterOptions& options) {
  const DataFile file(path);
  const Fields fields(file);
  for (const Importer& importer : kImporters) {
    if (importer.recognizes(file, fields)) return importer.import(file, fields, options);
  }
  std::vector<std::string> names = fields.Names();
  const auto has = [&](std::string_view name) { return fields.Has(name); };
  if (has("v_template") && (has("weights") || has("kintree_table"))) {
    throw Error(path.string(), "is a body model, not a motion", "Give it with --body");
  }
  if (LooksLikeObjectPoses(fields)) {
    throw Error(path.string(), "holds object poses, but no person or hand",
                "Give the person's file in the same folder: it is imported with its object");
  }
  if (has("armature") && has("objects")) {
    throw Error(path.string(),
                "holds bones of HUMOTO relative to a rest pose that only the .fbx beside it has",
                "Export the .fbx as .glb in Blender and import that, with the object in --prop");
  }
  if (has("mhr_model_params") || has("pred_keypoints_3d")) {
    throw Error(
        path.string(), "holds a body of MHR (SAM 3D Body), which is not read",
        "Convert it to SMPL-X with the tool in MHR's repository, and import its parameters");
  }
  if (has("partbody_pose")) {
    throw Error(path.string(), "holds PIXIE's raw output, before decode()",
                "Save the parameters after decode(): they have a body_pose");
  }
  if (names.empty() && file.Format() != DataFormat::kNpz) names = NamesOfItems(file.Root());
  constexpr std::size_t kMaxNamed = 12;
  throw Error(path.string(),
              fmt::format("is {} without a known motion ({})", DataFormatName(file.Format()),
                          names.empty() ? std::string("no names")
                                        : "it has: " + SomeNames(names, kMaxNamed)),
              fmt::format("Supported: {}", fmt::join(ImportableFormats(), "; ")));
}

ImportedClip ImportFolder(const fs::path& folder, const ParameterOptions& options) {
  std::error_code ignored;
  if (fs::exists(folder / "clip.npz", ignored)) {
    throw Error(folder.string(), "is a result folder: its clip needs no import",
                "Give the folder directly to fit, report, export or score");
  }
  if (const std::vector<fs::path> frames = FindH2oFrames(folder); !frames.empty()) {
    return ImportH2o(frames, options);
  }
  std::vector<std::string> notes;
  const std::vector<fs::path> files = FindFrameFiles(folder, options.person, notes);
  if (const DataFile first(files[0]); LooksLikeHandSet(Fields(first))) {
    ImportedClip imported = ImportHandFrames(files, options);
    imported.format += fmt::format(", a folder of {} files", files.size());
    Append(imported.notes, std::move(notes));
    return imported;
  }
  ParameterCollector collector(options);
  for (const fs::path& path : files) {
    const DataFile file(path);
    collector.Add(PersonIn(file, options.person));
  }
  ImportedClip imported = collector.Collect();
  imported.format = fmt::format("SMPL-X parameters, a folder of {} files", files.size());
  Append(imported.notes, std::move(notes));
  SettleWorld(imported, options, {}, true);
  return imported;
}

ImportedFile ImportRetargeted(const fs::path& path, const ImportFileOptions& options) {
  ImportedFile imported;
  ImportOptions motion = options.motion;
  static_cast<FileFacts&>(motion) = options.parameters;
  motion.frame_rate = options.frame_rate.value_or(30.0);
  imported.motion.emplace();
  const SourceMotion source = ReadMotion(path, motion);
  const BodyModel& body = *options.parameters.body;
  if (body.LoneHand()) {
    throw Error(path.string(),
                "is a whole-body motion, but " + body.Name() + " is a model of a hand alone",
                "Import it with a whole-body model first, then use 'holdfast convert'");
  }
  if (motion.betas.size() == 0 && source.body_model == body.Name()) motion.betas = source.betas;
  imported.clip = ImportMotion(source, path.string(), RetargetBodyOf(body, motion.betas), motion,
                               &*imported.motion);
  imported.clip.body_model = body.Name();
  if (source.prop && source.prop->mesh.NumFaces() > 0) {
    imported.object_surface = source.prop->mesh;
    imported.object_surface->vertices *= imported.motion->retarget.scale;
    imported.object_look = source.prop->look;
    if (imported.object_look) {
      Transform(imported.motion->retarget.scale * Eigen::Matrix3d::Identity(),
                *imported.object_look);
    }
  }
  imported.format = imported.motion->format;
  imported.notes = imported.motion->notes;
  imported.source_frames = imported.motion->source_frames;
  imported.source_frame_rate = imported.motion->source_frame_rate;
  return imported;
}

// Rejects files that users give for a motion by mistake, naming their kind.
void RefuseOtherKinds(const fs::path& path) {
  const FileKind kind = Identify(path).kind;
  constexpr std::array kOthers = {FileKind::kPicture,   FileKind::kVideo, FileKind::kHtml,
                                  FileKind::kPlyPoints, FileKind::kUsd,   FileKind::kMetrics};
  if (!IsMesh(kind) && std::ranges::find(kOthers, kind) == kOthers.end()) return;
  throw Error(path.string(), fmt::format("is not a motion but a {}", Describe(kind)),
              "Give .npz, .npy, .pkl or .json with SMPL-X or SMPL-H parameters, .bvh, .amc, .glb "
              "or .gltf");
}

}  // namespace

fs::path MeshBeside(const fs::path& clip, const std::optional<ObjectTrack>& track) {
  if (!track || track->mesh.empty()) return {};
  std::error_code ignored;
  const fs::path mesh = clip.parent_path() / track->mesh;
  return fs::is_regular_file(mesh, ignored) ? mesh : fs::path();
}

std::optional<TriangleMesh> ObjectMeshOf(const ImportedClip& imported) {
  if (imported.object_surface) return imported.object_surface;
  if (imported.object_mesh.empty()) return std::nullopt;
  try {
    TriangleMesh mesh = ReadMesh(imported.object_mesh);
    mesh.vertices *= imported.object_mesh_scale;
    return mesh;
  } catch (const Error&) {
    return std::nullopt;
  }
}

OptionTable OptionsOf(ImportFileOptions& options) {
  ParameterOptions& parameters = options.parameters;
  ImportOptions& motion = options.motion;
  OptionTable table;
  table.Number("fps", "", options.frame_rate, {0.0, 1000.0},
               "BVH, AMC, glTF: 30; parameters: the file's",
               "Frame rate of the output clip, Hz; 0: that of the file");
  table.Number("source_fps", "", parameters.source_frame_rate, {1.0, 1000.0},
               "AMC: 120; IMoS: 10; others: 30",
               "Frame rate to assume if the file does not state one, Hz");
  table.Number("meters_per_unit", "", parameters.meters_per_unit, {1e-6, 1e3},
               "BVH: 0.01; ASF: as the file states; parameters: 1",
               "Length unit of the file, in meters");
  table.Choice("up", parameters.up, UpAxisChoices(),
               "Up axis of the file (write negative ones as --up=-y); auto: the format's "
               "convention, else detected from the posture");
  table.Flag("keep_ground", parameters.keep_ground,
             "Keep the heights; do not shift the feet to z = 0");
  table.Text("prop", parameters.prop,
             "Name of the object to use if the scene has several (glTF: node name); default: "
             "of those that move, the one nearest to a hand (glTF: the first)");
  table.Group("Motions with their own skeleton");
  table.Text(
      "map", motion.map,
      fmt::format(
          "JSON file of joint names, {{\"source joint\": \"smplx joint\"}}; not needed for: {}",
          fmt::join(KnownSkeletons(), "; ")));
  table.Text("asf", motion.skeleton,
             "Skeleton (.asf) of an .amc file; default: the matching .asf in the same folder");
  table.Text("animation", motion.animation,
             "Animation to use in a glTF file with several; default: the character's longest");
  table.Text("character", motion.character, "Character to use in a glTF file with several");
  table.Group("Parameters of a body model");
  table.Choice("hands", parameters.hands,
               {{"body", ImportedHands::kOfBody},
                {"rhand", ImportedHands::kRightAlone},
                {"lhand", ImportedHands::kLeftAlone},
                {"none", ImportedHands::kNone}},
               "Hands to import: body (those of the body); rhand or lhand (only this hand, as "
               "MANO, if the file has it); none (relaxed hands in place of the file's)");
  using Known = std::optional<bool>;
  table.Choice("flat_hand_mean", parameters.flat_hand_mean,
               {{"auto", Known()}, {"yes", true}, {"no", false}},
               "Whether finger angles are complete (yes) or relative to the mean hand (no); auto: "
               "the format's convention, else detected from the fingers");
  table.Text("data_root", parameters.data_root,
             "Folder of the data set (with GRAB's 'tools', ARCTIC's 'meta') for meshes that the "
             "file references; if left out, the parent folders are searched");
  table.Number("person", "", parameters.person, kNonNegative,
               "Index of the person in a file or folder with several, from 0");
  return table;
}

ImportedFile ImportFile(const fs::path& path, const ImportFileOptions& options) {
  if (!options.parameters.body) {
    ImportFileOptions with_body = options;
    with_body.parameters.body = BodyModel::Default();
    return ImportFile(path, with_body);
  }
  std::error_code error;
  if (!fs::exists(path, error)) throw Error(path.string(), "does not exist", "Check the path");
  const bool folder = fs::is_directory(path, error);
  if (!folder) RefuseOtherKinds(path);
  if (!folder && LooksLikeMotionFile(path)) return ImportRetargeted(path, options);
  ImportedFile imported;
  static_cast<ImportedClip&>(imported) =
      folder ? ImportFolder(path, options.parameters) : ImportDataFile(path, options.parameters);
  Clip& clip = imported.clip;
  NoteRotationDefects(imported);
  if (options.motion.betas.size() > 0) {
    imported.notes.push_back(
        "warning: betas are ignored: this file has its own; the option applies only to motions "
        "with their own skeleton");
  }
  RequireInRange(clip, path.string());
  if (std::string note = WrapJointAngles(clip); !note.empty()) {
    imported.notes.push_back(std::move(note));
  }
  imported.source_frames = clip.NumFrames();
  imported.source_frame_rate = clip.frame_rate;
  if (const double rate = options.frame_rate.value_or(0); rate > 0 && rate != clip.frame_rate) {
    const double ratio = rate / clip.frame_rate;
    clip = Resample(clip, rate);
    if (imported.goal) {
      imported.goal->frame = std::min(static_cast<int>(std::lround(ratio * imported.goal->frame)),
                                      clip.NumFrames() - 1);
    }
  }
  return imported;
}

std::vector<std::string> ImportableFormats() {
  std::vector<std::string> formats = {"BVH",
                                      "ASF/AMC",
                                      "glTF",
                                      "SkillMimic and InterMimic (.pt)",
                                      "Kimodo's SOMA skeleton (.npz)",
                                      "H2O (a folder)",
                                      "a folder with one parameter file per frame"};
  for (const Importer& importer : kImporters) formats.emplace_back(importer.reads);
  return formats;
}

}  // namespace holdfast
