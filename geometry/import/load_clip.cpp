// SPDX-License-Identifier: MIT
#include "geometry/import/load_clip.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/clip_body.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/import/amass.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/object/load_object.h"
#include "geometry/rotation.h"
#include "geometry/suggestion.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// Of the distance from hand to object.
constexpr std::size_t kSamples = 40;
constexpr double kAwayMm = 10.0;

// Whether a file is a clip already: it has only arrays that WriteClip writes, or some that only
// Holdfast's clips have.
bool IsClipFile(const fs::path& path) {
  try {
    const NpzReader archive(path);
    const std::vector<std::string> names = archive.Keys();
    if (!IsHoldfastClip(names) && !HasOnlyClipArrays(names)) return false;
    return !NeedsImport(archive);
  } catch (const Error&) {
    return false;  // ImportFile reports the fault
  }
}

LoadedClip LoadEmbedded(const std::string& name) {
  const std::vector<std::string> names = EmbeddedNames("clips", ".npz");
  if (HasEmbedded(fmt::format("objects/{}.ply", name))) {
    throw Error(name, "is an embedded object, not a clip",
                fmt::format("Give the clip first: one of {}, or a file", fmt::join(names, ", ")));
  }
  if (std::ranges::find(names, name) == names.end()) {
    throw Error(
        name, "is neither a file nor an embedded clip",
        Suggestion(name, names) +
            fmt::format("Give a clip (.npz), a result folder, a file that 'holdfast import' "
                        "reads, or one of: {}",
                        fmt::join(names, ", ")));
  }
  LoadedClip loaded;
  loaded.clip = ReadClip(NpzReader(FindEmbedded(fmt::format("clips/{}.npz", name)).bytes, name));
  return loaded;
}

LoadedClip ReadFile(const fs::path& path, const ImportFileOptions& options) {
  LoadedClip loaded;
  std::error_code error;
  const bool folder = fs::is_directory(path, error);
  const bool result = folder && fs::exists(path / "clip.npz", error);
  if (result || (!folder && IsClipFile(path))) {
    loaded.file = result ? path / "clip.npz" : path;
    loaded.clip = ReadClip(loaded.file);
    if (std::string note = WrapJointAngles(loaded.clip); !note.empty()) {
      loaded.notes.push_back(std::move(note));
    }
    loaded.object_mesh = MeshBeside(loaded.file, loaded.clip.object);
    loaded.table_mesh = MeshBeside(loaded.file, loaded.clip.table);
    if (const auto note = OldPelvisNote(NpzReader(loaded.file))) {
      loaded.notes.push_back(fmt::format("{}: {}", path.string(), *note));
    }
    return loaded;
  }
  static_cast<ImportedFile&>(loaded) = ImportFile(path, options);
  loaded.imported = true;
  // The name that a clip file would store.
  if (loaded.clip.object && !loaded.object_mesh.empty() && loaded.object_mesh_scale == 1) {
    loaded.clip.object->mesh = fs::absolute(loaded.object_mesh, error).string();
  }
  loaded.notes.insert(
      loaded.notes.begin(),
      fmt::format("{}: {}, imported automatically (for options, use 'holdfast import')",
                  path.string(), loaded.format));
  return loaded;
}

// Reads the mesh file that a clip names. A substitute would be another object.
TriangleMesh ReadNamedMesh(const fs::path& clip, const std::string& path, double scale) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    throw Error(path, "is missing: the clip names it as its object's mesh", kMeshRemedy);
  }
  MeshFile file;
  try {
    file = ReadMeshFile(path);
  } catch (const Error& error) {
    throw Error(error.Where(), error.Problem(), fmt::format("{}. {}", error.Remedy(), kMeshRemedy));
  }
  RequireMeshOf(clip, file.mesh, path);
  return ObjectOfMesh(file.mesh, fs::path(path).stem().string(), path, scale).mesh;
}

}  // namespace

LoadedClip LoadClip(const std::string& path_or_name, ImportFileOptions options) {
  ParameterOptions& parameters = options.parameters;
  if (!parameters.body) parameters.body = BodyModel::Default();
  if (const std::optional<Side> hand = parameters.body->LoneHand();
      hand && parameters.hands == ImportedHands::kOfBody) {
    parameters.hands =
        *hand == Side::kRight ? ImportedHands::kRightAlone : ImportedHands::kLeftAlone;
  }
  std::error_code error;
  LoadedClip loaded = fs::exists(path_or_name, error) ? ReadFile(path_or_name, options)
                                                      : LoadEmbedded(path_or_name);
  if (!loaded.table_mesh.empty()) {
    loaded.clip.table->surface = std::make_shared<const TriangleMesh>(ReadMesh(loaded.table_mesh));
  }
  loaded.body = BodyOfClip(path_or_name, loaded.clip, parameters.body, loaded.notes);
  loaded.change = BringOntoBody(loaded.clip, loaded.body);
  if (loaded.change) {
    loaded.notes.push_back(
        fmt::format("{}: {}", path_or_name, Describe(*loaded.change, *loaded.body.model)));
  }
  return loaded;
}

ClipObject FindClipObject(const LoadedClip& loaded, double scale) {
  ClipObject found;
  found.scale = scale;
  if (!loaded.clip.object) return found;
  const ObjectTrack& track = *loaded.clip.object;
  const TriangleMesh* const own = track.surface           ? track.surface.get()
                                  : loaded.object_surface ? &*loaded.object_surface
                                                          : nullptr;
  if (own != nullptr) {
    found.mesh = *own;
    found.mesh->vertices *= scale;
    found.in_clip = true;
    return found;
  }
  // A clip without a file cannot name a mesh relative to it.
  const bool names_file =
      HasMeshFormat(track.mesh) && (!loaded.file.empty() || fs::path(track.mesh).is_absolute());
  if (names_file || !loaded.object_mesh.empty()) {
    found.source = loaded.object_mesh.empty() ? (loaded.file.parent_path() / track.mesh).string()
                                              : loaded.object_mesh.string();
    found.scale = scale * loaded.object_mesh_scale;
    // A result is written with its mesh; other clips may have been copied without theirs.
    std::error_code ignored;
    if (!fs::exists(found.source, ignored) && !loaded.file.empty() &&
        !fs::exists(loaded.file.parent_path() / "metrics.json", ignored) &&
        MeshChecksumIn(loaded.file).empty()) {
      found.missing = fmt::format("{} does not exist", found.source);
      return found;
    }
    found.mesh = ReadNamedMesh(loaded.file, found.source, found.scale);
    return found;
  }
  for (const std::string& name : {track.mesh, track.name}) {
    if (name.empty()) continue;
    try {
      found.mesh = LoadObject(name, scale).mesh;
      found.source = name;
      found.by_name = name != track.mesh;
      const std::string& made_with = loaded.change ? loaded.change->from : loaded.clip.body_model;
      if (found.by_name && made_with != BodyModel::kDefaultName) {
        found.warning = fmt::format(
            "the mesh of its object was not found: Holdfast's own '{}' is used instead, which has "
            "another shape (give the clip's mesh as the object)",
            name);
      }
      found.missing.clear();
      return found;
    } catch (const Error& error) {
      if (found.missing.empty()) found.missing = error.what();
    }
  }
  if (found.missing.empty()) found.missing = "the clip does not name the mesh of its object";
  return found;
}

std::optional<double> MeasureHeldDistance(const Clip& clip, const ClipBody& body,
                                          const TriangleMesh& object) {
  if (!clip.object || object.NumFaces() == 0) return std::nullopt;
  const std::vector<std::uint8_t>& holding = clip.holding_hand;
  std::vector<int> held;
  for (std::size_t t = 0; t < holding.size(); ++t) {
    if (holding[t] != 0) held.push_back(static_cast<int>(t));
  }
  if (held.empty()) return std::nullopt;
  const SignedDistance surface(object);
  std::vector<double> nearest(std::min(kSamples, held.size()),
                              std::numeric_limits<double>::infinity());
  for (const Side side : {Side::kRight, Side::kLeft}) {
    if (!body.model->HasHand(side)) continue;
    const HandModel hand(body.model, body.betas, side);
    HandState state(hand);
    for (std::size_t k = 0; k < nearest.size(); ++k) {
      const int t = held[k * held.size() / nearest.size()];
      const auto frame = static_cast<std::size_t>(t);
      if ((holding[frame] & (side == Side::kRight ? kHoldsRight : kHoldsLeft)) == 0) continue;
      state.SetBody(clip.pose[frame], clip.trans.col(t));
      state.Evaluate(FingersOf(clip.pose[frame], side), false);
      const Eigen::Matrix3d rotation = ExpSO3(clip.object->orient.col(t));
      const Eigen::Matrix3Xd in_object =
          rotation.transpose() * (state.Vertices().colwise() - clip.object->trans.col(t));
      nearest[k] = std::min(nearest[k], std::max(0.0, surface.Distances(in_object).minCoeff()));
    }
  }
  const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
  std::ranges::nth_element(nearest, middle);
  return std::isfinite(*middle) ? std::optional(1e3 * *middle) : std::nullopt;
}

std::optional<std::string> WarnOfHeldDistance(const Clip& clip, const ClipBody& body,
                                              const TriangleMesh& object) {
  const std::optional<double> median_mm = MeasureHeldDistance(clip, body, object);
  if (!median_mm || *median_mm <= kAwayMm) return std::nullopt;
  return fmt::format(
      "the clip says that a hand holds the object in {} of {} frames, but the hand of {} is {:.0f} "
      "mm from it (median)",
      clip.holding_hand.size() - std::ranges::count(clip.holding_hand, 0), clip.NumFrames(),
      body.model->Name(), *median_mm);
}

std::pair<std::string, std::optional<std::string>> NotesOnBody(
    const Clip& clip, const std::shared_ptr<const BodyModel>& model, const TriangleMesh* object) {
  std::pair<std::string, std::optional<std::string>> notes;
  if (IsHandAlone(clip) != model->LoneHand().has_value()) return notes;
  Clip moved = clip;
  std::vector<std::string> ignored;
  const ClipBody body = BodyOfClip("", moved, model, ignored);
  const std::optional<BodyChange> change = BringOntoBody(moved, body);
  if (change) notes.first = Describe(*change, *body.model);
  if (object != nullptr) notes.second = WarnOfHeldDistance(moved, body, *object);
  return notes;
}

}  // namespace holdfast
