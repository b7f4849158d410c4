// SPDX-License-Identifier: MIT
#include "apps/clip_input.h"

#include <vector>

#include <fmt/format.h>

#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/import/held_distance.h"
#include "geometry/io/container/read_json.h"
#include "geometry/io/mesh/mesh_io.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

// The metrics.json beside a clip that a command of ours wrote; null when there is none.
nlohmann::json MetricsBeside(const fs::path& clip) {
  const fs::path path = clip.parent_path() / "metrics.json";
  std::error_code ignored;
  if (clip.filename() != "clip.npz" || !fs::is_regular_file(path, ignored)) return nullptr;
  nlohmann::json metrics = ReadJson(path);
  if (!metrics.is_object()) {
    throw Error(path.string(), "is not the JSON of a result", "Remove it, or make it anew");
  }
  return metrics;
}

bool IsForeign(const LoadedClip& loaded) {
  const BodyModel& body = *loaded.body.model;
  const std::string& made_with = loaded.clip.body_model;
  const bool embedded = loaded.file.empty() && !loaded.imported;  // those fit any body
  if (body.IsSubject() || embedded) return false;
  if (loaded.change) return true;
  if (!made_with.empty()) return made_with != body.Name();
  if (body.Kind() == ModelKind::kSmplh) return loaded.clip.surface_model_type != "smplh";
  if (body.LoneHand()) return !IsHandAlone(loaded.clip);
  // Other programs' files are SMPL-X's.
  return !body.Name().starts_with("SMPLX_");
}

// A fitted clip keeps the betas of the motion it came from, whose body it may not have been fitted
// with: the metrics.json beside it says which one that was.
bool IsFittedWith(const BodyModel& body, const nlohmann::json& metrics) {
  if (!metrics.is_object() || !metrics.contains("options")) return false;
  const nlohmann::json& options = metrics["options"];
  if (!options.is_object() || !options.contains("body") || !options["body"].is_string()) {
    return false;
  }
  const fs::path fitted_with = options["body"].get<std::string>();
  return fitted_with.filename() == body.Name() || fitted_with.stem() == body.Name() ||
         fitted_with.stem() == fs::path(body.Name()).stem();
}

// Tries the places where the mesh of a clip's object may be.
void FindObject(ClipInput& input, const LoadedClip& loaded, const ClipInputOptions& options) {
  input.object_scale = options.object_scale;
  if (!options.object.empty()) {
    input.object = LoadObject(options.object, options.object_scale).mesh;
    input.object_source = options.object;
    return;
  }
  if (!input.clip.object) return;
  const ObjectTrack& track = *input.clip.object;
  if (loaded.object_surface) {
    input.object = *loaded.object_surface;
    input.object->vertices *= options.object_scale;
    input.object_source = input.source;
    input.object_in_clip = true;
    input.object_look = loaded.object_look;
    if (input.object_look) {
      Transform(options.object_scale * Eigen::Matrix3d::Identity(), *input.object_look);
    }
    return;
  }
  std::vector<std::pair<std::string, double>> candidates;
  if (!loaded.object_mesh.empty()) {
    candidates.emplace_back(loaded.object_mesh.string(), loaded.object_mesh_scale);
  } else if (!track.mesh.empty()) {
    candidates.emplace_back((input.file.parent_path() / track.mesh).string(), 1.0);
    candidates.emplace_back(track.mesh, 1.0);  // an embedded object's name
  }
  if (!track.name.empty()) candidates.emplace_back(track.name, 1.0);
  for (const auto& [candidate, scale] : candidates) {
    try {
      input.object_scale = options.object_scale * scale;
      input.object = LoadObject(candidate, input.object_scale).mesh;
      input.object_source = candidate;
      return;
    } catch (const Error& error) {
      if (input.object_missing.empty()) input.object_missing = error.what();
    }
  }
  if (input.object_missing.empty()) input.object_missing = "the clip names no mesh of its object";
}

}  // namespace

LoadedClip LoadClip(const std::string& path_or_name, std::shared_ptr<const BodyModel> body,
                    const CommonOptions& common, ImportFileOptions import) {
  import.parameters.body = std::move(body);
  LoadedClip loaded = LoadClip(path_or_name, std::move(import));
  for (const std::string& note : loaded.notes) Note(common, "note: " + note);
  return loaded;
}

void WarnIfAway(const std::string& source, const Clip& clip, const ClipBody& body,
                const TriangleMesh& object, const CommonOptions& common) {
  if (const auto warning = WarnOfHeldDistance(clip, body, object)) {
    Note(common, fmt::format("warning: {}: {}: {}", source, warning->seen, warning->advice));
  }
}

std::optional<TriangleMesh> MeshNamedBy(const Clip& clip, const fs::path& source) {
  if (!clip.object || clip.object->mesh.empty()) return std::nullopt;
  const fs::path folder = fs::is_directory(source) ? source : source.parent_path();
  for (const std::string& place : {(folder / clip.object->mesh).string(), clip.object->mesh}) {
    try {
      return LoadObject(place).mesh;
    } catch (const Error&) {
    }
  }
  return std::nullopt;
}

ClipInput LoadClipInput(const std::string& path_or_name, const ClipInputOptions& options,
                        const CommonOptions& common) {
  LoadedClip loaded = LoadClip(
      path_or_name, options.loaded_body ? options.loaded_body : LoadBody(options.body), common);
  ClipInput input;
  input.source = path_or_name;
  input.file = loaded.file;
  input.clip = loaded.clip;
  input.body = loaded.body.model;
  input.betas = loaded.body.betas;
  input.made_with = loaded.change                    ? loaded.change->from
                    : loaded.clip.body_model.empty() ? "SMPL-X"
                                                     : loaded.clip.body_model;
  if (!input.file.empty()) input.metrics = MetricsBeside(input.file);
  input.foreign_body = IsForeign(loaded) && !IsFittedWith(*input.body, input.metrics);
  FindObject(input, loaded, options);
  // It is only looked at, so that its absence is no matter.
  if (!loaded.table_mesh.empty()) input.table = ReadMesh(loaded.table_mesh);
  if (input.object && (input.foreign_body || input.metrics.is_null())) {
    WarnIfAway(path_or_name, input.clip, loaded.body, *input.object, common);
  }
  return input;
}

void AddClipInputOptions(CLI::App& command, ClipInputOptions& options) {
  command.add_option("--object", options.object,
                     "Mesh or embedded object in place of the one the clip names");
  AddOption(command, "--object-scale", options.object_scale,
            "Multiplies the object's coordinates (0.001 for millimetres)", CLI::PositiveNumber);
  command.add_option("--body", options.body,
                     "Body model in place of the embedded one: SMPL-X, SMPL-H or MANO, .npz or "
                     ".pkl");
}

}  // namespace holdfast::apps
