// SPDX-License-Identifier: MIT
#include "geometry/inspect/other_inspection.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/import/import_motion.h"

namespace holdfast {
namespace {

constexpr std::size_t kShownNames = 12;

void InspectZip(Inspection& inspection) {
  std::vector<std::string> names;
  for (const std::string& member : inspection.identity.members) {
    if (names.size() < kShownNames) names.push_back(member);
  }
  inspection.AddFact(
      "members", static_cast<double>(inspection.identity.members.size()),
      fmt::format("{} members: {}", inspection.identity.members.size(), fmt::join(names, ", ")));
  inspection.Fault("an archive of other files", "unpack it, and look at what is in it");
  inspection.next.push_back(fmt::format("unzip -l {}", ShellWord(inspection.path)));
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
    {FileKind::kFbx, Verdict::kFault, kFbxProblem, "export .glb from Blender"},
    {FileKind::kPlyPoints, Verdict::kFault, "points without faces: no surface",
     "reconstruct a surface first (for example Poisson in MeshLab)"},
    {FileKind::kUsd, Verdict::kFault, "USD is not read",
     "a motion comes from its .npz, a mesh from .obj or .ply"},
    {FileKind::kHtml, Verdict::kFault,
     "a web page: a report, or what a server sent in place of a file (a login?)",
     "open it in a browser; if it should be data, log in and download it again"},
    {FileKind::kGitLfsPointer, Verdict::kFault, "a pointer of Git LFS: the file itself is not here",
     "git lfs pull"},
    {FileKind::kHdf5, Verdict::kFault, "HDF5 is not read", "write the arrays with numpy.savez"},
    {FileKind::kMatlab, Verdict::kFault, "MATLAB files are not read",
     "write the arrays with numpy.savez (scipy.io.loadmat reads them)"},
    {FileKind::kUnknown, Verdict::kFault, "nothing known begins like this",
     "check what wrote it; Holdfast reads .npz, .bvh, .amc, .glb, .obj, .ply, .stl, .off"},
};

}  // namespace

void InspectOtherFile(Inspection& inspection) {
  const Identity& identity = inspection.identity;
  switch (identity.kind) {
    case FileKind::kZip:
      return InspectZip(inspection);
    case FileKind::kMetrics:
      inspection.AddFact("schema", identity.detail, "schema: " + identity.detail);
      inspection.Ok("the numbers of a result");
      return;
    case FileKind::kSkeletonMap:
      inspection.Ok(fmt::format("names {}", identity.detail));
      inspection.next.push_back(fmt::format("holdfast import MOTION.bvh --map {} -o MOTION.npz",
                                            ShellWord(inspection.path)));
      return;
    case FileKind::kText:
    case FileKind::kPicture:
    case FileKind::kVideo:
      inspection.Fault("nothing that Holdfast reads",
                       "give a motion, a body model, a mesh, markers or a result folder");
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
