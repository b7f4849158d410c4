// SPDX-License-Identifier: MIT
#include "apps/clip_input.h"

#include <vector>

#include <fmt/format.h>

#include "generator/wandr/network.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/io/mesh/mesh_io.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

bool IsForeign(const LoadedClip& loaded) {
  const BodyModel& body = *loaded.body.model;
  const std::string& made_with = loaded.clip.body_model;
  const bool embedded = loaded.file.empty() && !loaded.imported;  // fits any body
  if (body.IsSubject() || embedded) return false;
  if (loaded.change) return true;
  if (!made_with.empty()) return made_with != body.Name();
  if (body.Kind() == ModelKind::kSmplh) return loaded.clip.surface_model_type != "smplh";
  if (body.LoneHand()) return !IsHandAlone(loaded.clip);
  // Files of other programs are for SMPL-X.
  return !body.Name().starts_with("SMPLX_");
}

// A fitted clip keeps the betas of its input motion, but may have been fitted with another body.
// The metrics.json next to it records that body.
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

// Uses the given mesh, or else the clip's own.
void FindObject(ClipInput& input, const LoadedClip& loaded, const ClipInputOptions& options,
                const CommonOptions& common) {
  input.object_scale = options.object_scale;
  const bool told = !options.object.empty();
  ClipObject own;
  try {
    own = FindClipObject(loaded, told ? 1.0 : options.object_scale);
  } catch (const Error&) {
    if (!told) throw;
  }
  if (told) {
    if (!own.by_name) input.own_object = std::move(own.mesh);
    input.object = LoadObject(options.object, options.object_scale).mesh;
    input.object_source = options.object;
    return;
  }
  if (!own.warning.empty()) {
    Note(common, fmt::format("warning: {}: {}", input.source, own.warning));
  }
  input.object = std::move(own.mesh);
  input.object_source = own.in_clip ? input.source : own.source;
  input.object_in_clip = own.in_clip;
  input.object_scale = own.scale;
  input.object_missing = own.missing;
  if (own.in_clip) input.object_look = loaded.object_look;
  if (input.object_look) {
    Transform(options.object_scale * Eigen::Matrix3d::Identity(), *input.object_look);
  }
}

}  // namespace

LoadedClip LoadClip(const std::string& path_or_name, std::shared_ptr<const BodyModel> body,
                    const CommonOptions& common, ImportFileOptions import) {
  import.parameters.body = std::move(body);
  LoadedClip loaded = LoadClip(path_or_name, std::move(import));
  for (const std::string& note : loaded.notes) Note(common, "note: " + note);
  const Clip& clip = loaded.clip;
  Detail(common, "loaded",
         fmt::format("loaded {}: {} frames at {:g} Hz, body {}{}", path_or_name, clip.NumFrames(),
                     clip.frame_rate, loaded.body.model->Name(),
                     clip.object ? ", object " + clip.object->name : ""),
         {{"file", path_or_name},
          {"frames", clip.NumFrames()},
          {"frame_rate", clip.frame_rate},
          {"body", loaded.body.model->Name()},
          {"object", clip.object ? clip.object->name : ""}});
  return loaded;
}

void WarnIfAway(const std::string& source, const Clip& clip, const ClipBody& body,
                const TriangleMesh& object, const CommonOptions& common) {
  if (const auto warning = WarnOfHeldDistance(clip, body, object)) {
    Note(common, fmt::format("warning: {}: {}: {}", source, *warning, kHeldRemedy));
  }
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
  FindObject(input, loaded, options, common);
  if (input.object && (input.foreign_body || input.metrics.is_null())) {
    WarnIfAway(path_or_name, input.clip, loaded.body, *input.object, common);
  }
  return input;
}

void AddClipInputOptions(CLI::App& command, ClipInputOptions& options) {
  command.add_option("--object", options.object, "Mesh or embedded object in place of the clip's");
  AddOption(command, "--object-scale", options.object_scale,
            "Multiplies the object's coordinates (0.001 for millimeters)", CLI::PositiveNumber);
  command.add_option("--body", options.body,
                     "Body model in place of the embedded one: SMPL-X, SMPL-H or MANO, .npz or "
                     ".pkl");
}

namespace {

const char* LayoutName(wandr::IntentionLayout layout) {
  switch (layout) {
    case wandr::IntentionLayout::kPaper:
      return "paper";
    case wandr::IntentionLayout::kFlagged:
      return "flagged";
    case wandr::IntentionLayout::kBounded:
      return "bounded";
  }
  return "";
}

}  // namespace

ReachNetwork LoadReachNetwork(const std::string& path, const CommonOptions& common) {
  ReachNetwork network = holdfast::LoadReachNetwork(path);
  WarnOfOldPelvis(path, network.weights.notes, common);
  return network;
}

nlohmann::json NetworkJson(const ReachNetwork& network) {
  return {{"weights", network.source},
          {"checksum", network.checksum},
          {"intention", LayoutName(network.weights.layout)},
          {"notes", network.weights.notes}};
}

void AddWeightsOption(CLI::App& command, std::string& path) {
  const bool embedded = wandr::HasDefaultNetwork();
  command
      .add_option("--weights", path,
                  embedded ? "Network (.safetensors) in place of the embedded one"
                           : "Network (.safetensors); this program was built without one")
      ->required(!embedded);
}

}  // namespace holdfast::apps
