// SPDX-License-Identifier: MIT
#include "apps/clip_input.h"

#include <vector>

#include <fmt/format.h>

#include "apps/clip_body.h"
#include "apps/read_json.h"
#include "geometry/error.h"
#include "geometry/io/mesh_io.h"

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

bool IsForeign(const ClipInput& input) {
  const std::string& made_with = input.clip.body_model;
  if (input.body->IsSubject()) return false;
  if (!made_with.empty()) return made_with != input.body->Name();
  if (input.body->Kind() == ModelKind::kSmplh) return input.clip.surface_model_type != "smplh";
  if (input.body->LoneHand()) return !IsHandAlone(input.clip);
  // Other programs' files are SMPL-X's; the embedded clips fit any body.
  return !input.file.empty() && !input.body->Name().starts_with("SMPLX_");
}

// Tries the places where the mesh of a clip's object may be.
void FindObject(ClipInput& input, const ClipInputOptions& options) {
  if (!options.object.empty()) {
    input.object = LoadObject(options.object, options.object_scale).mesh;
    input.object_source = options.object;
    return;
  }
  if (!input.clip.object) return;
  std::vector<std::string> candidates;
  if (!input.clip.object->mesh.empty()) {
    candidates.push_back((input.file.parent_path() / input.clip.object->mesh).string());
    candidates.push_back(input.clip.object->mesh);  // an embedded object's name
  }
  if (!input.clip.object->name.empty()) candidates.push_back(input.clip.object->name);
  for (const std::string& candidate : candidates) {
    try {
      input.object = LoadObject(candidate, options.object_scale).mesh;
      input.object_source = candidate;
      return;
    } catch (const Error& error) {
      if (input.object_missing.empty()) input.object_missing = error.what();
    }
  }
  if (input.object_missing.empty()) input.object_missing = "the clip names no mesh of its object";
}

// The mesh of what the object rests on: it is only looked at, so that its absence is no matter.
void FindTable(ClipInput& input) {
  if (!input.clip.table || input.clip.table->mesh.empty()) return;
  const fs::path path = input.file.parent_path() / input.clip.table->mesh;
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored)) input.table = ReadMesh(path);
}

}  // namespace

ClipInput LoadClipInput(const std::string& path_or_name, const ClipInputOptions& options,
                        const CommonOptions& common) {
  ClipInput input;
  input.source = path_or_name;
  if (fs::is_directory(path_or_name)) {
    input.file = fs::path(path_or_name) / "clip.npz";
    if (!fs::exists(input.file)) {
      throw Error(path_or_name, "is a folder without a clip.npz",
                  "Give a clip (.npz), or a folder that 'holdfast fit' wrote");
    }
    input.clip = ReadClip(input.file);
  } else {
    if (fs::exists(path_or_name)) input.file = path_or_name;
    input.clip = LoadClip(path_or_name);
  }
  ClipBody body =
      BodyOfClip(path_or_name, input.clip,
                 options.loaded_body ? options.loaded_body : LoadBody(options.body), common);
  input.body = std::move(body.model);
  input.betas = std::move(body.betas);
  input.foreign_body = IsForeign(input);
  if (!input.file.empty()) input.metrics = MetricsBeside(input.file);
  FindObject(input, options);
  FindTable(input);
  return input;
}

void AddClipInputOptions(CLI::App& command, ClipInputOptions& options) {
  command.add_option("--object", options.object,
                     "Mesh or embedded object in place of the one the clip names");
  command
      .add_option("--object-scale", options.object_scale,
                  "Multiplies the object's coordinates (0.001 for millimetres)")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  command.add_option("--body", options.body,
                     "Body model in place of the embedded one: SMPL-X, SMPL-H or MANO, .npz or "
                     ".pkl");
}

}  // namespace holdfast::apps
