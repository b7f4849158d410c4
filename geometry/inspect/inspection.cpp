// SPDX-License-Identifier: MIT
#include "geometry/inspect/inspection.h"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/import/amass.h"
#include "geometry/inspect/data_inspection.h"
#include "geometry/inspect/motion_inspection.h"
#include "geometry/inspect/other_inspection.h"
#include "geometry/io/gltf/asset/gltf_asset.h"
#include "geometry/io/mesh/mesh_io.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

// Adds the inspection of a file in a result folder to that of the folder.
void Include(const fs::path& file, Inspection& folder) {
  const Inspection part = Inspect(file);
  const std::string name = file.filename().string();
  folder.facts.push_back({"file", name, fmt::format("{}: {}", name, part.title)});
  for (const Fact& fact : part.facts) {
    folder.facts.push_back(
        {fact.name.empty() ? "" : fmt::format("{}:{}", name, fact.name), fact.value, fact.text});
  }
  for (const Finding& finding : part.findings) {
    folder.findings.push_back(
        {finding.verdict, fmt::format("{}: {}", name, finding.text), finding.fix});
  }
}

// Whether the arrays of a clip have forms that only the importers read.
bool IsForImport(const fs::path& path) {
  try {
    return NeedsImport(NpzReader(path));
  } catch (const Error&) {
    return false;
  }
}

// Whether a glTF file has meshes but neither animations nor skins.
bool IsMeshOnly(const fs::path& path) {
  try {
    const GltfAsset asset = GltfAsset::Read(path);
    return asset.animations.empty() && asset.skins.empty() && !asset.meshes.empty();
  } catch (const Error&) {
    return false;
  }
}

void InspectResult(Inspection& inspection) {
  std::error_code ignored;
  for (const char* name : {"clip.npz", "object.ply", "metrics.json"}) {
    if (fs::exists(inspection.path / name, ignored)) Include(inspection.path / name, inspection);
  }
  const std::string word = ShellWord(inspection.path);
  const std::string stem = ShellWord(Stem(inspection.path / "."));
  if (inspection.Worst() == Verdict::kFault) return;
  inspection.next.push_back(fmt::format("holdfast score {}", word));
  inspection.next.push_back(fmt::format("holdfast report {} -o {}.html", word, stem));
  inspection.next.push_back(fmt::format("holdfast render {} -o {}.mp4 --camera hand", word, stem));
}

}  // namespace

void Inspection::AddFact(std::string name, double value, std::string text) {
  facts.push_back({std::move(name), value, std::move(text)});
}
void Inspection::AddFact(std::string name, std::string value, std::string text) {
  facts.push_back({std::move(name), std::move(value), std::move(text)});
}
void Inspection::AddFact(std::string name, std::vector<double> value, std::string text) {
  facts.push_back({std::move(name), std::move(value), std::move(text)});
}

void Inspection::Ok(std::string text) { findings.push_back({Verdict::kOk, std::move(text), ""}); }
void Inspection::Warn(std::string text, std::string fix) {
  findings.push_back({Verdict::kWarning, std::move(text), std::move(fix)});
}
void Inspection::Fault(std::string text, std::string fix) {
  findings.push_back({Verdict::kFault, std::move(text), std::move(fix)});
}

Verdict Inspection::Worst() const {
  Verdict worst = Verdict::kOk;
  for (const Finding& finding : findings) worst = std::max(worst, finding.verdict);
  return worst;
}

std::string ShellWord(const fs::path& path) {
  const std::string text = path.string();
  const bool plain = !text.empty() && std::ranges::all_of(text, [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("._-/+,:@%").find(c) != std::string_view::npos;
  });
  if (plain && text.front() != '-') return text;
  std::string quoted = text.starts_with('-') ? "./'" : "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string Stem(const fs::path& path) {
  const fs::path name = path.filename() == "." ? path.parent_path().filename() : path.filename();
  fs::path stem = name.stem();
  if (name.extension() == ".gz") stem = stem.stem();
  return stem.empty() ? "out" : stem.string();
}

Inspection Inspect(const fs::path& path) {
  Inspection inspection;
  inspection.path = path;
  inspection.identity = Identify(path);
  inspection.title = Describe(inspection.identity.kind);
  if (inspection.identity.gzipped) inspection.title += ", gzipped";
  try {
    switch (inspection.identity.kind) {
      case FileKind::kResultFolder:
        InspectResult(inspection);
        break;
      case FileKind::kClip:
        if (IsForImport(path)) {
          InspectData(inspection);
        } else {
          InspectClip(inspection);
        }
        break;
      case FileKind::kSmplhMotion:
      case FileKind::kSmplMotion:
      case FileKind::kParameters:
      case FileKind::kGrab:
      case FileKind::kNpz:
      case FileKind::kNpy:
      case FileKind::kPickle:
      case FileKind::kTorch:
      case FileKind::kSafetensors:
      case FileKind::kJson:
        InspectData(inspection);
        break;
      case FileKind::kGlb:
      case FileKind::kGltf:
        IsMeshOnly(path) ? InspectMesh(inspection) : InspectData(inspection);
        break;
      case FileKind::kBodyModel:
        InspectModel(inspection);
        break;
      case FileKind::kBvh:
      case FileKind::kAmc:
        InspectMotion(inspection);
        break;
      case FileKind::kAsf:
        InspectAsf(inspection);
        break;
      case FileKind::kMarkers:
        InspectMarkers(inspection);
        break;
      case FileKind::kObj:
      case FileKind::kPly:
      case FileKind::kStl:
      case FileKind::kOff:
        InspectMesh(inspection);
        break;
      case FileKind::kText:
      case FileKind::kUnknown:
        // Mesh formats are chosen by file extension: report what the mesh reader reports.
        HasMeshFormat(path) ? InspectMesh(inspection) : InspectOtherFile(inspection);
        break;
      default:
        InspectOtherFile(inspection);
        break;
    }
  } catch (const Error& error) {
    inspection.Fault(fmt::format("{}: {}", error.Where(), error.Problem()), error.Remedy());
  }
  return inspection;
}

}  // namespace holdfast
