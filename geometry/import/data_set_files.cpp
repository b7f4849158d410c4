// SPDX-License-Identifier: MIT
#include "geometry/import/data_set_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <optional>
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

// Possible stems of an object's file, in lower case, from the stem of the body's file:
// "object_fit_all" for "smpl_fit_all".
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

// Returns the files that may hold the object: those with a matching name, else the only other data
// file, else files that are named as objects.
std::vector<fs::path> ObjectCandidates(const fs::path& body) {
  std::vector<fs::path> others;
  std::error_code error;
  const fs::path folder = body.has_parent_path() ? body.parent_path() : fs::path(".");
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string extension = Lower(entry->path().extension().string());
    if (entry->path().filename() == body.filename() ||
        std::ranges::find(kDataExtensions, extension) == kDataExtensions.end()) {
      continue;
    }
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
  std::erase_if(candidates, [&](const fs::path& path) {
    return !fs::is_regular_file(path, error) || fs::file_size(path, error) > kMaxObjectFile;
  });
  return candidates;
}

std::string MeshNotFound(const std::string& object) {
  return fmt::format(
      "the mesh of the object '{}' was not found (give it with --object-mesh, or the folder of the "
      "data set with --data-root)",
      object);
}

// Reads the object's track. Throws Error if it has another number of frames than the body.
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
  imported.notes.push_back(
      fmt::format("the object is read from {} beside it{}: x_world = R x + T", name,
                  track.name.empty() ? std::string() : fmt::format(", '{}'", track.name)));
  if (imported.object_mesh.empty()) imported.notes.push_back(MeshNotFound(track.name));
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
    // `data_root` may be the root itself or the folder of sequences in it.
    const fs::path root = options.data_root;
    for (const fs::path& folder : {root, root.parent_path()}) {
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

void FindObjectMesh(const fs::path& from, std::span<const std::string> names,
                    const ParameterOptions& options, ImportedClip& imported) {
  for (const std::string& name : names) {
    if (imported.object_mesh.empty()) imported.object_mesh = FindInDataSet(from, name, options);
  }
  if (imported.object_mesh.empty()) {
    imported.notes.push_back(MeshNotFound(imported.clip.object->name));
  }
}

void ReadSubject(const fs::path& from, const std::string& name, const ParameterOptions& options,
                 ImportedClip& imported) {
  const fs::path mesh = FindInDataSet(from, name, options);
  if (mesh.empty()) {
    imported.notes.push_back(
        fmt::format("the subject's surface {} was not found beside the file or in the folders "
                    "above it: the mean shape of {} is used, which is off by centimeters (give the "
                    "folder of the data set with --data-root)",
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
      continue;  // not an object
    }
  }
  if (found.empty()) return;
  if (found.size() > 1) {
    std::vector<std::string> names;
    for (const fs::path& path : found) names.push_back(path.filename().string());
    imported.notes.push_back(
        fmt::format("warning: several files beside it may be its object, none is used: {}. Leave "
                    "only one in the folder",
                    fmt::join(names, ", ")));
    return;
  }
  try {
    const DataFile file(found[0]);
    ReadObjectBeside(found[0], Fields(file), options, imported);
  } catch (const Error& error) {
    imported.notes.push_back(fmt::format("warning: the object in {} beside it is not used: {}",
                                         found[0].filename().string(), error.Problem()));
  }
}

void NoteTemplate(const BodyModel& body, ImportedClip& imported) {
  const Eigen::Index vertices = imported.clip.v_template.cols();
  if (vertices == 0 || vertices == body.NumVertices()) return;
  imported.notes.push_back(
      fmt::format("the subject's surface has {} vertices, {} has {}: it is kept in the clip, and "
                  "used with a body model that has as many (--body)",
                  vertices, body.Name(), body.NumVertices()));
}

namespace {

constexpr std::size_t kMaxFiles = 200'000;

bool IsDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

std::vector<fs::path> Sorted(const fs::path& folder) {
  std::vector<fs::path> entries;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with('.')) continue;
    entries.push_back(entry.path());
    if (entries.size() > kMaxFiles) {
      throw Error(folder.string(), fmt::format("holds more than {} files", kMaxFiles),
                  "Give a folder of one sequence");
    }
  }
  std::ranges::sort(entries, [](const fs::path& a, const fs::path& b) {
    return NaturalLess(a.filename().string(), b.filename().string());
  });
  return entries;
}

// The most common extension of the files.
std::string CommonExtension(const std::vector<fs::path>& files) {
  std::map<std::string, int> count;
  for (const fs::path& file : files) {
    const std::string extension = file.extension().string();
    if (std::ranges::find(kDataExtensions, extension) != kDataExtensions.end()) ++count[extension];
  }
  std::string common;
  for (const auto& [extension, n] : count) {
    if (common.empty() || n > count[common]) common = extension;
  }
  return common;
}

// Splits "00012_1" into frame "00012" and person 1; nullopt for other names.
std::optional<std::pair<std::string, int>> FrameAndPerson(const std::string& stem) {
  const std::size_t bar = stem.rfind('_');
  if (bar == std::string::npos || bar == 0 || bar + 1 == stem.size()) return std::nullopt;
  const std::string person = stem.substr(bar + 1);
  if (person.size() > 3 || !std::ranges::all_of(person, IsDigit) || !IsDigit(stem[bar - 1])) {
    return std::nullopt;
  }
  return std::pair(stem.substr(0, bar), std::stoi(person));
}

// The last number in a name; nullopt if there is none or it has more than 9 digits.
std::optional<long> NumberIn(const std::string& stem) {
  const auto last = std::find_if(stem.rbegin(), stem.rend(), IsDigit);
  if (last == stem.rend()) return std::nullopt;
  const auto first = std::find_if_not(last, stem.rend(), IsDigit);
  const std::string digits(first.base(), last.base());
  if (digits.size() > 9) return std::nullopt;
  return std::stol(digits);
}

// Number of missing numbers between the first and the last frame.
int CountMissing(const std::vector<std::string>& frames) {
  if (frames.size() < 2) return 0;
  const std::optional<long> first = NumberIn(frames.front()), last = NumberIn(frames.back());
  if (!first || !last) return 0;
  const long missing = *last - *first + 1 - static_cast<long>(frames.size());
  return missing > 0 && missing < 1'000'000 ? static_cast<int>(missing) : 0;
}

}  // namespace

bool NaturalLess(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!IsDigit(a[i]) || !IsDigit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const auto number = [](const std::string& text, std::size_t& at) {
      const std::size_t begin = at;
      while (at < text.size() && IsDigit(text[at])) ++at;
      const std::size_t digits = std::min(text.find_first_not_of('0', begin), at);
      return text.substr(digits, at - digits);
    };
    const std::string m = number(a, i), n = number(b, j);
    if (m.size() != n.size()) return m.size() < n.size();
    if (m != n) return m < n;
  }
  if (i == a.size() && j == b.size()) return a < b;  // "01" and "1": any fixed order
  return i == a.size();
}

std::vector<fs::path> FindFrameFiles(const fs::path& folder, int person,
                                     std::vector<std::string>& notes) {
  std::vector<fs::path> files, folders;
  for (const fs::path& entry : Sorted(folder)) {
    std::error_code ignored;
    (fs::is_directory(entry, ignored) ? folders : files).push_back(entry);
  }
  std::vector<fs::path> found;
  std::vector<std::string> frames;
  int most = 1;  // people in a frame
  const auto no_person = [&](const std::string& frame, std::size_t people) {
    return Error(folder.string(),
                 fmt::format("has no person {} in frame {}, only {}", person, frame, people),
                 "Choose another with --person");
  };
  std::string extension = CommonExtension(files);
  if (extension.empty()) {
    // One folder per frame, with one file per person.
    for (const fs::path& frame : folders) {
      std::vector<fs::path> people;
      for (const fs::path& file : Sorted(frame)) {
        if (extension.empty()) extension = CommonExtension({file});
        if (!extension.empty() && file.extension() == extension) people.push_back(file);
      }
      if (people.empty()) continue;
      most = std::max(most, static_cast<int>(people.size()));
      const std::string name = frame.filename().string();
      if (static_cast<std::size_t>(person) >= people.size()) throw no_person(name, people.size());
      found.push_back(people[person]);
      frames.push_back(name);
    }
  } else {
    std::erase_if(files, [&](const fs::path& file) { return file.extension() != extension; });
    // Names include a person only if some frame has more than one.
    std::map<std::string, int> people;
    bool numbered = true;
    for (const fs::path& file : files) {
      const auto parts = FrameAndPerson(file.stem().string());
      numbered = numbered && parts;
      if (parts) ++people[parts->first];
    }
    for (const auto& [frame, count] : people) {
      if (numbered) most = std::max(most, count);
    }
    for (const fs::path& file : files) {
      const std::string stem = file.stem().string();
      const auto parts = FrameAndPerson(stem);
      if (most > 1 && parts->second != person) continue;
      found.push_back(file);
      frames.push_back(most > 1 ? parts->first : stem);
    }
    if (found.empty() && !files.empty()) {
      throw no_person(frames.empty() ? "any" : frames[0], static_cast<std::size_t>(most));
    }
  }
  if (found.empty()) {
    throw Error(folder.string(), "is a folder without parameter files (.pkl .npz .npy .json)",
                "Give a file, or a folder with one file per frame");
  }
  if (most > 1) {
    notes.push_back(fmt::format(
        "up to {} people per frame: person {} is used (choose with --person)", most, person));
  }
  if (const int missing = CountMissing(frames); missing > 0) {
    notes.push_back(
        fmt::format("frames missing between the first and the last number: {}; the others were "
                    "joined without a gap",
                    missing));
  }
  return found;
}

}  // namespace holdfast
