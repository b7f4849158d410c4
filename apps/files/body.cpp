// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "apps/common.h"

namespace holdfast::apps {
namespace {

struct BodyCommand {
  CommonOptions common;
  std::string model;
};

int RunInfo(const BodyCommand& options) {
  const auto body = LoadBody(options.model);
  if (const std::string note = body->ShapeNote(); !note.empty()) Note(options.common, note);
  const Eigen::Matrix3Xd joints = body->RestJoints(body->Template());
  const Eigen::Matrix3Xd& vertices = body->Template();
  const Eigen::Vector3d low = vertices.rowwise().minCoeff(), high = vertices.rowwise().maxCoeff();
  const double pelvis_height = joints(1, 0) - low.y();

  nlohmann::json summary = JsonHead("holdfast/body-info/1", options.common);
  summary["model"] = body->Name();
  summary["vertices"] = body->NumVertices();
  summary["faces"] = body->Faces().cols();
  summary["kind"] = ModelKindName(body->Kind());
  summary["joints"] = body->NativeJoints();
  summary["shape_coefficients"] = body->NumShape();
  summary["expression_coefficients"] = body->NumExpression();
  summary["right_hand_vertices"] = body->HandVertexIds(Side::kRight).size();
  summary["left_hand_vertices"] = body->HandVertexIds(Side::kLeft).size();
  summary["shape_x_corrected"] = !body->ShapeNote().empty();
  summary["height_m"] = high.y() - low.y();
  summary["span_m"] = high.x() - low.x();
  if (!body->LoneHand()) summary["pelvis_above_sole_m"] = pelvis_height;
  const std::string size =
      body->LoneHand()
          ? fmt::format("{:.3f} m long", (high - low).maxCoeff())
          : fmt::format("height {:.3f} m, arm span {:.3f} m, pelvis {:.3f} m above the sole",
                        high.y() - low.y(), high.x() - low.x(), pelvis_height);
  PrintResult(options.common, summary,
              fmt::format("{} ({}): {} vertices, {} faces, {} joints\n"
                          "  shape coefficients       {}\n"
                          "  expression coefficients  {}\n"
                          "  hand vertices            {} right, {} left\n"
                          "  {}\n",
                          body->Name(), ModelKindName(body->Kind()), body->NumVertices(),
                          body->Faces().cols(), body->NativeJoints(), body->NumShape(),
                          body->NumExpression(), body->HandVertexIds(Side::kRight).size(),
                          body->HandVertexIds(Side::kLeft).size(), size));
  return kDone;
}

}  // namespace

void AddBodyCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<BodyCommand>();
  CLI::App* command = app.add_subcommand("body", "Inspect body models");
  command->require_subcommand(1);
  CLI::App* info = command->add_subcommand("info", "Print the contents of a body model");
  info->add_option(
      "model", options->model,
      "SMPL-X, SMPL-H or MANO as downloaded (.npz, .pkl); the embedded body if left out");
  AddCommonOptions(*info, options->common, false,
                   "  holdfast body info\n"
                   "  holdfast body info SMPLX_NEUTRAL.npz --json\n");
  info->callback([options, &exit_code] { exit_code = RunInfo(*options); });
}

}  // namespace holdfast::apps
