// SPDX-License-Identifier: MIT
#include "geometry/inspect/model_inspection.h"

#include <fmt/format.h>

#include "geometry/body/body_model.h"
#include "geometry/error.h"
#include "geometry/io/pickle/data_file.h"

namespace holdfast {
namespace {

constexpr int kSmplxVertices = 10475;
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
    inspection.Ok("a mean hand is there");
  } else {
    inspection.Warn("no mean hand (hands_meanl, hands_meanr): relaxed hands will be flat",
                    "take the file with 'hands' from the model's page if there is one");
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
  inspection.Ok("faces, kinematic tree and weights are sound");
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
      inspection.Warn(fmt::format("{:.3g} is not the length of a hand in metres", size.maxCoeff()),
                      "check the model's unit");
    }
    DescribeHands(*model, has_ids, inspection);
    inspection.next.push_back(
        fmt::format("holdfast grasp mug --hand {} --body {} -o grasp.npz", SideName(*side), word));
    return;
  }
  inspection.AddFact(
      "height_m", size.y(),
      fmt::format("rests {:.3f} m tall (y), arms {:.3f} m across (x)", size.y(), size.x()));
  if (size.y() < 1.2 || size.y() > 2.3) {
    inspection.Warn(
        fmt::format("{:.3g} is not the height of a person in metres with y up", size.y()),
        "check the model's unit and axes");
  }
  DescribeHands(*model, has_ids, inspection);
  inspection.next.push_back(fmt::format("holdfast body info {}", word));
  inspection.next.push_back(fmt::format("holdfast fit demo_drink mug -o held --body {}", word));
}

}  // namespace holdfast
