// SPDX-License-Identifier: MIT
#include "geometry/import/data_set_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/import/joint_fields.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/io/mesh/mesh_io.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxFoldersUp = 6;
constexpr std::size_t kMaxFilesBeside = 100'000;
constexpr std::uintmax_t kMaxObjectFile = std::uintmax_t{256} << 20;

constexpr std::array<std::string_view, 12> kObjectTurns = {
    "angles",        "angle",      "rot",           "rotation",   "orient",  "global_orient",
    "object_orient", "obj_orient", "object_angles", "obj_angles", "obj_rot", "object_rot"};
constexpr std::array<std::string_view, 8> kObjectPlaces = {
    "trans",     "transl",     "translation",   "object_trans",
    "obj_trans", "obj_transl", "object_transl", "obj_translation"};
constexpr std::array<std::string_view, 4> kObjectNames = {"name", "obj_name", "object_name",
                                                          "object"};
constexpr std::array<std::string_view, 6> kBodyPoses = {"poses",     "pose",     "body_pose",
                                                        "pose_body", "fullpose", "hand_pose"};
constexpr std::array<std::string_view, 6> kDataExtensions = {".npz",  ".pkl", ".npy",
                                                             ".json", ".pt",  ".pth"};

std::string Lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

bool HasDataExtension(const fs::path& path) {
  return std::ranges::find(kDataExtensions, Lower(path.extension().string())) !=
         kDataExtensions.end();
}

bool IsFileToRead(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored) && fs::file_size(path, ignored) <= kMaxObjectFile;
}

// Names of an object's file by the name of its body's, lower case: "smpl_fit_all" to
// "object_fit_all".
std::vector<std::string> ObjectStems(const std::string& stem) {
  std::vector<std::string> stems;
  for (const std::string_view word :
       {"human", "person", "smplx", "smplh", "smpl", "mano", "body", "subject", "hands", "hand"}) {
    const std::size_t at = stem.find(word);
    if (at == std::string::npos) continue;
    for (const std::string_view object : {"object", "obj"}) {
      std::string name = stem;
      stems.push_back(name.replace(at, word.size(), object));
    }
  }
  return stems;
}

// The files that may hold the object: those of the right name, else the only other data file or
// those that are called objects.
std::vector<fs::path> ObjectCandidates(const fs::path& body) {
  std::vector<fs::path> others;
  std::error_code error;
  const fs::path folder = body.has_parent_path() ? body.parent_path() : fs::path(".");
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().filename() == body.filename() || !HasDataExtension(entry->path())) continue;
    others.push_back(entry->path());
    if (others.size() > kMaxFilesBeside) return {};
  }
  std::ranges::sort(others);
  const std::vector<std::string> stems = ObjectStems(Lower(body.stem().string()));
  std::vector<fs::path> named, called;
  for (const fs::path& other : others) {
    const std::string stem = Lower(other.stem().string());
    if (std::ranges::find(stems, stem) != stems.end()) named.push_back(other);
    if (stem.starts_with("object") || stem == "obj" || stem.starts_with("obj_")) {
      called.push_back(other);
    }
  }
  std::vector<fs::path> candidates = !named.empty() ? named : others.size() == 1 ? others : called;
  std::erase_if(candidates, [](const fs::path& path) { return !IsFileToRead(path); });
  return candidates;
}

// Reads the track; throws Error for what is not as many frames.
void ReadObjectBeside(const fs::path& file, const Fields& fields, const ParameterOptions& options,
                      ImportedClip& imported) {
  const Eigen::Index frames = imported.clip.trans.cols();
  ObjectTrack track;
  track.trans = ReadFrameRows(*fields.Find(kObjectPlaces), 3);
  if (track.trans.cols() == 1) track.trans = track.trans.replicate(1, frames).eval();
  track.orient = ReadObjectRotations(*fields.Find(kObjectTurns), imported, frames);
  if (track.orient.cols() == 1) track.orient = track.orient.replicate(1, frames).eval();
  for (const Eigen::Index found : {track.trans.cols(), track.orient.cols()}) {
    RequireFrames(file.string(), "object", found, frames);
  }
  for (const std::string_view name : kObjectNames) {
    if (track.name.empty()) track.name = TextOf(fields, name);
  }
  const std::string name = file.filename().string();
  if (!track.name.empty()) {
    imported.object_mesh =
        FindInDataSet(file, fmt::format("objects/{0}/{0}.obj", track.name), options);
  }
  imported.notes.push_back(fmt::format(
      "the object is {} beside it{}: x_world = R x + T{}", name,
      track.name.empty() ? std::string() : fmt::format(", '{}'", track.name),
      imported.object_mesh.empty()
          ? "; its mesh was not found (--object-mesh says which to take, --data-root where the "
            "data set is)"
          : ""));
  std::vector<std::string> unused;
  for (const std::string& field : fields.Names()) {
    if (field != fields.FirstOf(kObjectPlaces) && field != fields.FirstOf(kObjectTurns) &&
        std::ranges::find(kObjectNames, field) == kObjectNames.end()) {
      unused.push_back(field);
    }
  }
  if (!unused.empty()) {
    imported.dropped.push_back(fmt::format("{}: {}", name, fmt::join(unused, ", ")));
  }
  imported.clip.object = std::move(track);
}

}  // namespace

fs::path FindInDataSet(const fs::path& from, const std::string& name,
                       const ParameterOptions& options) {
  const fs::path relative = fs::path(name).lexically_normal();
  if (name.empty() || relative.is_absolute() || *relative.begin() == "..") return {};
  std::error_code ignored;
  const auto in = [&](const fs::path& folder) -> fs::path {
    return fs::is_regular_file(folder / relative, ignored) ? folder / relative : fs::path();
  };
  if (!options.data_root.empty()) {
    // The root itself, or the folder of sequences in it.
    for (const fs::path& folder : {options.data_root, options.data_root.parent_path()}) {
      if (const fs::path found = in(folder); !found.empty()) return found;
    }
  }
  fs::path folder = fs::absolute(from, ignored).parent_path();
  for (int i = 0; i <= kMaxFoldersUp && !folder.empty(); ++i) {
    if (const fs::path found = in(folder); !found.empty()) return found;
    if (folder == folder.parent_path()) break;
    folder = folder.parent_path();
  }
  return {};
}

void ReadSubject(const fs::path& from, const std::string& name, const ParameterOptions& options,
                 ImportedClip& imported) {
  const fs::path mesh = FindInDataSet(from, name, options);
  if (mesh.empty()) {
    imported.notes.push_back(fmt::format(
        "the subject's surface {} was not found beside the file or in the folders above it: the "
        "mean shape of {} stands in, which is off by centimetres (--data-root FOLDER says where "
        "the data set is)",
        name.empty() ? "(which the file does not name)" : name, options.body->Name()));
    return;
  }
  imported.clip.v_template = ReadMesh(mesh).vertices;
  fs::path betas = mesh;
  betas.replace_filename(mesh.stem().string() + "_betas.npy");
  std::error_code ignored;
  if (!fs::is_regular_file(betas, ignored)) return;
  const DataFile file(betas);
  const NpyMember member = file.Root().Array();
  const auto count = static_cast<Eigen::Index>(member.array.NumElements());
  imported.clip.betas = ReadFrameRows(file.Root(), std::max<Eigen::Index>(count, 1)).col(0);
}

bool LooksLikeObjectPoses(const Fields& fields) {
  return fields.FirstOf(kObjectTurns) && fields.FirstOf(kObjectPlaces) &&
         !fields.FirstOf(kBodyPoses);
}

void AddObjectBeside(const fs::path& body, const ParameterOptions& options,
                     ImportedClip& imported) {
  std::vector<fs::path> found;
  for (const fs::path& candidate : ObjectCandidates(body)) {
    try {
      const DataFile file(candidate);
      if (LooksLikeObjectPoses(Fields(file))) found.push_back(candidate);
    } catch (const Error&) {
      continue;  // a file of something else
    }
  }
  if (found.empty()) return;
  if (found.size() > 1) {
    std::vector<std::string> names;
    for (const fs::path& path : found) names.push_back(path.filename().string());
    imported.notes.push_back(
        fmt::format("warning: several files beside it may be its object, none taken: {}. Leave one "
                    "in the folder",
                    fmt::join(names, ", ")));
    return;
  }
  try {
    const DataFile file(found[0]);
    ReadObjectBeside(found[0], Fields(file), options, imported);
  } catch (const Error& error) {
    imported.notes.push_back(fmt::format("warning: the object in {} beside it is not taken: {}",
                                         found[0].filename().string(), error.Problem()));
  }
}

void NoteTemplate(const BodyModel& body, ImportedClip& imported) {
  const Eigen::Index vertices = imported.clip.v_template.cols();
  if (vertices == 0 || vertices == body.NumVertices()) return;
  imported.notes.push_back(
      fmt::format("the subject's surface has {} vertices, {} has {}: it is kept in the clip, and "
                  "used with a body model of that many (--body)",
                  vertices, body.Name(), body.NumVertices()));
}

}  // namespace holdfast
