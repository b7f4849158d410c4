// SPDX-License-Identifier: MIT
#include "geometry/body/body_model.h"

#include <fmt/format.h>

#include "geometry/body/body_model_reader.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/value_ranges.h"

namespace holdfast {

BodyModel::BodyModel(BodyModelParts parts)
    : parts_(std::make_shared<const BodyModelParts>(std::move(parts))),
      v_template_(parts_->v_template) {}

BodyModel::BodyModel(std::shared_ptr<const BodyModelParts> parts, Eigen::Matrix3Xd v_template)
    : parts_(std::move(parts)), v_template_(std::move(v_template)), is_subject_(true) {}

std::shared_ptr<const BodyModel> BodyModel::Load(const std::filesystem::path& path) {
  BodyModelParts parts = ReadBodyModel(BodyModelFields(path), path.stem().string());
  parts.source = path.string();
  return std::make_shared<const BodyModel>(std::move(parts));
}

std::string BodyModel::ShapeNote() const {
  if (!parts_->shape_x_corrected) return {};
  return fmt::format(
      "warning: the shape directions of {} have the right hand's x, the known fault of the "
      "published "
      "MANO_LEFT.pkl (smplx issue 48): their x is negated; betas that were fitted with the file as "
      "it is mean another hand",
      Name());
}

std::shared_ptr<const BodyModel> BodyModel::Default() {
  static const auto model = [] {
    const EmbeddedFile file = FindEmbedded(fmt::format("body/{}.npz", kDefaultName));
    return std::make_shared<const BodyModel>(ReadBodyModel(
        BodyModelFields(NpzReader(file.bytes, std::string(file.name))), std::string(kDefaultName)));
  }();
  return model;
}

std::shared_ptr<const BodyModel> BodyModel::WithTemplate(std::shared_ptr<const BodyModel> model,
                                                         Eigen::Matrix3Xd v_template) {
  if (v_template.cols() != model->NumVertices()) {
    throw Error("v_template",
                fmt::format("has {} vertices, {} has {}", v_template.cols(), model->Name(),
                            model->NumVertices()),
                "Give the body model whose vertices the subject's surface has");
  }
  const std::span<const double> values(v_template.data(),
                                       static_cast<std::size_t>(v_template.size()));
  if (FirstBeyond(values, kMaxMeters)) {
    throw Error("v_template", "holds values that are not numbers of meters",
                "Get the surface again");
  }
  return std::shared_ptr<const BodyModel>(new BodyModel(model->parts_, std::move(v_template)));
}

Eigen::Matrix3Xd BodyModel::ShapedVertices(const Eigen::VectorXd& betas,
                                           const Eigen::VectorXd& expression) const {
  const auto check = [&](const char* what, const Eigen::VectorXd& coefficients, int available) {
    const Eigen::Index given = coefficients.size();
    if (given <= available || coefficients.tail(given - available).isZero(0.0)) return;
    throw Error(Source(),
                fmt::format("has {} {} coefficients, {} were given", available, what, given),
                "Give as many as the model has, or another model");
  };
  if (!is_subject_) check("shape", betas, NumShape());
  check("expression", expression, NumExpression());
  Eigen::Matrix3Xd shaped = v_template_;
  const auto add = [&](const Eigen::VectorXd& given, int begin, int available) {
    const Eigen::VectorXd coefficients =
        given.head(std::min<Eigen::Index>(given.size(), available));
    if (coefficients.isZero(0.0)) return;
    Eigen::VectorXd row(coefficients.size());
    for (Eigen::Index i = 0; i < shaped.size(); ++i) {
      parts_->shape_dirs.CopyRow(static_cast<std::size_t>(i), static_cast<std::size_t>(begin),
                                 static_cast<std::size_t>(row.size()), row.data());
      shaped(i) += row.dot(coefficients);
    }
  };
  if (!is_subject_) add(betas, 0, NumShape());
  add(expression, NumShape(), NumExpression());
  return shaped;
}

Eigen::Matrix3Xd BodyModel::RestJoints(const Eigen::Matrix3Xd& shaped_vertices) const {
  Eigen::Matrix3Xd joints = Eigen::Matrix3Xd::Zero(3, kNumJoints);
  for (int j = 0; j < kNumJoints; ++j) {
    for (const auto& [v, w] : parts_->joint_regressor[static_cast<std::size_t>(j)]) {
      joints.col(j) += w * shaped_vertices.col(v);
    }
  }
  return joints;
}

}  // namespace holdfast
