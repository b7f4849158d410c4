// SPDX-License-Identifier: MIT
#include "geometry/inspect/model_inspection.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "geometry/body_model.h"
#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr int kSmplxVertices = 10475;

std::string FamilyOf(std::size_t joints) {
  switch (joints) {
    case 52:
      return "SMPL-H";
    case 24:
      return "SMPL";
    case 16:
      return "MANO (one hand)";
    case 5:
      return "FLAME (head)";
    default:
      return "an unknown body model";
  }
}

void InspectOther(Inspection& inspection) {
  std::size_t joints = 0, vertices = 0;
  try {
    const NpzReader archive(inspection.path);
    if (archive.Has("kintree_table")) {
      const NpyArray array = archive.Read("kintree_table").array;
      if (!array.shape.empty()) joints = array.shape.back();
    }
    const NpyArray positions = archive.Read("v_template").array;
    if (!positions.shape.empty()) vertices = positions.shape.front();
  } catch (const Error& error) {
    inspection.Fault(fmt::format("{} {}", error.Where(), error.Problem()), error.Remedy());
    return;
  }
  inspection.title = fmt::format("body model: {} (.npz)", FamilyOf(joints));
  inspection.AddFact("joints", static_cast<double>(joints),
                     fmt::format("{} joints, {} vertices", joints, vertices));
  inspection.AddFact("vertices", static_cast<double>(vertices), "");
  inspection.Fault("Holdfast's bodies have SMPL-X's 55 joints",
                   "take SMPLX_NEUTRAL.npz, or leave --body out for the embedded body");
}

// Largest |sum of a vertex's skinning weights - 1|.
double WeightError(const std::filesystem::path& path) {
  const NpyMember member = NpzReader(path).Read("weights");
  const std::vector<double> weights = member.AsDoubles();
  const std::size_t joints = member.array.shape.back();
  double worst = 0.0;
  for (std::size_t v = 0; v + joints <= weights.size(); v += joints) {
    double sum = 0.0;
    for (std::size_t j = 0; j < joints; ++j) sum += weights[v + j];
    worst = std::max(worst, std::fabs(sum - 1.0));
  }
  return worst;
}

}  // namespace

void InspectModel(Inspection& inspection) {
  if (inspection.identity.kind == FileKind::kOtherModel) return InspectOther(inspection);
  const std::string word = ShellWord(inspection.path);
  std::shared_ptr<const BodyModel> model;
  bool has_ids = false, has_mean = false;
  double weight_error = 0.0;
  try {
    model = BodyModel::Load(inspection.path);
    weight_error = WeightError(inspection.path);
    const NpzReader archive(inspection.path);
    has_ids = archive.Has("right_hand_vertex_ids") && archive.Has("left_hand_vertex_ids");
    has_mean = archive.Has("hands_meanl") && archive.Has("hands_meanr");
  } catch (const Error& error) {
    inspection.Fault(fmt::format("{} {}", error.Where(), error.Problem()), error.Remedy());
    return;
  }
  const bool published = model->NumVertices() == kSmplxVertices;
  const bool large = model->NumShape() >= 300;
  const std::string version = !published ? "its own vertices, in SMPL-X's layout"
                              : large    ? "SMPL-X v1.1"
                                         : "SMPL-X v1.0, or v1.1 cut to ten coefficients";
  inspection.AddFact("version", version, version);
  inspection.AddFact("joints", kNumJoints,
                     fmt::format("{} joints, {} vertices, {} faces, {} shape and {} expression "
                                 "coefficients",
                                 kNumJoints, model->NumVertices(), model->Faces().cols(),
                                 model->NumShape(), model->NumExpression()));
  inspection.AddFact("vertices", model->NumVertices(), "");
  inspection.AddFact("shape_coefficients", model->NumShape(), "");
  inspection.AddFact("expression_coefficients", model->NumExpression(), "");
  const Eigen::Matrix3Xd& vertices = model->Template();
  const Eigen::Vector3d size = vertices.rowwise().maxCoeff() - vertices.rowwise().minCoeff();
  inspection.AddFact(
      "height_m", size.y(),
      fmt::format("rests {:.3f} m tall (y), arms {:.3f} m across (x)", size.y(), size.x()));
  const std::size_t right = model->HandVertexIds(Side::kRight).size();
  const std::size_t left = model->HandVertexIds(Side::kLeft).size();
  const std::string source = has_ids     ? "the file's own lists"
                             : published ? "MANO's published vertices"
                                         : "found by skinning weights";
  inspection.AddFact("hand_vertices_source", source,
                     fmt::format("hands: {} right and {} left vertices ({})", right, left, source));
  inspection.AddFact("largest_weight_sum_error", weight_error, "");
  inspection.Ok(
      fmt::format("faces, kinematic tree and weights are sound (weights sum to 1 within "
                  "{:.0e})",
                  weight_error));
  if (size.y() < 1.2 || size.y() > 2.3) {
    inspection.Warn(fmt::format("{:.3g} is no height of a person in metres with y up", size.y()),
                    "check the model's unit and axes");
  }
  const double mean = model->HandMean(Side::kRight).norm();
  inspection.AddFact("hand_mean", has_mean && mean > 1e-6 ? "yes" : "no", "");
  if (has_mean && mean > 1e-6) {
    inspection.Ok("a mean hand is there (hands_meanl, hands_meanr)");
  } else {
    inspection.Warn("no mean hand (hands_meanl, hands_meanr): relaxed hands will be flat",
                    "take the file with 'hands' from the model's page if there is one");
  }
  inspection.next.push_back(fmt::format("holdfast body info {}", word));
  inspection.next.push_back(fmt::format("holdfast fit demo_drink mug -o held --body {}", word));
}

}  // namespace holdfast
