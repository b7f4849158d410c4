// SPDX-License-Identifier: MIT
#include "geometry/inspect/other_inspection.h"

#include <algorithm>
#include <optional>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/import/import_motion.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/object/load_object.h"

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
  inspection.Fault("an archive of other files", "unpack it and check its content");
  inspection.next.push_back(fmt::format("unzip -l {}", ShellWord(inspection.path)));
}

// Faults of kinds of files whose content need not be inspected, and what to do.
constexpr std::tuple<FileKind, const char*, const char*> kAdvice[] = {
    {FileKind::kMissing, "it does not exist", "check the path"},
    {FileKind::kFolder, "a folder without clip.npz and metrics.json", "give the files in it"},
    {FileKind::kSpecial, "a device, pipe or socket, which is not opened", "give a file"},
    {FileKind::kUnreadable, "it cannot be opened", "check that you may read it (ls -l)"},
    {FileKind::kEmpty, "it is empty", "copy or download it again"},
    {FileKind::kDamagedArchive, "it is damaged or cut off", "copy or download it again"},
    {FileKind::kFbx, kFbxProblem, "export .glb from Blender"},
    {FileKind::kPlyPoints, "points without faces: no surface",
     "reconstruct a surface first (for example Poisson in MeshLab)"},
    {FileKind::kUsd, "USD is not read", "give the motion as .npz, a mesh as .obj or .ply"},
    {FileKind::kHtml,
     "a web page: a report, or a server's response instead of the file (a login page?)",
     "open it in a browser; if it should be data, log in and download it again"},
    {FileKind::kGitLfsPointer, "a Git LFS pointer: the file itself is not here", "git lfs pull"},
    {FileKind::kHdf5, "HDF5 is not read", "write the arrays with numpy.savez"},
    {FileKind::kMatlab, "MATLAB files are not read",
     "write the arrays with numpy.savez (scipy.io.loadmat reads them)"},
    {FileKind::kUnknown, "unknown file format",
     "check which program wrote it; Holdfast reads .npz, .bvh, .amc, .glb, .obj, .ply, .stl, .off"},
};

}  // namespace

void InspectOtherFile(Inspection& inspection) {
  const Identity& identity = inspection.identity;
  switch (identity.kind) {
    case FileKind::kZip:
      return InspectZip(inspection);
    case FileKind::kMetrics:
      inspection.AddFact("schema", identity.detail, "schema: " + identity.detail);
      inspection.Ok("the metrics of a result");
      return;
    case FileKind::kSkeletonMap:
      inspection.Ok(fmt::format("maps {}", identity.detail));
      inspection.next.push_back(fmt::format("holdfast import MOTION.bvh --map {} -o MOTION.npz",
                                            ShellWord(inspection.path)));
      return;
    case FileKind::kText:
    case FileKind::kPicture:
    case FileKind::kVideo:
      inspection.Fault("not a format that Holdfast reads",
                       "give a motion, a body model, a mesh, markers or a result folder");
      return;
    default:
      break;
  }
  for (const auto& [kind, text, fix] : kAdvice) {
    if (kind != identity.kind) continue;
    inspection.Fault(identity.fault.empty() ? text : identity.fault, fix);
  }
}

namespace {

constexpr Eigen::Index kFitVertices = 300;

// Extension that fits the content; the file's own extension if the content is unknown.
std::string ExtensionOf(const Inspection& inspection) {
  switch (inspection.identity.kind) {
    case FileKind::kObj:
      return ".obj";
    case FileKind::kGlb:
      return ".glb";
    case FileKind::kGltf:
      return ".gltf";
    case FileKind::kPly:
      return ".ply";
    case FileKind::kStl:
      return ".stl";
    case FileKind::kOff:
      return ".off";
    default:
      return inspection.path.extension().string();
  }
}

void AddSizes(const MeshReport& report, Inspection& inspection) {
  const Eigen::Vector3d& e = report.extent_m;
  inspection.AddFact("vertices", static_cast<double>(report.num_vertices), "");
  inspection.AddFact("faces", static_cast<double>(report.num_faces), "");
  inspection.AddFact("components", static_cast<double>(report.num_components), "");
  inspection.AddFact("extent_m", std::vector<double>{e.x(), e.y(), e.z()}, "");
  inspection.AddFact("area_m2", report.area_m2, "");
  for (const std::string& line : Describe(report)) {
    inspection.AddFact("", "", line);
    if (inspection.facts.size() >= 2 && line.starts_with("Extent")) break;
  }
  if (report.watertight) inspection.AddFact("volume_m3", report.volume_m3, "");
}

}  // namespace

void InspectMesh(Inspection& inspection) {
  const std::string word = ShellWord(inspection.path);
  const std::string extension = ExtensionOf(inspection);
  const bool misnamed = !EqualIgnoringCase(inspection.path.extension().string(), extension);
  if (inspection.identity.gzipped) {
    inspection.Fault("it is packed with gzip", "unpack it first");
    inspection.next.push_back(fmt::format("gunzip -k {}", word));
    return;
  }
  if (misnamed) {
    inspection.Fault(fmt::format("its content is {}, but its name ends in '{}': the mesh format is "
                                 "chosen by the extension",
                                 extension, inspection.path.extension().string()),
                     fmt::format("rename it to {}{}", Stem(inspection.path), extension));
  }
  std::filesystem::path named = inspection.path;
  if (misnamed) named += extension;
  const MeshFile file = ReadMeshBytes(ReadFile(inspection.path), named);
  const MeshReport report = CheckMesh(file.mesh);
  for (const std::string& note : file.notes) inspection.AddFact("note", note, note);
  const auto [repaired, actions] = RepairMesh(file.mesh);
  const MeshReport repaired_report = CheckMesh(repaired);
  // Same steps as in fit and decimate.
  const LoadedObject object = ObjectOfMesh(file.mesh, Stem(inspection.path), named.string());
  std::vector<std::string> decimated;
  std::optional<Error> too_complex;
  try {
    ForFitting(object, kFitVertices, &decimated);
  } catch (const Error& error) {
    too_complex = error;
  }
  AddSizes(report, inspection);
  inspection.AddFact("watertight", report.watertight ? "yes" : "no", "");
  inspection.AddFact("watertight_after_repair", repaired_report.watertight ? "yes" : "no", "");

  const std::string repairs = fmt::format("{}", fmt::join(actions, " "));
  if (report.watertight) {
    inspection.Ok("watertight: closed, manifold, faces outwards");
  } else if (repaired_report.watertight) {
    inspection.Ok(fmt::format("watertight after the repairs made on loading: {}", repairs));
  } else {
    std::vector<std::string> faults = Describe(repaired_report);
    std::erase_if(faults, [](const std::string& line) {
      return line.find("edge") == std::string::npos && line.find("touch") == std::string::npos &&
             line.find("component") == std::string::npos;
    });
    // The first line holds the counts.
    if (!faults.empty()) faults.erase(faults.begin());
    inspection.Warn(
        fmt::format("not watertight{}: {}", actions.empty() ? "" : ", also after repairs",
                    fmt::join(faults, " ")),
        "it is usable: inside is decided by winding number; close the holes "
        "in a mesh editor for exact depths");
  }
  for (const std::string& note : decimated) {
    if (std::ranges::find(actions, note) != actions.end()) continue;
    inspection.AddFact("fit_note", note, "for a fit: " + note);
  }
  const std::string path = inspection.path.string();
  const std::vector<double> scales = PossibleScales(report.extent_m, path);
  if (report.implausible_size) {
    inspection.AddFact("suggested_scale", scales.empty() ? 1.0 : scales.front(), "");
    inspection.AddFact("possible_scales", scales, "");
    inspection.Warn(fmt::format("{:.3g} x {:.3g} x {:.3g} m, not a graspable size",
                                report.extent_m.x(), report.extent_m.y(), report.extent_m.z()),
                    UnitRemedy(report.extent_m, path));
  } else {
    inspection.Ok("a graspable size, in meters");
  }
  if (too_complex) inspection.Fault(too_complex->Problem(), too_complex->Remedy());
  if (misnamed || too_complex) return;
  const std::string scale =
      scales.empty() ? "" : fmt::format(" --object-scale {:g}", scales.front());
  const std::string stem = Stem(inspection.path);
  inspection.next.push_back(
      fmt::format("holdfast fit demo_drink {} -o {}{}", word, ShellWord(stem + "_held"), scale));
  if (report.num_vertices > kFitVertices) {
    inspection.AddFact("fit_vertices", static_cast<double>(kFitVertices),
                       fmt::format("fit simplifies it to {} vertices automatically", kFitVertices));
    inspection.next.push_back(
        fmt::format("holdfast decimate {} -o {}", word, ShellWord(stem + "_300.ply")));
  }
}

namespace {

constexpr double kJump_m_s2 = 200.0;  // people stay below; swapped labels and ghosts do not
constexpr double kSmallest_m = 0.05;  // captures of people lie between these extents
constexpr double kLargest_m = 30.0;

// Counts the frames in which the marker's acceleration is higher than a human body's.
int Jumps(const MarkerRecording& recording, int marker) {
  const double most = kJump_m_s2 / (recording.rate_hz * recording.rate_hz);
  int jumps = 0;
  for (int t = 1; t + 1 < recording.NumFrames(); ++t) {
    const Eigen::Vector3d change =
        recording.At(marker, t + 1) - 2.0 * recording.At(marker, t) + recording.At(marker, t - 1);
    jumps += change.norm() > most ? 1 : 0;  // false for NaN
  }
  return jumps;
}

void DescribeMarkers(const MarkerRecording& recording, Inspection& inspection) {
  const int frames = recording.NumFrames();
  const std::set<std::string> subjects(recording.subjects.begin(), recording.subjects.end());
  inspection.AddFact(
      "markers", recording.NumMarkers(),
      fmt::format("{} markers: {}", recording.NumMarkers(), fmt::join(recording.names, " ")));
  inspection.AddFact(
      "frames", frames,
      fmt::format("{} frames at {:g} Hz ({:.1f} s), from frame {}", frames, recording.rate_hz,
                  frames / recording.rate_hz, recording.first_frame));
  inspection.AddFact("frame_rate_hz", recording.rate_hz, "");
  if (*subjects.rbegin() != "") {
    inspection.AddFact("subjects", fmt::format("{}", fmt::join(subjects, " ")),
                       fmt::format("subject: {}", fmt::join(subjects, ", ")));
  }
  inspection.AddFact("unit", recording.unit, fmt::format("unit: {}", recording.unit));
  if (subjects.size() > 1) {
    inspection.Warn(fmt::format("markers of {} subjects", subjects.size()),
                    "each is a separate person or object");
  }
}

void JudgeExtent(const MarkerRecording& recording, Inspection& inspection) {
  Eigen::AlignedBox3d box;
  for (int m = 0; m < recording.NumMarkers(); ++m) {
    for (int t = 0; t < recording.NumFrames(); ++t) {
      if (recording.Seen(m, t)) box.extend(recording.At(m, t));
    }
  }
  if (box.isEmpty()) {
    inspection.Fault("no marker is seen in any frame", "export it again with its trajectories");
    return;
  }
  const Eigen::Vector3d size = box.sizes();
  inspection.AddFact("extent_m", std::vector<double>(size.begin(), size.end()),
                     fmt::format("extent: {:.2f} x {:.2f} x {:.2f} m, z from {:.2f} to {:.2f}; the "
                                 "file does not say which axis is up",
                                 size.x(), size.y(), size.z(), box.min().z(), box.max().z()));
  if (size.maxCoeff() < kSmallest_m || size.maxCoeff() > kLargest_m) {
    inspection.Fault(fmt::format("the markers span {:.3g} m: the unit is not {}", size.maxCoeff(),
                                 recording.unit),
                     "check the unit in the file");
  }
}

void JudgeGaps(const MarkerRecording& recording, Inspection& inspection) {
  std::vector<std::string> never, partly, jumping;
  int complete = 0;
  for (int m = 0; m < recording.NumMarkers(); ++m) {
    int missing = 0, longest = 0, run = 0;
    for (int t = 0; t < recording.NumFrames(); ++t) {
      run = recording.Seen(m, t) ? 0 : run + 1;
      missing += run > 0 ? 1 : 0;
      longest = std::max(longest, run);
    }
    if (missing == recording.NumFrames()) {
      never.push_back(recording.names[m]);
      continue;
    }
    if (missing == 0) {
      ++complete;
    } else {
      partly.push_back(
          fmt::format("{} {} frames (longest gap {})", recording.names[m], missing, longest));
    }
    if (const int jumps = Jumps(recording, m); jumps > 0) {
      jumping.push_back(fmt::format("{} {}", recording.names[m], jumps));
    }
  }
  inspection.AddFact("markers_complete", complete, "");
  if (!never.empty()) {
    inspection.Warn(fmt::format("never seen: {}", fmt::join(never, " ")),
                    "they may be used only in the static trial");
  }
  if (!partly.empty()) {
    inspection.Warn(fmt::format("gaps: {}", fmt::join(partly, ", ")),
                    "fill them in the capture software, or leave them");
  }
  if (!jumping.empty()) {
    inspection.Warn(fmt::format("accelerations over {:g} m/s2, in frames: {}", kJump_m_s2,
                                fmt::join(jumping, ", ")),
                    "look for swapped labels and ghosts there");
  }
  if (never.empty() && partly.empty()) inspection.Ok("every marker is seen in every frame");
}

}  // namespace

void InspectMarkers(Inspection& inspection) {
  const MarkerRecording recording = ReadMarkers(inspection.path);
  inspection.title = fmt::format("marker recording: {}", recording.format);
  if (inspection.identity.gzipped) inspection.title += ", gzipped";
  DescribeMarkers(recording, inspection);
  for (const std::string& note : recording.notes) {
    inspection.Warn(note, "it is read anyway; export it again to be sure");
  }
  JudgeExtent(recording, inspection);
  JudgeGaps(recording, inspection);
}

}  // namespace holdfast
