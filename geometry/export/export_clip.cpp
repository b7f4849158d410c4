// SPDX-License-Identifier: MIT
#include "geometry/export/export_clip.h"

#include <cctype>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/import/import_motion.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/gltf/gltf_onto.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/io/motion/bvh.h"
#include "geometry/parallel.h"
#include "geometry/retarget/retarget_onto.h"
#include "geometry/score/contact_score.h"
#include "geometry/score/contact_writer.h"
#include "geometry/suggestion.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// Writes one scene to files in one format.
class Exporter {
 public:
  Exporter(const ClipScene& scene, const ExportOptions& options, const fs::path& output,
           const StagedProgress& progress)
      : scene_(scene),
        options_(options),
        output_(output),
        progress_(progress),
        object_(scene.clip.object && scene.object ? &*scene.object : nullptr) {
    report_.format = ExportFormatOf(output);
    report_.has_object = object_ != nullptr;
    report_.files = ExportedFiles(scene, options, output);
  }

  ExportReport Run() {
    Check();
    switch (report_.format) {
      case ExportFormat::kGlb:
        options_.onto.empty() ? WriteGlbFile() : WriteOnto();
        break;
      case ExportFormat::kBvh:
        report_.has_object = false;
        WriteBvh(scene_.clip, scene_.Surface(), output_);
        break;
      case ExportFormat::kUsda:
        report_.skin = WriteUsda(scene_.clip, scene_.Surface(), object_, options_, output_);
        break;
      case ExportFormat::kLines:
        WriteSceneLines(scene_, object_, options_, output_);
        break;
      case ExportFormat::kMjcf:
        WriteMjcfFile();
        break;
      case ExportFormat::kClip:
        report_.has_object = scene_.clip.object.has_value();
        WriteClipFile();
        break;
      case ExportFormat::kContacts:
      case ExportFormat::kContactsTable:
        WriteContacts();
        break;
      case ExportFormat::kMeshes:
        WriteMeshes();
        break;
    }
    return report_;
  }

 private:
  void Check() const {
    if (options_.every > 1 && !IsSampledByFrame(report_.format)) {
      throw Error(output_.string(), "always contains every frame of the clip",
                  "Omit 'every': it applies only to mesh sequences, .usda, .xml and .jsonl");
    }
    if (!options_.onto.empty() && report_.format != ExportFormat::kGlb) {
      throw Error(output_.string(), "cannot hold a character", "Give a name that ends in .glb");
    }
  }

  // The object's mesh file is referenced, not copied.
  void WriteClipFile() {
    Clip clip = scene_.clip;
    std::error_code ignored;
    if (clip.object && HasMeshFormat(scene_.object_source)) {
      const fs::path mesh =
          fs::relative(scene_.object_source, fs::absolute(output_).parent_path(), ignored);
      if (!mesh.empty()) clip.object->mesh = mesh.generic_string();
    }
    WriteClip(clip, output_);
  }

  void WriteGlbFile() {
    GlbOptions glb;
    glb.generator = options_.generator;
    glb.clip_name = options_.name;
    glb.correctives = options_.correctives;
    glb.corrective_tolerance_m = options_.tolerance_m;
    glb.threads = options_.threads;
    glb.object_look = object_ != nullptr ? options_.object_look : nullptr;
    report_.skin = WriteGlb(scene_.clip, scene_.Surface(), object_, glb, output_);
  }

  // Puts the motion on the skeleton of a character, which keeps its skin.
  void WriteOnto() {
    if (scene_.body->LoneHand()) {
      throw Error(scene_.source,
                  "is a motion of a hand alone, which cannot be transferred to a character",
                  "Export it without --onto");
    }
    const std::string character = options_.onto.string();
    if (!LooksLikeGltf(ReadGzipHead(options_.onto, 4096))) {
      throw Error(character, ExtensionOf(options_.onto) == ".fbx" ? kFbxProblem : "is not glTF",
                  "Give --onto a character as .glb or .gltf");
    }
    const GltfAsset asset = GltfAsset::Read(options_.onto);
    const GltfRig rig = ReadGltfRig(asset);
    const SkeletonMap map = RecognizeSkeleton(rig.motion, character);
    const SourceMotion motion =
        RetargetOnto(scene_.clip, RetargetBodyOf(*scene_.body, scene_.betas), rig.motion, map);
    std::optional<TexturedMesh> plain;
    if (object_ != nullptr) plain = PlainMesh(*object_, ObjectMaterial());
    const TexturedMesh* look = plain ? &*plain : nullptr;
    if (plain && options_.object_look != nullptr) look = options_.object_look;
    WriteGltfOnto(options_.onto, asset, rig, motion, map.source[0], look, options_.name,
                  options_.generator, output_);
    report_.skeleton = map.name;
    report_.joints = rig.motion.NumJoints();
    report_.joints_moved = map.NumMapped();
  }

  void WriteMjcfFile() {
    MjcfOptions mjcf;
    mjcf.generator = options_.generator;
    mjcf.model_name = options_.name;
    mjcf.every = options_.every;
    mjcf.density_kg_m3 = options_.density_kg_m3.value_or(mjcf.density_kg_m3);
    mjcf.physics = options_.physics;
    report_.mjcf = WriteMjcf(scene_.clip, scene_.Surface(), object_, mjcf, output_);
  }

  void WriteContacts() {
    if (object_ == nullptr) {
      throw Error(scene_.source,
                  scene_.clip.object ? "the mesh of its object is missing: " + scene_.object_missing
                                     : "has no object to touch",
                  scene_.clip.object ? "Give it with --object" : "Fit one first ('holdfast fit')");
    }
    const ClipContactPoints contacts =
        FindContactPoints(scene_.clip, scene_.body, scene_.betas, SignedDistance(*object_),
                          1e-3 * ContactProtocol().contact_threshold_mm, options_.threads);
    if (report_.format == ExportFormat::kContactsTable) {
      WriteContactsCsv(contacts, output_, report_.files.at(1));
    } else {
      WriteContactsNpz(contacts, output_);
    }
    std::set<int> touching;
    for (const ContactPoint& point : contacts.points) touching.insert(point.frame);
    report_.contact_points = static_cast<int>(contacts.points.size());
    report_.contact_frames = static_cast<int>(touching.size());
    report_.contact_hands = static_cast<int>(contacts.hands.size());
  }

  // Writes the body in each frame, and the object under a name with "object_" in it.
  void WriteMeshes() {
    const Clip& clip = scene_.clip;
    const std::vector<int> frames = EveryFrame(clip.NumFrames(), options_.every);
    const BodySurface surface = scene_.Surface();
    std::mutex lock;
    int finished = 0;
    ParallelFor(static_cast<int>(frames.size()), options_.threads, [&](int k) {
      {
        const std::scoped_lock guard(lock);
        if (report_.stopped) return;
      }
      const int t = frames[k];
      BodyState state;
      Forward(surface, clip.pose[t], clip.trans.col(t), state);
      WriteMesh({state.vertices, surface.Faces()}, report_.files[k]);
      if (object_ != nullptr) {
        TriangleMesh placed = *object_;
        placed.vertices = clip.object->Pose(t) * object_->vertices;
        WriteMesh(placed, report_.files[frames.size() + k]);
      }
      const std::scoped_lock guard(lock);
      const int total = static_cast<int>(frames.size());
      if (progress_ && !progress_("export", ++finished, total)) report_.stopped = true;
    });
  }

  const ClipScene& scene_;
  const ExportOptions& options_;
  const fs::path& output_;
  const StagedProgress& progress_;
  const TriangleMesh* object_;
  ExportReport report_;
};

}  // namespace

std::string ExtensionOf(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

ExportFormat ExportFormatOf(const fs::path& output) {
  const std::string extension = ExtensionOf(output);
  const std::string name = output.string();
  if (extension == ".ply" || extension == ".obj") {
    try {
      if (ParseNumberedName(name)) return ExportFormat::kMeshes;
    } catch (const Error&) {
      // Reported below, with a message specific to meshes.
    }
    throw Error(name, "has no placeholder for the frame number",
                fmt::format("Write it like name_%04d{}", extension));
  }
  const bool contacts = output.stem().string().ends_with("contacts");
  std::optional<ExportFormat> format;
  if (extension == ".glb") format = ExportFormat::kGlb;
  if (extension == ".bvh") format = ExportFormat::kBvh;
  if (extension == ".usda") format = ExportFormat::kUsda;
  if (extension == ".jsonl") format = ExportFormat::kLines;
  if (extension == ".xml") format = ExportFormat::kMjcf;
  if (extension == ".npz") format = contacts ? ExportFormat::kContacts : ExportFormat::kClip;
  if (extension == ".csv") format = ExportFormat::kContactsTable;
  if (!format) {
    throw Error(name, extension == ".fbx" ? kFbxProblem : "is not a format to export",
                "Use .glb .bvh .usda .xml .npz .jsonl, contacts.npz / .csv, metrics.csv, or "
                "name_%04d.ply / name_%04d.obj for one mesh per frame");
  }
  if (name.find('%') != std::string::npos) {
    throw Error(name, fmt::format("{} holds the whole clip", extension), "Leave the % out");
  }
  return *format;
}

bool IsSampledByFrame(ExportFormat format) {
  return format == ExportFormat::kMeshes || format == ExportFormat::kUsda ||
         format == ExportFormat::kMjcf || format == ExportFormat::kLines;
}

std::vector<fs::path> ExportedFiles(const ClipScene& scene, const ExportOptions& options,
                                    const fs::path& output) {
  const ExportFormat format = ExportFormatOf(output);
  if (format == ExportFormat::kMjcf) return {output, MjcfAssets(output)};
  if (format == ExportFormat::kContactsTable) {
    return {output, output.parent_path() / (output.stem().string() + "_poses.csv")};
  }
  if (format != ExportFormat::kMeshes) return {output};
  NumberedName name = *ParseNumberedName(output.string());
  std::vector<fs::path> files;
  for (int kind = 0; kind < (scene.clip.object && scene.object ? 2 : 1); ++kind) {
    for (const int t : EveryFrame(scene.clip.NumFrames(), options.every)) {
      files.push_back(name.Name(options.first_frame + t));
    }
    name.before += "object_";
  }
  return files;
}

OptionTable OptionsOf(ExportOptions& options) {
  OptionTable table;
  table.Flag("correctives", options.correctives,
             "Write pose correctives as morph targets (.glb, .usda). Without them, the file is "
             "smaller, but the skin is off by centimeters at bent joints");
  table.Number("tolerance", "mm", ScaledNumber{&options.tolerance_m, 1e-3}, {1e-3, 100.0},
               ".glb, .usda: maximum distance of the skin from the body model's surface, mm");
  table.Number("density", "", options.density_kg_m3, {1.0, 30'000.0},
               "from the mass that score --physics uses",
               ".xml: density of the object, kg/m3 (water: 1000)");
  table.Number("every", "", options.every, {.low = 1.0},
               "Write every n-th frame (mesh sequences, .usda, .xml, .jsonl)");
  return table;
}

ExportReport ExportClip(const ClipScene& scene, const ExportOptions& options,
                        const fs::path& output, const StagedProgress& progress) {
  return Exporter(scene, options, output, progress).Run();
}

}  // namespace holdfast
