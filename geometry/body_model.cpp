// SPDX-License-Identifier: MIT
#include "geometry/body_model.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "geometry/embedded.h"
#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr int kPoseFeatures = 9 * (kNumJoints - 1);
constexpr int kSmplxVertices = 10475;

void RequireFinite(const NpyMember& member, const std::vector<double>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) {
      throw Error(member.where, fmt::format("holds {} at element {}", values[i], i),
                  "The model file is damaged: get it again");
    }
  }
}

std::vector<double> ReadFinite(const NpzReader& archive, std::string_view key,
                               const std::vector<std::ptrdiff_t>& shape) {
  const NpyMember member = archive.Read(key);
  member.RequireShape(shape);
  std::vector<double> values = member.AsDoubles();
  RequireFinite(member, values);
  return values;
}

Eigen::Matrix<double, kHandDofs, 1> ReadHandMean(const NpzReader& archive, const char* key) {
  if (!archive.Has(key)) return Eigen::Matrix<double, kHandDofs, 1>::Zero();
  return Eigen::Map<const Eigen::Matrix<double, kHandDofs, 1>>(
      ReadFinite(archive, key, {kHandDofs}).data());
}

// MANO's 778 vertices within SMPL-X: a range without the vertices that MANO does not have.
std::vector<int> SmplxHandIds(Side side) {
  static constexpr int kRightMissing[] = {7452, 7453, 7454, 7455, 7457, 7458, 7460,
                                          7461, 7462, 7497, 7498, 7557, 7559, 7580,
                                          7584, 7591, 7592, 7593, 7594, 7636};
  static constexpr int kLeftMissing[] = {4716, 4717, 4718, 4719, 4721, 4722, 4724, 4725,
                                         4726, 4761, 4762, 4821, 4823, 4844, 4848, 4855,
                                         4856, 4857, 4858, 4900, 5349, 5350};
  const bool right = side == Side::kRight;
  const std::span<const int> missing =
      right ? std::span<const int>(kRightMissing) : std::span<const int>(kLeftMissing);
  std::vector<int> ids;
  for (int v = right ? 7331 : 4595; v <= (right ? 8128 : 5394); ++v) {
    if (std::find(missing.begin(), missing.end(), v) == missing.end()) ids.push_back(v);
  }
  return ids;
}

std::vector<int> ReadHandIds(const NpzReader& archive, Side side, int num_vertices) {
  const std::string key = fmt::format("{}_hand_vertex_ids", SideName(side));
  if (!archive.Has(key)) return {};
  const NpyMember member = archive.Read(key);
  member.RequireShape({-1});
  std::vector<int> ids;
  for (const std::int64_t id : member.AsIntegers()) {
    if (id < 0 || id >= num_vertices) {
      throw Error(member.where, fmt::format("names vertex {} of {}", id, num_vertices),
                  "Vertex ids count from 0");
    }
    ids.push_back(static_cast<int>(id));
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

void RequireSmplxTree(const NpzReader& archive) {
  const NpyMember member = archive.Read("kintree_table");
  member.RequireShape({2, kNumJoints});
  const std::vector<std::int64_t> table = member.AsIntegers();
  for (int j = 1; j < kNumJoints; ++j) {  // entry 0 is 2^32 - 1 or -1: no parent
    if (table[static_cast<std::size_t>(j)] != kJointParents[static_cast<std::size_t>(j)]) {
      throw Error(member.where,
                  fmt::format("gives joint {} ({}) the parent {}", j, kJointNames[j], table[j]),
                  "A model with SMPL-X's 55-joint tree is needed (not SMPL, SMPL-H or MANO)");
    }
  }
}

}  // namespace

void BodyModel::Basis::CopyRow(std::size_t row, std::size_t begin, std::size_t count,
                               double* out) const {
  const std::size_t first = row * columns + begin;
  if (is_double) {
    std::memcpy(out, data.data() + first * sizeof(double), count * sizeof(double));
    return;
  }
  float value;
  for (std::size_t k = 0; k < count; ++k) {
    std::memcpy(&value, data.data() + (first + k) * sizeof(float), sizeof value);
    out[k] = value;
  }
}

BodyModel::Basis BodyModel::ReadBasis(const NpzReader& archive, const char* key,
                                      std::ptrdiff_t vertices, std::ptrdiff_t columns) {
  NpyMember member = archive.Read(key);
  member.RequireShape({vertices, 3, columns});
  NpyArray& array = member.array;
  Basis basis;
  basis.columns = array.shape[2];
  basis.is_double = array.kind != 'f' || array.item_size == 8;
  const bool as_stored =
      array.kind == 'f' && array.item_size >= 4 && !array.big_endian && !array.fortran_order;
  const auto take = [&](const auto& values) {
    basis.data.resize(values.size() * sizeof(values[0]));
    if (!values.empty()) std::memcpy(basis.data.data(), values.data(), basis.data.size());
  };
  if (as_stored) {
    basis.data = std::move(array.data);
  } else if (basis.is_double) {
    take(member.AsDoubles());
  } else {
    take(member.AsFloats());
  }
  std::vector<double> row(basis.columns);
  for (std::size_t r = 0; r < static_cast<std::size_t>(3 * vertices); ++r) {
    basis.CopyRow(r, 0, basis.columns, row.data());
    RequireFinite(member, row);
  }
  return basis;
}

std::shared_ptr<const BodyModel> BodyModel::Load(const std::filesystem::path& path) {
  return FromArchive(NpzReader(path), path.stem().string());
}

std::shared_ptr<const BodyModel> BodyModel::Default() {
  const EmbeddedFile file = FindEmbedded("body/holdfast_neutral.npz");
  return FromArchive(NpzReader(file.bytes, std::string(file.name)), "holdfast_neutral");
}

std::shared_ptr<const BodyModel> BodyModel::FromArchive(const NpzReader& archive,
                                                        std::string name) {
  auto model = std::make_shared<BodyModel>();
  model->name_ = std::move(name);
  RequireSmplxTree(archive);

  const std::vector<double> positions = ReadFinite(archive, "v_template", {-1, 3});
  model->template_vertices_ = Eigen::Map<const Eigen::Matrix3Xd>(
      positions.data(), 3, static_cast<Eigen::Index>(positions.size() / 3));
  const int num_vertices = model->NumVertices();
  if (num_vertices == 0) {
    throw Error(archive.Path().string(), "has no vertices", "Get the model file again");
  }

  const NpyMember faces = archive.Read("f");
  faces.RequireShape({-1, 3});
  const std::vector<std::int64_t> corners = faces.AsIntegers();
  model->faces_.resize(3, static_cast<Eigen::Index>(corners.size() / 3));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (corners[i] < 0 || corners[i] >= num_vertices) {
      throw Error(faces.where, fmt::format("names vertex {} of {}", corners[i], num_vertices),
                  "The model file is damaged: get it again");
    }
    model->faces_(static_cast<Eigen::Index>(i)) = static_cast<int>(corners[i]);
  }

  model->shape_dirs_ = ReadBasis(archive, "shapedirs", num_vertices, -1);
  const auto directions = static_cast<int>(model->shape_dirs_.columns);
  // v1.1 has 300 shape and 100 expression directions, v1.0 ten and ten.
  const int shape_columns = directions >= 400 ? 300 : 10;
  model->num_shape_ = std::min(directions, shape_columns);
  model->expression_begin_ = model->num_shape_;
  model->num_expression_ = std::min(directions - model->num_shape_, directions >= 400 ? 100 : 10);
  model->pose_dirs_ = ReadBasis(archive, "posedirs", num_vertices, kPoseFeatures);

  const std::vector<double> regressor =
      ReadFinite(archive, "J_regressor", {kNumJoints, num_vertices});
  model->joint_regressor_.resize(kNumJoints);
  for (int j = 0; j < kNumJoints; ++j) {
    for (int v = 0; v < num_vertices; ++v) {
      const double w = regressor[static_cast<std::size_t>(j) * num_vertices + v];
      if (w != 0.0) model->joint_regressor_[j].emplace_back(v, w);
    }
  }

  const std::vector<double> weights = ReadFinite(archive, "weights", {num_vertices, kNumJoints});
  model->weights_.resize(num_vertices);
  for (int v = 0; v < num_vertices; ++v) {
    double sum = 0.0;
    for (int j = 0; j < kNumJoints; ++j) {
      const double w = weights[static_cast<std::size_t>(v) * kNumJoints + j];
      sum += w;
      if (w != 0.0) model->weights_[v].emplace_back(j, w);
    }
    if (std::fabs(sum - 1.0) > 1e-3) {
      throw Error(fmt::format("{}[weights]", archive.Path().string()),
                  fmt::format("of vertex {} sum to {}", v, sum), "Skinning weights sum to 1");
    }
  }

  model->right_hand_mean_ = ReadHandMean(archive, "hands_meanr");
  model->left_hand_mean_ = ReadHandMean(archive, "hands_meanl");
  for (const Side side : {Side::kRight, Side::kLeft}) {
    std::vector<int> ids = ReadHandIds(archive, side, num_vertices);
    if (ids.empty() && num_vertices == kSmplxVertices) ids = SmplxHandIds(side);
    if (ids.empty()) {
      for (int v = 0; v < num_vertices; ++v) {
        double on_hand = 0.0;
        for (const auto& [joint, w] : model->weights_[v]) {
          const bool finger = joint >= HandBegin(side) && joint < HandBegin(side) + kJointsPerHand;
          if (finger || joint == WristJoint(side)) on_hand += w;
        }
        if (on_hand > 0.5) ids.push_back(v);
      }
    }
    (side == Side::kRight ? model->right_hand_ids_ : model->left_hand_ids_) = std::move(ids);
  }
  return model;
}

Eigen::Matrix3Xd BodyModel::ShapedVertices(const Eigen::VectorXd& betas,
                                           const Eigen::VectorXd& expression) const {
  const auto check = [&](const char* what, Eigen::Index given, int available) {
    if (given <= available) return;
    throw Error(name_, fmt::format("has {} {} coefficients, {} were given", available, what, given),
                "Give as many as the model has, or another model");
  };
  check("shape", betas.size(), num_shape_);
  check("expression", expression.size(), num_expression_);
  Eigen::Matrix3Xd shaped = template_vertices_;
  const auto add = [&](const Eigen::VectorXd& coefficients, int begin) {
    if (coefficients.size() == 0 || coefficients.isZero(0.0)) return;
    Eigen::VectorXd row(coefficients.size());
    for (Eigen::Index i = 0; i < shaped.size(); ++i) {
      shape_dirs_.CopyRow(static_cast<std::size_t>(i), static_cast<std::size_t>(begin),
                          static_cast<std::size_t>(row.size()), row.data());
      shaped(i) += row.dot(coefficients);
    }
  };
  add(betas, 0);
  add(expression, expression_begin_);
  return shaped;
}

Eigen::Matrix3Xd BodyModel::RestJoints(const Eigen::Matrix3Xd& shaped_vertices) const {
  Eigen::Matrix3Xd joints = Eigen::Matrix3Xd::Zero(3, kNumJoints);
  for (int j = 0; j < kNumJoints; ++j) {
    for (const auto& [v, w] : joint_regressor_[j]) joints.col(j) += w * shaped_vertices.col(v);
  }
  return joints;
}

}  // namespace holdfast
