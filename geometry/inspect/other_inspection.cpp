// SPDX-License-Identifier: MIT
#include "geometry/inspect/other_inspection.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/npz.h"

namespace holdfast {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 20;
constexpr std::size_t kMaxSearched = std::size_t{2} << 30;
constexpr std::size_t kShown = 12;

// Which of these words occur in a file, read in blocks.
std::vector<std::string> Search(const std::filesystem::path& path,
                                const std::vector<std::string>& words) {
  std::size_t longest = 0;
  for (const std::string& word : words) longest = std::max(longest, word.size());
  std::map<std::string, bool> found;
  std::ifstream in(path, std::ios::binary);
  std::string window;
  std::string block(kBlock, '\0');
  std::size_t searched = 0;
  while (searched < kMaxSearched && (in.read(block.data(), kBlock) || in.gcount() > 0)) {
    const auto got = static_cast<std::size_t>(in.gcount());
    searched += got;
    window.append(block, 0, got);
    for (const std::string& word : words) {
      if (!found[word]) found[word] = window.find(word) != std::string::npos;
    }
    // A word may lie across two blocks.
    if (window.size() > longest) window.erase(0, window.size() - longest);
  }
  std::vector<std::string> hits;
  for (const std::string& word : words) {
    if (found[word]) hits.push_back(word);
  }
  return hits;
}

void InspectPickle(Inspection& inspection) {
  const std::vector<std::string> words =
      Search(inspection.path, {"v_template",  "kintree_table",
                               "J_regressor", "hands_meanl",
                               "hands_mean",  "hands_components",
                               "posedirs",    "dynamic_lmk_faces_idx",
                               "chumpy",      "scipy.sparse",
                               "torch",       "global_orient",
                               "body_pose",   "left_hand_pose",
                               "fullpose",    "left_hand",
                               "right_hand",  "poses",
                               "trans",       "betas"});
  const auto has = [&](std::string_view word) {
    return std::ranges::find(words, word) != words.end();
  };
  const bool model = has("v_template") && (has("kintree_table") || has("J_regressor"));
  std::string what = "a pickle (Python objects)";
  std::string fix =
      "write what you need as plain arrays with numpy.savez, in Python; only for a file that you "
      "trust, since loading a pickle executes what it holds";
  if (model && has("hands_meanl")) {
    what = has("dynamic_lmk_faces_idx") ? "body model: SMPL-X (pickle)"
                                        : "body model: SMPL-H or SMPL-X (pickle)";
    fix = "take the .npz of the same download (SMPLX_NEUTRAL.npz)";
  } else if (model && has("hands_mean")) {
    what = "body model: MANO, one hand (pickle)";
    fix = "MANO alone is not used; take a whole body: SMPLX_NEUTRAL.npz, or the embedded one";
  } else if (model) {
    what = "body model: SMPL (pickle)";
    fix = "take SMPLX_NEUTRAL.npz, or the embedded body";
  } else if (has("body_pose") || has("fullpose")) {
    what = "body parameters in smplx's names (pickle)";
  } else if (has("left_hand") && has("right_hand") && inspection.identity.bytes < (1 << 20)) {
    what = "hand vertex ids, as MANO_SMPLX_vertex_ids.pkl (pickle)";
    fix = "nothing to do: Holdfast knows MANO's vertices in SMPL-X";
  } else if (has("poses") && has("trans")) {
    what = "body motion (pickle)";
  }
  inspection.title = what;
  inspection.AddFact("names_found", fmt::format("{}", fmt::join(words, ", ")),
                     words.empty() ? "no name of a body model or motion in it"
                                   : fmt::format("names in it: {}", fmt::join(words, ", ")));
  inspection.Fault("pickles are not read: their content is a program", fix);
}

void InspectTorch(Inspection& inspection) {
  const std::vector<std::string> words =
      Search(inspection.path, {"state_dict", "weight", "bias", "fullpose", "body_pose", "transl",
                               "global_orient", "obj_transl", "obj_global_orient", "object"});
  const auto has = [&](std::string_view word) {
    return std::ranges::find(words, word) != words.end();
  };
  const bool weights = has("weight") && has("bias");
  if (!weights && (has("fullpose") || has("body_pose"))) {
    inspection.title = "body motion in a torch archive, as IMoS's code writes";
  } else if (weights) {
    inspection.title = "network weights in a torch archive";
  }
  inspection.AddFact(
      "names_found", fmt::format("{}", fmt::join(words, ", ")),
      fmt::format("names in it: {}", words.empty() ? "none that are known"
                                                   : fmt::format("{}", fmt::join(words, ", "))));
  inspection.Fault("torch archives are not read: they hold pickles",
                   weights ? "save the tensors as .safetensors in Python"
                           : "load it in Python with torch.load and save numpy arrays with "
                             "numpy.savez; only for a file that you trust");
}

std::uint64_t Little(std::string_view bytes) {
  std::uint64_t value = 0;
  for (std::size_t k = bytes.size(); k-- > 0;) {
    value = value << 8 | static_cast<unsigned char>(bytes[k]);
  }
  return value;
}

// Bytes [begin, begin + count) of a file; fewer where it ends.
std::string Bytes(const std::filesystem::path& path, std::size_t begin, std::size_t count) {
  std::ifstream in(path, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(begin));
  std::string bytes(count, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  return bytes;
}

constexpr std::size_t kMaxJson = std::size_t{64} << 20;

// Parsed without recursion deeper than such files have.
nlohmann::json ParseShallow(const std::string& text, int max_depth) {
  const auto callback = [max_depth](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
    return depth <= max_depth;  // deeper values are dropped
  };
  return nlohmann::json::parse(text, callback, /*allow_exceptions=*/false);
}

void InspectSafetensors(Inspection& inspection) {
  const std::uint64_t length = Little(Bytes(inspection.path, 0, 8));
  if (length > kMaxJson) {
    inspection.Fault("its header is larger than 64 MB", "get the file again");
    return;
  }
  const nlohmann::json header = ParseShallow(Bytes(inspection.path, 8, length), 6);
  if (!header.is_object()) {
    inspection.Fault("its header is no JSON", "get the file again");
    return;
  }
  std::size_t tensors = 0;
  std::uint64_t end = 0;
  bool sound = true;
  std::vector<std::string> names;
  for (const auto& [name, entry] : header.items()) {
    if (name == "__metadata__") continue;
    ++tensors;
    if (names.size() < kShown) names.push_back(name);
    const auto offsets = entry.is_object() ? entry.find("data_offsets") : entry.end();
    if (!entry.is_object() || offsets == entry.end() || !offsets->is_array() ||
        offsets->size() != 2 || !(*offsets)[0].is_number_unsigned() ||
        !(*offsets)[1].is_number_unsigned()) {
      sound = false;
      continue;
    }
    if ((*offsets)[0].get<std::uint64_t>() > (*offsets)[1].get<std::uint64_t>()) sound = false;
    end = std::max(end, (*offsets)[1].get<std::uint64_t>());
  }
  inspection.AddFact("tensors", static_cast<double>(tensors),
                     fmt::format("{} tensors: {}{}", tensors, fmt::join(names, ", "),
                                 tensors > names.size() ? ", ..." : ""));
  const std::uint64_t available = inspection.identity.bytes - 8 - length;
  if (!sound) {
    inspection.Fault("its header is not that of tensors", "get the file again");
  } else if (end > available) {
    inspection.Fault(fmt::format("it ends after {} of {} bytes of tensors", available, end),
                     "get the file again");
  } else {
    inspection.Ok("header and size agree");
  }
}

void InspectGlb(Inspection& inspection) {
  const std::string head = Bytes(inspection.path, 0, 20);
  if (head.size() < 20) {
    inspection.Fault("it ends within its header", "get the file again");
    return;
  }
  const std::string_view view(head);
  const std::uint64_t version = Little(view.substr(4, 4)), total = Little(view.substr(8, 4)),
                      json_bytes = Little(view.substr(12, 4));
  if (version != 2 || view.substr(16, 4) != "JSON") {
    inspection.Fault(fmt::format("glTF binary of version {}; version 2 is known", version),
                     "export it again");
    return;
  }
  if (total != inspection.identity.bytes || json_bytes + 20 > total || json_bytes > kMaxJson) {
    inspection.Fault(
        fmt::format("its header says {} bytes, it has {}", total, inspection.identity.bytes),
        "get the file again");
    return;
  }
  const nlohmann::json scene = ParseShallow(Bytes(inspection.path, 20, json_bytes), 20);
  if (!scene.is_object()) {
    inspection.Fault("its scene is no JSON", "export it again");
    return;
  }
  std::vector<std::string> counts;
  for (const char* part : {"nodes", "meshes", "skins", "animations"}) {
    const auto found = scene.find(part);
    const std::size_t count = found == scene.end() ? 0 : found->size();
    inspection.AddFact(part, static_cast<double>(count), "");
    counts.push_back(fmt::format("{} {}", count, part));
  }
  inspection.AddFact("scene", fmt::format("{}", fmt::join(counts, ", ")),
                     fmt::format("{}", fmt::join(counts, ", ")));
  inspection.Ok("header, lengths and scene agree");
  inspection.Warn("glTF is for looking at: Holdfast writes it and does not read it",
                  "open it in a viewer; a motion comes from its .npz, a mesh from .obj or .ply");
}

void InspectNpz(Inspection& inspection) {
  std::vector<std::string> names;
  for (const std::string& member : inspection.identity.members) {
    if (names.size() < kShown) names.push_back(member);
  }
  inspection.AddFact(
      "members", static_cast<double>(inspection.identity.members.size()),
      fmt::format("{} members: {}", inspection.identity.members.size(), fmt::join(names, ", ")));
  if (inspection.identity.kind == FileKind::kNpz) {
    inspection.Fault(
        fmt::format(
            "its arrays are no motion and no body model{}",
            inspection.identity.detail.empty() ? "" : " (" + inspection.identity.detail + ")"),
        "a clip has mocap_frame_rate, trans, root_orient, pose_body, pose_hand");
  } else {
    inspection.Fault("an archive of other files", "unpack it, and look at what is in it");
    inspection.next.push_back(fmt::format("unzip -l {}", ShellWord(inspection.path)));
  }
}

// What to say of kinds that need no look inside.
struct Advice {
  FileKind kind;
  Verdict verdict;
  const char* text;
  const char* fix;
};

constexpr Advice kAdvice[] = {
    {FileKind::kMissing, Verdict::kFault, "it does not exist", "check the path"},
    {FileKind::kFolder, Verdict::kFault, "a folder without clip.npz and metrics.json",
     "give the files in it"},
    {FileKind::kSpecial, Verdict::kFault, "a device, pipe or socket, which is not opened",
     "give a file"},
    {FileKind::kUnreadable, Verdict::kFault, "it cannot be opened",
     "check that you may read it (ls -l)"},
    {FileKind::kEmpty, Verdict::kFault, "it is empty", "copy or download it again"},
    {FileKind::kDamagedArchive, Verdict::kFault, "it is damaged or cut off",
     "copy or download it again"},
    {FileKind::kNpy, Verdict::kFault, "one array without a name",
     "put arrays into an .npz under the names of a clip"},
    {FileKind::kC3d, Verdict::kFault, "markers, which are not read",
     "solve the markers to a skeleton first and export BVH"},
    {FileKind::kFbx, Verdict::kFault, "FBX is not read", "export BVH (motion) or .obj (mesh)"},
    {FileKind::kPlyPoints, Verdict::kFault, "points without faces: no surface",
     "reconstruct a surface first (for example Poisson in MeshLab)"},
    {FileKind::kUsd, Verdict::kWarning, "USD is not read",
     "a motion comes from its .npz, a mesh from .obj or .ply"},
    {FileKind::kGltf, Verdict::kWarning, "glTF is not read",
     "a motion comes from its .npz, a mesh from .obj or .ply"},
    {FileKind::kHtml, Verdict::kWarning,
     "a web page: a report, or what a server sent in place of a file (a login?)",
     "open it in a browser; if it should be data, log in and download it again"},
    {FileKind::kGitLfsPointer, Verdict::kFault, "a pointer of Git LFS: the file itself is not here",
     "git lfs pull"},
    {FileKind::kHdf5, Verdict::kFault, "HDF5 is not read", "write the arrays with numpy.savez"},
    {FileKind::kMatlab, Verdict::kFault, "MATLAB files are not read",
     "write the arrays with numpy.savez (scipy.io.loadmat reads them)"},
    {FileKind::kUnknown, Verdict::kFault, "nothing known begins like this",
     "check what wrote it; Holdfast reads .npz, .bvh, .amc, .obj, .ply, .stl, .off"},
};

}  // namespace

void InspectOtherFile(Inspection& inspection) {
  const Identity& identity = inspection.identity;
  switch (identity.kind) {
    case FileKind::kPickle:
      return InspectPickle(inspection);
    case FileKind::kTorch:
      return InspectTorch(inspection);
    case FileKind::kSafetensors:
      return InspectSafetensors(inspection);
    case FileKind::kGlb:
      return InspectGlb(inspection);
    case FileKind::kNpz:
    case FileKind::kZip:
      return InspectNpz(inspection);
    case FileKind::kMetrics:
      inspection.AddFact("schema", identity.detail, "schema: " + identity.detail);
      inspection.Ok("the numbers of a result");
      return;
    case FileKind::kSkeletonMap:
      inspection.Ok(fmt::format("names {}", identity.detail));
      inspection.next.push_back(fmt::format("holdfast import MOTION.bvh --map {} -o MOTION.npz",
                                            ShellWord(inspection.path)));
      return;
    case FileKind::kJson:
      if (!identity.fault.empty()) {
        inspection.Fault(identity.fault, "copy it again, or fix what wrote it");
      } else {
        inspection.AddFact("keys", identity.detail, identity.detail);
        inspection.Warn("no JSON that Holdfast reads", "");
      }
      return;
    case FileKind::kText:
    case FileKind::kPicture:
    case FileKind::kVideo:
      inspection.Warn("nothing that Holdfast reads", "");
      return;
    default:
      break;
  }
  for (const Advice& advice : kAdvice) {
    if (advice.kind != identity.kind) continue;
    std::string text = identity.fault.empty() ? advice.text : identity.fault;
    inspection.findings.push_back({advice.verdict, std::move(text), advice.fix});
  }
}

}  // namespace holdfast
