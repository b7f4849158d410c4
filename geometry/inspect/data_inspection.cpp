// SPDX-License-Identifier: MIT
#include "geometry/inspect/data_inspection.h"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/body/body_model_reader.h"
#include "geometry/error.h"
#include "geometry/import/import_file.h"
#include "geometry/inspect/clip_findings.h"
#include "geometry/io/pickle/data_file.h"

namespace holdfast {
namespace {

constexpr std::size_t kShownEntries = 24;
constexpr int kShownDepth = 3;  // a pickle may contain cycles

// Describes a value: "array (120, 63) of float32", or the number itself for a scalar.
std::string DescribeValue(const DataValue& value) {
  if (value.Kind() != DataKind::kArray) return value.Describe();
  const NpyMember member = value.Array();
  if (!member.array.shape.empty()) return value.Describe();
  try {
    return fmt::format("{:g}", value.Number());
  } catch (const Error&) {  // a text scalar
    return value.Describe();
  }
}

void ListNames(const DataValue& value, int depth, std::vector<std::string>& lines) {
  for (const std::string& name : value.Names()) {
    if (lines.size() > kShownEntries) return;
    const DataValue part = value[name];
    lines.push_back(fmt::format("{:{}}{}: {}", "", 2 * depth, name, DescribeValue(part)));
    if (part.Kind() == DataKind::kDict && depth + 1 < kShownDepth) {
      ListNames(part, depth + 1, lines);
    }
  }
}

void ListContent(const DataFile& file, Inspection& inspection) {
  std::vector<std::string> lines;
  const std::vector<std::string> names = file.Names();
  inspection.AddFact("names", fmt::format("{}", fmt::join(names, ", ")), "");
  for (const std::string& name : names) {
    if (lines.size() > kShownEntries) break;
    try {
      const DataValue value = file[name];
      lines.push_back(fmt::format("{}: {}", name, DescribeValue(value)));
      if (value.Kind() == DataKind::kDict) ListNames(value, 1, lines);
    } catch (const Error& error) {
      inspection.Fault(fmt::format("{}: {}", name, error.Problem()), error.Remedy());
    }
  }
  if (names.empty() && file.Format() != DataFormat::kNpz) {
    const DataValue root = file.Root();
    lines.push_back(root.Describe());
    // For a list of frames, show the content of the first frame only.
    if (root.Kind() == DataKind::kList && root.Size() > 0 &&
        root[std::size_t{0}].Kind() == DataKind::kDict) {
      ListNames(root[std::size_t{0}], 1, lines);
    }
  }
  if (lines.size() > kShownEntries) {
    lines.resize(kShownEntries);
    lines.push_back(fmt::format("... ({} top-level names)", names.size()));
  }
  for (std::string& line : lines) inspection.AddFact("", "", std::move(line));
}

bool IsHandVertexIds(const DataFile& file) {
  const std::vector<std::string> names = file.Names();
  return names.size() == 2 && file.Has("left_hand") && file.Has("right_hand") &&
         file["left_hand"].HoldsNumbers() && file["right_hand"].HoldsNumbers();
}

// Whether the arrays are named like network layers.
bool IsWeights(const DataFile& file) {
  const std::vector<std::string> names = file.Names();
  const auto is_layer = [](const std::string& name) {
    return name == "state_dict" || name.ends_with(".weight") || name.ends_with(".bias");
  };
  return file.Format() == DataFormat::kSafetensors || std::ranges::any_of(names, is_layer);
}

void InspectWeights(const DataFile& file, Inspection& inspection) {
  inspection.title = fmt::format("network weights ({})", DataFormatName(file.Format()));
  double numbers = 0;
  std::size_t arrays = 0;
  const auto count = [&](const DataValue& value) {
    if (!value.HoldsNumbers()) return;
    ++arrays;
    numbers += static_cast<double>(value.Array().array.NumElements());
  };
  for (const std::string& name : file.Names()) {
    const DataValue value = file[name];
    count(value);
    if (value.Kind() != DataKind::kDict) continue;
    for (const std::string& inner : value.Names()) count(value[inner]);
  }
  inspection.AddFact("tensors", static_cast<double>(arrays), "");
  inspection.AddFact("parameters", numbers,
                     fmt::format("{} arrays, {:.4g} numbers", arrays, numbers));
  inspection.Ok("all arrays are intact");
}

// Inspects a motion that import accepts, by the clip it is imported to.
void InspectMotionData(Inspection& inspection) {
  const auto body = BodyModel::Default();
  ImportFileOptions options;
  options.parameters.body = body;
  options.frame_rate = 0;
  ImportedFile imported;
  try {
    imported = ImportFile(inspection.path, options);
  } catch (const Error& error) {
    inspection.Fault(error.Problem(), error.Remedy());
    return;
  }
  const Clip& clip = imported.clip;
  inspection.title = fmt::format("{}{}", imported.format, clip.object ? ", with an object" : "");
  inspection.AddFact("format", imported.format, "");
  inspection.AddFact("frames", clip.NumFrames(),
                     fmt::format("{} frames at {:g} Hz: {:.2f} s", clip.NumFrames(),
                                 clip.frame_rate, clip.NumFrames() / clip.frame_rate));
  inspection.AddFact("frame_rate_hz", clip.frame_rate, "");
  const auto text = [&](const char* name, const std::string& value) {
    if (!value.empty()) inspection.AddFact(name, value, fmt::format("{}: {}", name, value));
  };
  text("gender", clip.gender);
  text("subject", clip.subject);
  text("action", clip.action);
  if (clip.object) text("object", clip.object->name);
  if (!imported.dropped.empty()) {
    const std::string dropped = fmt::format("{}", fmt::join(imported.dropped, ", "));
    inspection.AddFact("dropped", dropped, "not stored in a clip: " + dropped);
  }
  for (const std::string& convention : imported.conventions) inspection.Ok(convention);
  for (const std::string& note : imported.notes) {
    constexpr std::string_view kWarning = "warning: ";
    inspection.Warn(note.starts_with(kWarning) ? note.substr(kWarning.size()) : note, "");
  }

  const LooseMotion motion = LooseMotionOf(clip);
  DescribeBodyMotion(motion, *body, inspection);
  DescribeObject(motion, *body, 1.0, inspection);
  if (!imported.motion) DescribeOnBody(clip, ObjectMeshOf(imported), body, inspection);
  const std::string file = ShellWord(inspection.path), stem = ShellWord(Stem(inspection.path));
  inspection.next.push_back(fmt::format("holdfast import {} -o {}_clip.npz", file, stem));
  if (IsHandAlone(clip)) {
    ProposeForHandAlone(clip, stem + "_clip.npz", stem, inspection);
  } else if (clip.object) {
    inspection.next.push_back(fmt::format("holdfast report {}_clip.npz -o {}.html", stem, stem));
  } else {
    inspection.next.push_back(fmt::format("holdfast fit {}_clip.npz mug -o {}_held", stem, stem));
  }
}

}  // namespace

void InspectData(Inspection& inspection) {
  const FileKind kind = inspection.identity.kind;
  if (!inspection.identity.fault.empty()) {
    inspection.Fault(inspection.identity.fault, "copy it again, or fix the program that wrote it");
    return;
  }
  if (kind == FileKind::kGlb || kind == FileKind::kGltf) return InspectMotionData(inspection);
  try {
    const DataFile file(inspection.path);
    ListContent(file, inspection);
    if (inspection.Worst() == Verdict::kFault) return;
    if (file.Has("v_template") && (file.Has("weights") || file.Has("kintree_table"))) {
      return InspectModel(inspection);
    }
    if (IsHandVertexIds(file)) {
      inspection.title = "vertices of the hands in a body model, as MANO_SMPLX_vertex_ids.pkl";
      inspection.Ok("nothing to do: Holdfast knows MANO's vertices in SMPL-X");
      return;
    }
    if (IsWeights(file)) return InspectWeights(file, inspection);
  } catch (const Error& error) {
    inspection.Fault(error.Problem(), error.Remedy());
    return;
  }
  InspectMotionData(inspection);
}

namespace {

constexpr int kSmplVertices = 6890;

std::string Version(const BodyModel& model) {
  switch (model.Kind()) {
    case ModelKind::kSmplh:
      return model.NumVertices() == kSmplVertices ? "SMPL-H"
                                                  : "its own vertices, in SMPL-H's layout";
    case ModelKind::kManoRight:
      return "MANO, a right hand";
    case ModelKind::kManoLeft:
      return "MANO, a left hand";
    case ModelKind::kSmplx:
      break;
  }
  if (model.NumVertices() != kSmplxVertices) return "its own vertices, in SMPL-X's layout";
  return model.NumShape() >= 300 ? "SMPL-X v1.1" : "SMPL-X v1.0, or v1.1 cut to ten coefficients";
}

void DescribeHands(const BodyModel& model, bool has_ids, Inspection& inspection) {
  const std::string source = has_ids                                 ? "the file's own lists"
                             : model.LoneHand()                      ? "all of it"
                             : model.NumVertices() == kSmplxVertices ? "MANO's published vertices"
                                                                     : "found by skinning weights";
  inspection.AddFact("hand_vertices_source", source,
                     fmt::format("hands: {} right and {} left vertices ({})",
                                 model.HandVertexIds(Side::kRight).size(),
                                 model.HandVertexIds(Side::kLeft).size(), source));
  const bool mean = model.HandMean(Side::kRight).norm() + model.HandMean(Side::kLeft).norm() > 1e-6;
  inspection.AddFact("hand_mean", mean ? "yes" : "no", "");
  if (mean) {
    inspection.Ok("has a mean hand");
  } else {
    inspection.Warn("no mean hand (hands_meanl, hands_meanr): relaxed hands will be flat",
                    "use the file with 'hands' from the model's website, if there is one");
  }
}

}  // namespace

void InspectModel(Inspection& inspection) {
  const std::string word = ShellWord(inspection.path);
  std::shared_ptr<const BodyModel> model;
  bool has_ids = false;
  try {
    model = BodyModel::Load(inspection.path);
    const DataFile file(inspection.path);
    has_ids = file.Has("right_hand_vertex_ids") && file.Has("left_hand_vertex_ids");
  } catch (const Error& error) {
    inspection.Fault(fmt::format("{} {}", error.Where(), error.Problem()), error.Remedy());
    return;
  }
  const std::string version = Version(*model);
  inspection.title = "body model: " + version;
  inspection.AddFact("version", version, "");
  inspection.AddFact("kind", std::string(ModelKindName(model->Kind())), "");
  inspection.AddFact("joints", model->NativeJoints(),
                     fmt::format("{} joints, {} vertices, {} faces, {} shape and {} expression "
                                 "coefficients",
                                 model->NativeJoints(), model->NumVertices(), model->Faces().cols(),
                                 model->NumShape(), model->NumExpression()));
  inspection.AddFact("vertices", model->NumVertices(), "");
  inspection.AddFact("shape_coefficients", model->NumShape(), "");
  inspection.AddFact("expression_coefficients", model->NumExpression(), "");
  inspection.Ok("faces, kinematic tree and weights are valid");
  inspection.AddFact("shape_x_corrected", model->ShapeNote().empty() ? "no" : "yes", "");
  if (const std::string note = model->ShapeNote(); !note.empty()) {
    inspection.Warn(note.substr(std::string_view("warning: ").size()),
                    "nothing to do here; in other programs negate shapedirs[:, 0, :]");
  }
  const Eigen::Matrix3Xd& vertices = model->Template();
  const Eigen::Vector3d size = vertices.rowwise().maxCoeff() - vertices.rowwise().minCoeff();
  if (const auto side = model->LoneHand()) {
    inspection.AddFact("length_m", size.maxCoeff(),
                       fmt::format("{:.0f} mm long", 1e3 * size.maxCoeff()));
    if (size.maxCoeff() < 0.1 || size.maxCoeff() > 0.3) {
      inspection.Warn(fmt::format("{:.3g} is not the length of a hand in meters", size.maxCoeff()),
                      "check the model's unit");
    }
    DescribeHands(*model, has_ids, inspection);
    inspection.next.push_back(
        fmt::format("holdfast grasp mug --hand {} --body {} -o grasp.npz", SideName(*side), word));
    return;
  }
  inspection.AddFact(
      "height_m", size.y(),
      fmt::format("rest pose: {:.3f} m tall (y), arm span {:.3f} m (x)", size.y(), size.x()));
  if (size.y() < 1.2 || size.y() > 2.3) {
    inspection.Warn(
        fmt::format("{:.3g} is not the height of a person in meters with y up", size.y()),
        "check the model's unit and axes");
  }
  DescribeHands(*model, has_ids, inspection);
  inspection.next.push_back(fmt::format("holdfast body info {}", word));
  inspection.next.push_back(fmt::format("holdfast fit demo_drink mug -o held --body {}", word));
}

}  // namespace holdfast
