// SPDX-License-Identifier: MIT
#include "geometry/import/import_file.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/import/amass.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/fields.h"
#include "geometry/import/file_kind.h"
#include "geometry/import/grab_sequence.h"
#include "geometry/import/imos_result.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/mano_parameters.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/import/smplx_parameters.h"
#include "geometry/import/world_frame.h"
#include "geometry/io/mesh/mesh_io.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// An open data file and its fields.
struct OpenFile {
  const fs::path& path;
  const DataFile& file;
  Fields fields;
};

bool IsClip(const OpenFile& open) {
  return open.file.Format() == DataFormat::kNpz && IsHoldfastClip(open.fields.Names()) &&
         !NeedsImport(NpzReader(open.path));
}

ImportedClip ImportClip(const OpenFile& open, const ParameterOptions& options) {
  ImportedClip imported;
  imported.format = "clip";
  imported.clip = ReadClip(open.path);
  imported.object_mesh = MeshBeside(open.path, imported.clip.object);
  if (!imported.object_mesh.empty() && open.fields.Has("object_checksum")) {
    RequireMeshOf(open.path, ReadMesh(imported.object_mesh), imported.object_mesh.string());
  }
  imported.table_mesh = MeshBeside(open.path, imported.clip.table);
  if (auto note = OldPelvisNote(NpzReader(open.path))) imported.notes.push_back(std::move(*note));
  SettleWorld(imported, options, WorldUp::kPlusZ, false);
  return imported;
}

// Values without names: an array, or a list with the parameters of one frame per item.
bool IsArray(const OpenFile& open) {
  return open.file.Format() != DataFormat::kNpz && open.file.Root().Kind() == DataKind::kArray;
}

bool IsListOfParameters(const OpenFile& open) {
  if (open.file.Format() == DataFormat::kNpz) return false;
  const DataValue root = open.file.Root();
  return root.Kind() == DataKind::kList && root.Size() > 1 &&
         LooksLikeParameters(Fields(root[std::size_t{0}]));
}

ImportedClip ImportList(const OpenFile& open, const ParameterOptions& options) {
  const DataValue root = open.file.Root();
  ParameterCollector collector(options);
  for (std::size_t i = 0; i < root.Size(); ++i) collector.Add(Fields(root[i]));
  ImportedClip imported = collector.Collect();
  imported.format = "SMPL-X parameters, a list of frames";
  SettleWorld(imported, options, {}, true);
  return imported;
}

// {0: {...}, 1: {...}}: one track per person.
bool IsPeople(const OpenFile& open) {
  const std::vector<std::string> names = open.fields.Names();
  const auto is_number = [](const std::string& name) {
    return !name.empty() && std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; });
  };
  return !names.empty() && std::ranges::all_of(names, is_number) &&
         LooksLikeParameters(open.fields.In(names[0]));
}

ImportedClip ImportPerson(const OpenFile& open, const ParameterOptions& options) {
  const std::vector<std::string> names = open.fields.Names();
  if (static_cast<std::size_t>(options.person) >= names.size()) {
    throw Error(open.path.string(), fmt::format("has {} people", names.size()),
                "Choose one with --person, counted from 0");
  }
  const std::string& name = names[static_cast<std::size_t>(options.person)];
  ImportedClip imported = ImportParameters(open.fields.In(name), open.path, options);
  imported.format = "SMPL-X parameters by person";
  imported.notes.push_back(
      fmt::format("person '{}' of {} is used (choose with --person)", name, names.size()));
  return imported;
}

// Data file formats: the first importer that recognizes a file reads it. A new format needs one
// line here and one file in this folder.
struct Importer {
  std::string_view reads;
  bool (*recognizes)(const OpenFile&);
  ImportedClip (*import)(const OpenFile&, const ParameterOptions&);
};

constexpr std::array kImporters = {
    Importer{"GRAB sequence", [](const OpenFile& f) { return LooksLikeGrab(f.fields); },
             [](const OpenFile& f, const ParameterOptions& o) {
               return ImportGrab(f.fields, f.path, o);
             }},
    Importer{"IMoS result", [](const OpenFile& f) { return LooksLikeImos(f.fields); },
             [](const OpenFile& f, const ParameterOptions& o) {
               return ImportImos(f.fields, f.path, o);
             }},
    Importer{"Holdfast clip", IsClip, ImportClip},
    Importer{"AMASS (SMPL-X, SMPL-H, SMPL)",
             [](const OpenFile& f) { return LooksLikeAmass(f.fields); },
             [](const OpenFile& f, const ParameterOptions& o) {
               return ImportAmass(f.fields, f.path, o);
             }},
    Importer{"ARCTIC .smplx.npy, .mano.npy",
             [](const OpenFile& f) { return LooksLikeArctic(f.file, f.fields); },
             [](const OpenFile& f, const ParameterOptions& o) {
               return ImportArctic(f.fields, f.path, o);
             }},
    Importer{"SMPL-X parameters (.npz .pkl .npy .json .pt; names of the smplx package and others)",
             [](const OpenFile& f) { return LooksLikeParameters(f.fields); },
             [](const OpenFile& f, const ParameterOptions& o) {
               return ImportParameters(f.fields, f.path, o);
             }},
    Importer{"MANO parameters (the smplx package's names)",
             [](const OpenFile& f) { return LooksLikeMano(f.fields); },
             [](const OpenFile& f, const ParameterOptions& o) {
               return ImportMano(f.fields, f.path, o);
             }},
    Importer{"a list of such parameters, one per frame", IsListOfParameters, ImportList},
    Importer{"such parameters by person", IsPeople, ImportPerson},
    Importer{"Motion-X (frames, 322), poses (frames, 165 or 156)", IsArray,
             [](const OpenFile& f, const ParameterOptions& o) {
               return ImportParameterArray(f.file.Root(), o);
             }},
};

// Names in the first of a list of dicts, which stands for all.
std::vector<std::string> NamesOfItems(const DataValue& root) {
  if (root.Kind() != DataKind::kList || root.Size() == 0) return {};
  const DataValue first = root[std::size_t{0}];
  return first.Kind() == DataKind::kDict ? first.Names() : std::vector<std::string>();
}

ImportedClip ImportDataFile(const fs::path& path, const ParameterOptions& options) {
  const DataFile file(path);
  const OpenFile open{path, file, Fields(file)};
  for (const Importer& importer : kImporters) {
    if (importer.recognizes(open)) return importer.import(open, options);
  }
  std::vector<std::string> names = open.fields.Names();
  const auto has = [&](std::string_view name) { return open.fields.Has(name); };
  if (has("v_template") && (has("weights") || has("kintree_table"))) {
    throw Error(path.string(), "is a body model, not a motion", "Give it with --body");
  }
  if (LooksLikeObjectPoses(open.fields)) {
    throw Error(path.string(), "holds the poses of an object, but of no person or hand",
                "Give the file of the person beside it: the object is imported with it");
  }
  if (has("partbody_pose")) {
    throw Error(path.string(), "holds PIXIE's raw output, before decode()",
                "Save the parameters after decode(): they have a body_pose");
  }
  if (names.empty() && file.Format() != DataFormat::kNpz) names = NamesOfItems(file.Root());
  constexpr std::size_t kMaxNamed = 12;
  const std::vector<std::string> some(
      names.begin(), names.begin() + std::min<std::ptrdiff_t>(
                                         kMaxNamed, static_cast<std::ptrdiff_t>(names.size())));
  throw Error(path.string(),
              fmt::format("is {} without a known motion ({})", DataFormatName(file.Format()),
                          names.empty() ? std::string("no names")
                                        : fmt::format("it has: {}{}", fmt::join(some, ", "),
                                                      names.size() > kMaxNamed ? ", ..." : "")),
              fmt::format("Supported: {}", fmt::join(ImportableFormats(), "; ")));
}

ImportedClip ImportFolder(const fs::path& folder, const ParameterOptions& options) {
  std::error_code ignored;
  if (fs::exists(folder / "clip.npz", ignored)) {
    throw Error(folder.string(), "is a result folder: its clip needs no import",
                "Give the folder directly to fit, report, export or score");
  }
  const FrameFiles frames = FindFrameFiles(folder, options.person);
  ParameterCollector collector(options);
  for (const fs::path& path : frames.files) {
    const DataFile file(path);
    collector.Add(Fields(file));
  }
  ImportedClip imported = collector.Collect();
  imported.format = fmt::format("SMPL-X parameters, a folder of {} files", frames.files.size());
  if (frames.people > 1) {
    imported.notes.push_back(
        fmt::format("up to {} people per frame: person {} is used (choose with --person)",
                    frames.people, options.person));
  }
  if (frames.missing > 0) {
    imported.notes.push_back(
        fmt::format("frames missing between the first and the last number: {}; the others were "
                    "joined without a gap",
                    frames.missing));
  }
  SettleWorld(imported, options, {}, true);
  return imported;
}

ImportedFile ImportRetargeted(const fs::path& path, const ImportFileOptions& options) {
  ImportedFile imported;
  ImportOptions motion = options.motion;
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
  RequireInRange(clip, path.string());
  if (std::string note = WrapJointAngles(clip); !note.empty()) {
    imported.notes.push_back(std::move(note));
  }
  imported.source_frames = clip.NumFrames();
  imported.source_frame_rate = clip.frame_rate;
  if (const double rate = options.frame_rate.value_or(0); rate > 0 && rate != clip.frame_rate) {
    clip = Resample(clip, rate);
  }
  return imported;
}

std::vector<std::string> ImportableFormats() {
  std::vector<std::string> formats = {"BVH", "ASF/AMC", "glTF", "SkillMimic (.pt)",
                                      "a folder with one parameter file per frame"};
  for (const Importer& importer : kImporters) formats.emplace_back(importer.reads);
  return formats;
}

}  // namespace holdfast
