// SPDX-License-Identifier: MIT
#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/export/export_clip.h"
#include "geometry/import/import_file.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "solver/trial/trial_clip.h"

namespace holdfast::apps {
namespace {

// Quotes a cell if necessary.
std::string CsvCell(std::string text) {
  text = AsUtf8(text);
  if (text.find_first_of(",\"\r\n") == text.npos) return text;
  for (std::size_t at = 0; (at = text.find('"', at)) != text.npos; at += 2) text.insert(at, 1, '"');
  return '"' + text + '"';
}

std::string CsvCell(const nlohmann::json& value) {
  if (value.is_null()) return {};
  if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
  return CsvCell(value.is_string() ? value.get<std::string>() : JsonText(value));
}

// Returns `count` frames from `begin` on of the per-frame data in a result's `metrics`
// (metrics.json) as a table: frame (from 0 at `begin`), time_s, and one column per name, with units
// in the names. true and false are 1 and 0; missing values are empty. Throws Error about `source`
// if there are no per-frame data, or not for each of the `frames` of its clip.
std::string PerFrameCsv(const nlohmann::json& metrics, const std::string& source, double frame_rate,
                        int frames, int begin, int count) {
  const nlohmann::json columns =
      metrics.is_object() ? metrics.value("per_frame", nlohmann::json()) : nlohmann::json();
  if (!columns.is_object() || columns.empty()) {
    throw Error(
        source, "has no metrics.json with values per frame",
        "Give a folder that 'fit', 'offhand', 'refine' or 'reach' wrote, or measure the clip "
        "with 'holdfast score --json --per-frame'");
  }
  std::string table = "frame,time_s";
  for (const auto& [name, column] : columns.items()) {
    if (!column.is_array() || column.size() != static_cast<std::size_t>(frames)) {
      throw Error(
          source,
          fmt::format("has {} frames, but metrics.json has a different number of values for '{}'",
                      frames, name),
          "Create the result again");
    }
    table += "," + CsvCell(name);
  }
  table += '\n';
  for (int t = 0; t < count; ++t) {
    table += fmt::format("{},{:.6f}", t, t / frame_rate);
    for (const auto& column : columns) {
      table += "," + CsvCell(column[static_cast<std::size_t>(begin + t)]);
    }
    table += '\n';
  }
  return table;
}

namespace fs = std::filesystem;

constexpr const char* kGenerator = "Holdfast " HOLDFAST_VERSION;
constexpr double kLooseCorrectivesMm = 0.1;  // threshold for a note

struct ExportCommand {
  CommonOptions common;
  ClipInputOptions input;
  std::string clip;
  std::string output;
  std::string onto;
  bool no_object = false;
  int start = 0;
  std::optional<int> end;
  ExportOptions how;
};

// Whether the output is a table of the per-frame data in metrics.json.
bool IsMetrics(const fs::path& output) {
  return ExtensionOf(output) == ".csv" && output.stem().string().ends_with("metrics");
}

// Returns an empty string for a file name that `export` can write, or else an error text.
std::string FaultOfOutput(const std::string& output) {
  try {
    ExportFormatOf(output);
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

// Cuts the clip to the requested frames.
void Cut(Clip& clip, const ExportCommand& options) {
  const int end = options.end.value_or(clip.NumFrames());
  if (options.start >= end || end > clip.NumFrames()) {
    throw Error(options.clip,
                fmt::format("has frames 0 to {}, but frames {} to {} were requested",
                            clip.NumFrames() - 1, options.start, end - 1),
                "Give --start and --end within the clip (--end is exclusive)");
  }
  if (options.start > 0 || end < clip.NumFrames()) clip = Slice(clip, options.start, end);
}

// Appearance of the object in the clip of a glTF file.
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

// Returns the appearance of the object if known: from the clip file, from --object, or from the
// input of the command that wrote the result, unless that mesh has changed since.
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
      Note(
          options.common,
          fmt::format(
              "note: the object is exported without materials: {} {} (give the mesh with --object)",
              path.string(), look ? "is a different mesh now" : "no longer exists"));
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

// Reports format-specific results, as JSON and text.
void Tell(const ExportReport& report, const ExportCommand& options, nlohmann::json& summary,
          std::string& text) {
  const auto note = [&](const std::string& said) { Note(options.common, "note: " + said); };
  const SkinReport& skin = report.skin;
  const double error_mm = 1e3 * skin.corrective_error_m;
  switch (report.format) {
    case ExportFormat::kGlb:
    case ExportFormat::kUsda:
      if (!options.onto.empty()) {
        summary["skeleton"] = report.skeleton;
        summary["joints"] = report.joints_moved;
        text += fmt::format("  on the skeleton of {} ({}): {} of its {} joints\n", options.onto,
                            report.skeleton, report.joints_moved, report.joints);
        break;
      }
      summary["morph_targets"] = skin.morph_targets;
      summary["influences_per_vertex"] = skin.influences;
      summary["surface_error_mm"] = error_mm;
      text += fmt::format(
          "  skin of 55 joints, {} per vertex; {} morph targets; surface within {:.3f} "
          "mm of the body model\n",
          skin.influences, skin.morph_targets, error_mm);
      if (options.how.correctives &&
          error_mm > std::max(1e3 * options.how.tolerance_m, kLooseCorrectivesMm)) {
        note(
            fmt::format("with {} morph targets the file's surface is {:.2f} mm off the body "
                        "model's (export fewer frames with --start and --end)",
                        skin.morph_targets, error_mm));
      }
      break;
    case ExportFormat::kContacts:
    case ExportFormat::kContactsTable:
      summary["contact_points"] = report.contact_points;
      summary["frames_in_contact"] = report.contact_frames;
      text +=
          fmt::format("  {} contact points in {} frames; poses of {} wrists and their fingertips\n",
                      report.contact_points, report.contact_frames, report.contact_hands);
      break;
    case ExportFormat::kMeshes:
      summary["files"] = report.files.size();
      text += fmt::format("  {} files\n", report.files.size());
      break;
    case ExportFormat::kMjcf:
      if (report.mjcf.mass_of_hull || report.mjcf.mesh_is_hull) {
        note(
            fmt::format("the object is not a closed surface with outward faces: its mass is "
                        "computed from its convex pieces{}",
                        report.mjcf.mesh_is_hull ? ", and its convex hull is drawn" : ""));
      }
      summary["hand_pieces"] = report.mjcf.hand_pieces;
      summary["simulated_hands"] = report.mjcf.simulated_hands;
      summary["object_mass_kg"] = report.mjcf.object_mass_kg;
      text += fmt::format(
          "  {} hand pieces (mocap bodies), {} simulated{}; {} key frames; meshes in {}\n",
          report.mjcf.hand_pieces,
          report.mjcf.simulated_hands == 0   ? "no hand"
          : report.mjcf.simulated_hands == 1 ? "the hand that holds"
                                             : "both hands",
          report.has_object ? fmt::format(", object of {:.3g} kg", report.mjcf.object_mass_kg) : "",
          report.mjcf.key_frames, report.files.at(1).string());
      break;
    default:
      break;
  }
}

// Loads the requested clip, with its object if the format shows one.
ClipInput LoadScene(const ExportCommand& options, bool shows_object, bool needs_object) {
  const CommonOptions& common = options.common;
  ClipInput input = LoadClipInput(options.clip, options.input, common);
  if (options.no_object) input.clip.object.reset();
  if (!shows_object) return input;
  if (input.clip.object && !input.object && !needs_object) {
    Note(common, "note: only the body is exported: " + input.object_missing);
  }
  if (!input.clip.object && !options.input.object.empty() && !options.no_object) {
    throw Error(options.clip, "has no object trajectory for the mesh of --object",
                "Leave --object out, or fit the object first ('holdfast fit')");
  }
  return input;
}

// Writes metrics.csv from the metrics.json next to the clip.
void WriteMetrics(const ClipInput& input, const ExportCommand& options, int frames_of_clip) {
  WriteAtomically(options.output,
                  PerFrameCsv(input.metrics, options.clip, input.clip.frame_rate, frames_of_clip,
                              options.start, input.clip.NumFrames()));
}

int Run(const ExportCommand& options) {
  const CommonOptions& common = options.common;
  const bool is_metrics = IsMetrics(options.output);
  const ExportFormat format = ExportFormatOf(options.output);
  const bool is_contacts =
      format == ExportFormat::kContacts || (format == ExportFormat::kContactsTable && !is_metrics);
  ExportOptions how = options.how;
  if (how.every > 1 && !IsSampledByFrame(format)) {
    throw CLI::ValidationError("--every", "applies only to mesh sequences, .usda, .xml and .jsonl");
  }
  if (!options.onto.empty() && format != ExportFormat::kGlb) {
    throw CLI::ValidationError("--onto", "applies only to .glb");
  }
  if (format != ExportFormat::kMeshes) {  // before minutes of loading
    for (const fs::path& file : ExportedFiles({}, how, options.output)) {
      if (!is_metrics || file == options.output) RequireNewFolder(file, common);
    }
    RequireNew(options.output, common);
  }
  const bool shows_object =
      !is_metrics && format != ExportFormat::kBvh && format != ExportFormat::kClip;
  ClipInput input = LoadScene(options, shows_object, is_contacts);
  const int frames_of_clip = input.clip.NumFrames();
  Cut(input.clip, options);
  if (format == ExportFormat::kBvh && input.clip.object) {
    Note(common,
         "note: a .bvh file stores only the skeleton, so the object is not exported (.glb stores "
         "both)");
  }
  const bool with_object = shows_object && input.clip.object && input.object;
  std::optional<TexturedMesh> look;
  if (with_object && format == ExportFormat::kGlb) look = ObjectLook(input, *input.object, options);
  how.onto = options.onto;
  std::optional<MjcfPhysics> physics;
  if (format == ExportFormat::kMjcf && with_object) {
    TrialProtocol protocol;
    protocol.threads = NumThreads(common);
    try {
      physics = PhysicsOfClip(input, how.density_kg_m3, protocol);
    } catch (const Error& error) {  // if decomposition of the mesh fails
      Note(common, fmt::format("warning: the object is exported as its convex hull and the hands "
                               "as kinematic bodies: {} {} (a held object may fall)",
                               input.object_source, error.Problem()));
    }
  }
  how.physics = physics ? &*physics : nullptr;
  how.first_frame = options.start;
  how.object_look = look ? &*look : nullptr;
  if (options.no_object) input.clip.table.reset();
  how.name = ClipName(input);
  how.generator = kGenerator;
  how.threads = NumThreads(common);
  for (const fs::path& file : ExportedFiles(input, how, options.output)) {
    if (format == ExportFormat::kMeshes) RequireNew(file, common);
  }

  nlohmann::json summary = JsonHead("holdfast/export/1", common);
  summary["output"] = options.output;
  summary["format"] = ExtensionOf(options.output).substr(1);
  const std::size_t frames = EveryFrame(input.clip.NumFrames(), how.every).size();
  summary["frames"] = frames;
  summary["frame_rate"] = input.clip.frame_rate / how.every;
  summary["object"] = with_object || (format == ExportFormat::kClip && input.clip.object);
  std::string text =
      fmt::format("{}: {} frames at {:g} Hz{}\n", options.output, frames,
                  input.clip.frame_rate / how.every, with_object ? ", body and object" : "");
  if (is_metrics) {
    WriteMetrics(input, options, frames_of_clip);
  } else {
    StageProgress progress(common);
    const ExportReport report =
        ExportClip(input, how, options.output, [&](const char* stage, int done, int total) {
          progress.Update(stage, done, total);
          return !Interrupted();
        });
    if (report.stopped) return kInterrupted;
    Tell(report, options, summary, text);
  }
  PrintResult(common, summary, text);
  return kDone;
}

}  // namespace

void AddExportCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ExportCommand>();
  CLI::App* command = app.add_subcommand("export",
                                         "Export a clip for other programs: .glb .bvh .usda .xml "
                                         ".npz .jsonl .csv, or a mesh per frame");
  command->add_option("clip", options->clip, kClipHelp)->required();
  command
      ->add_option("-o,--output", options->output,
                   "File to write; the format follows from its extension (see below)")
      ->required()
      ->check(FaultOfOutput);
  AddClipInputOptions(*command, options->input);
  command->add_option(
      "--onto", options->onto,
      ".glb: animate the skeleton of this character (.glb, .gltf) and keep its skin");
  command->add_flag("--no-object", options->no_object, "Export only the body");
  AddOption(*command, "--start", options->start, "First frame to export, counted from 0",
            CLI::NonNegativeNumber);
  command->add_option("--end", options->end, "Frame to stop before; default: the clip's end")
      ->check(CLI::PositiveNumber);
  AddOptions(*command, OptionsOf(options->how));
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast export held -o held.glb\n"
      "  holdfast export held -o animated.glb --onto character.glb\n"
      "  holdfast export walk.npz -o walk_%04d.ply --every 5\n"
      "  holdfast export held -o scene.xml --density 600\n"
      "  holdfast export held -o metrics.csv\n"
      "Formats:\n"
      "  .glb   glTF 2.0, meters, y up: skinned body with pose correctives as morph targets,\n"
      "         the animated object with the materials and textures of its .obj, and the clip's "
      "table,\n"
      "         if any\n"
      "  .bvh   55 joints with the shaped body's offsets, centimeters, y up, Euler Z X Y\n"
      "  .usda  USD text, meters, z up: skinned body (UsdSkel) with pose correctives as blend "
      "shapes,\n"
      "         the transforms of object and table\n"
      "  .xml   MJCF for MuJoCo, meters, z up: the object as a free body of convex pieces, the\n"
      "         holding hand with joint springs that close it, as in score --physics; a floor; a "
      "key\n"
      "         frame for each frame (poses, mocap bodies, ctrl); meshes in scene_assets/\n"
      "  .npz   the clip itself (AMASS layout, z up), cut to --start and --end\n"
      "  .jsonl JSON lines for viewers such as rerun and viser: the first line has "
      "names and\n"
      "         meshes, each further line one frame: joint and object poses, contacts\n"
      "         (docs/formats.md)\n"
      "  contacts.npz, .csv  contact points, normals and depths in each frame, and poses of wrists "
      "and\n"
      "         fingertips (docs/formats.md); also any name that ends in contacts, such as "
      "x_contacts.npz\n"
      "  metrics.csv  per-frame measures of fit, offhand, refine and reach: the columns of "
      "per_frame in\n"
      "         metrics.json; also any name that ends in metrics, such as x_metrics.csv\n"
      "  .ply .obj  x_%04d.ply is the body in each frame (meters, z up, numbered from the clip's\n"
      "         first), x_object_%04d.ply the object\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
