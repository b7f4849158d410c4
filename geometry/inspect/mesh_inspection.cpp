// SPDX-License-Identifier: MIT
#include "geometry/inspect/mesh_inspection.h"

#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/mesh/load_object.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/mesh_check.h"

namespace holdfast {
namespace {

constexpr Eigen::Index kFitVertices = 300;

// Of the content; of the name where the content is not known.
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
    inspection.Fault(fmt::format("its content is {}, its name ends in '{}': meshes are read by "
                                 "their extension",
                                 extension, inspection.path.extension().string()),
                     fmt::format("rename it to {}{}", Stem(inspection.path), extension));
  }
  MeshReport report;
  MeshReport repaired_report;
  std::vector<std::string> actions, decimated;
  std::optional<Error> too_complex;
  try {
    std::filesystem::path named = inspection.path;
    if (misnamed) named += extension;
    const MeshFile file = ReadMeshBytes(ReadFile(inspection.path), named);
    report = CheckMesh(file.mesh);
    for (const std::string& note : file.notes) inspection.AddFact("note", note, note);
    const RepairedMesh repaired = RepairMesh(file.mesh);
    actions = repaired.actions;
    repaired_report = CheckMesh(repaired.mesh);
    // As fit and decimate do.
    const LoadedObject object = ObjectOfMesh(file.mesh, Stem(inspection.path), named.string());
    try {
      ForFitting(object, kFitVertices, &decimated);
    } catch (const Error& error) {
      too_complex = error;
    }
  } catch (const Error& error) {
    inspection.Fault(fmt::format("{}: {}", error.Where(), error.Problem()), error.Remedy());
    return;
  }
  AddSizes(report, inspection);
  inspection.AddFact("watertight", report.watertight ? "yes" : "no", "");
  inspection.AddFact("watertight_after_repair", repaired_report.watertight ? "yes" : "no", "");

  const std::string repairs = fmt::format("{}", fmt::join(actions, " "));
  if (report.watertight) {
    inspection.Ok("watertight: closed, manifold, faces outwards");
  } else if (repaired_report.watertight) {
    inspection.Ok(fmt::format("watertight once loaded, where this is repaired: {}", repairs));
  } else {
    std::vector<std::string> faults = Describe(repaired_report);
    std::erase_if(faults, [](const std::string& line) {
      return line.find("edge") == std::string::npos && line.find("touch") == std::string::npos &&
             line.find("component") == std::string::npos;
    });
    // The first line is the counts.
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
    inspection.Warn(fmt::format("{:.3g} x {:.3g} x {:.3g} m, no size to hold", report.extent_m.x(),
                                report.extent_m.y(), report.extent_m.z()),
                    UnitRemedy(report.extent_m, path));
  } else {
    inspection.Ok("a size for a hand, in metres");
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
                       fmt::format("fit simplifies it to {} vertices by itself", kFitVertices));
    inspection.next.push_back(
        fmt::format("holdfast decimate {} -o {}", word, ShellWord(stem + "_300.ply")));
  }
}

}  // namespace holdfast
