// SPDX-License-Identifier: MIT
#include "geometry/body_model.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include <fmt/format.h>

#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/rotation.h"

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
  static constexpr int kRightMissing[] = {7452, 7453, 7454, 7455, 7457, 7458, 7460, 7461,
                                          7462, 7497, 7498, 7557, 7559, 7580, 7584, 7591,
                                          7592, 7593, 7594, 7636};
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

// d vec(R) / d w (9 x 3, R row-major) for R = exp([w]x): column m is vec([Jl e_m]x R).
Eigen::Matrix<double, 9, 3> RotationJacobian(const Eigen::Vector3d& w, const Eigen::Matrix3d& R) {
  const Eigen::Matrix3d left_jacobian = LeftJacobianSO3(w);
  Eigen::Matrix<double, 9, 3> J;
  for (int m = 0; m < 3; ++m) {
    const Eigen::Vector3d omega = left_jacobian.col(m);
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> dR = Skew(omega) * R;
    J.col(m) = dR.reshaped<Eigen::RowMajor>();
  }
  return J;
}

// World axes about which joint j turns per unit of its axis-angle: G_parent Jl(theta_j).
Eigen::Matrix3d WorldAxes(const BodyState& state, int joint) {
  const Eigen::Matrix3d left_jacobian = LeftJacobianSO3(state.pose.col(joint));
  const int parent = kJointParents[static_cast<std::size_t>(joint)];
  return parent < 0 ? left_jacobian : Eigen::Matrix3d(state.world_rotation[parent] * left_jacobian);
}

// Column of each joint's first derivative in a Jacobian, -1 for joints that are not asked for.
std::array<int, kNumJoints> ColumnOfJoint(std::span<const int> joints) {
  std::array<int, kNumJoints> column;
  column.fill(-1);
  for (std::size_t k = 0; k < joints.size(); ++k) column[joints[k]] = static_cast<int>(3 * k);
  return column;
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

BodySurface::BodySurface(std::shared_ptr<const BodyModel> model, const Eigen::VectorXd& betas,
                         const Eigen::VectorXd& expression)
    : model_(std::move(model)), vertex_ids_(model_->NumVertices()) {
  std::iota(vertex_ids_.begin(), vertex_ids_.end(), 0);
  Build(betas, expression);
}

BodySurface::BodySurface(std::shared_ptr<const BodyModel> model, const Eigen::VectorXd& betas,
                         std::span<const int> vertex_ids, const Eigen::VectorXd& expression)
    : model_(std::move(model)), vertex_ids_(vertex_ids.begin(), vertex_ids.end()) {
  Build(betas, expression);
}

void BodySurface::Build(const Eigen::VectorXd& betas, const Eigen::VectorXd& expression) {
  const Eigen::Matrix3Xd shaped = model_->ShapedVertices(betas, expression);
  rest_joints_ = model_->RestJoints(shaped);
  const int n = static_cast<int>(vertex_ids_.size());
  rest_.resize(3, n);
  weight_begin_.assign(1, 0);
  std::vector<int> local_id(model_->NumVertices(), -1);
  for (int i = 0; i < n; ++i) {
    const int v = vertex_ids_[i];
    if (v < 0 || v >= model_->NumVertices()) {
      throw Error(model_->Name(), fmt::format("has no vertex {}", v), "Check the vertex ids");
    }
    local_id[v] = i;
    rest_.col(i) = shaped.col(v);
    weights_.insert(weights_.end(), model_->weights_[v].begin(), model_->weights_[v].end());
    weight_begin_.push_back(static_cast<int>(weights_.size()));
  }

  std::vector<Eigen::Index> kept;
  for (Eigen::Index f = 0; f < model_->faces_.cols(); ++f) {
    const auto face = model_->faces_.col(f);
    if (local_id[face(0)] >= 0 && local_id[face(1)] >= 0 && local_id[face(2)] >= 0) {
      kept.push_back(f);
    }
  }
  faces_.resize(3, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t k = 0; k < kept.size(); ++k) {
    for (int c = 0; c < 3; ++c) faces_(c, k) = local_id[model_->faces_(c, kept[k])];
  }

  // One pass over the rows finds which vertices each joint moves; the second fills the blocks.
  std::vector<std::vector<int>> moved(kNumJoints);
  Eigen::Matrix<double, 3, kPoseFeatures, Eigen::RowMajor> rows;
  const auto load_rows = [&](int vertex) {
    for (int c = 0; c < 3; ++c) {
      model_->pose_dirs_.CopyRow(static_cast<std::size_t>(3 * vertex_ids_[vertex] + c), 0,
                                 kPoseFeatures, rows.row(c).data());
    }
  };
  for (int i = 0; i < n; ++i) {
    load_rows(i);
    for (int j = 1; j < kNumJoints; ++j) {
      if (!rows.middleCols<9>(9 * (j - 1)).isZero(0.0)) moved[j].push_back(i);
    }
  }
  std::vector<int> block_of_joint(kNumJoints, -1);
  for (int j = 1; j < kNumJoints; ++j) {
    if (moved[j].empty()) continue;
    block_of_joint[j] = static_cast<int>(pose_dirs_.size());
    PoseDirBlock block{j, std::move(moved[j]), {}};
    block.dirs.resize(3 * static_cast<Eigen::Index>(block.vertices.size()), 9);
    pose_dirs_.push_back(std::move(block));
  }
  std::vector<Eigen::Index> filled(pose_dirs_.size(), 0);
  for (int i = 0; i < n; ++i) {
    load_rows(i);
    for (int j = 1; j < kNumJoints; ++j) {
      if (block_of_joint[j] < 0) continue;
      PoseDirBlock& block = pose_dirs_[block_of_joint[j]];
      Eigen::Index& next = filled[block_of_joint[j]];
      if (next < static_cast<Eigen::Index>(block.vertices.size()) && block.vertices[next] == i) {
        block.dirs.middleRows<3>(3 * next++) = rows.middleCols<9>(9 * (j - 1));
      }
    }
  }
}

void ForwardJoints(const Eigen::Matrix3Xd& rest_joints, const JointPose& pose,
                   const Eigen::Vector3d& trans, BodyState& state) {
  state.pose = pose;
  for (int j = 0; j < kNumJoints; ++j) {
    state.local_rotation[j] = ExpSO3(pose.col(j));
    const int parent = kJointParents[j];
    if (parent < 0) {
      state.world_rotation[j] = state.local_rotation[j];
      state.joints.col(j) = rest_joints.col(j) + trans;
    } else {
      state.world_rotation[j].noalias() = state.world_rotation[parent] * state.local_rotation[j];
      state.joints.col(j) =
          state.world_rotation[parent] * (rest_joints.col(j) - rest_joints.col(parent)) +
          state.joints.col(parent);
    }
    state.skin_offset.col(j) = state.joints.col(j) - state.world_rotation[j] * rest_joints.col(j);
  }
}

void Forward(const BodySurface& surface, const JointPose& pose, const Eigen::Vector3d& trans,
             BodyState& state) {
  ForwardJoints(surface.RestJoints(), pose, trans, state);
  state.posed_rest = surface.RestVertices();
  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> difference =
        state.local_rotation[block.joint] - Eigen::Matrix3d::Identity();
    const Eigen::Map<const Eigen::Matrix<double, 9, 1>> feature(difference.data());
    for (std::size_t k = 0; k < block.vertices.size(); ++k) {
      state.posed_rest.col(block.vertices[k]).noalias() +=
          block.dirs.middleRows<3>(3 * static_cast<Eigen::Index>(k)) * feature;
    }
  }
  const int n = surface.NumVertices();
  state.vertices.resize(3, n);
  for (int i = 0; i < n; ++i) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& [joint, w] : surface.Weights(i)) {
      sum += w * (state.world_rotation[joint] * state.posed_rest.col(i) +
                  state.skin_offset.col(joint));
    }
    state.vertices.col(i) = sum;
  }
}

JointPose AddHandMean(const BodyModel& model, const JointPose& pose) {
  JointPose result = pose;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    result.middleCols<kJointsPerHand>(HandBegin(side)) +=
        model.HandMean(side).reshaped(3, kJointsPerHand);
  }
  return result;
}

void VertexJacobian(const BodySurface& surface, const BodyState& state,
                    std::span<const int> joints, JacobianMatrix& J_vertices_params) {
  const int n = surface.NumVertices();
  const auto trans_column = static_cast<Eigen::Index>(3 * joints.size());
  J_vertices_params.setZero(3 * n, trans_column + 3);
  const std::array<int, kNumJoints> column = ColumnOfJoint(joints);
  std::array<Eigen::Matrix3d, kNumJoints> axes;
  for (const int j : joints) axes[j] = WorldAxes(state, j);

  // Skinning: joint a carries, of vertex i, the part skinned to a and its descendants; turning a
  // by omega moves that part by omega x (sum w x - (sum w) G_a^t).
  Eigen::Matrix<double, 3, kNumJoints> carried;
  std::array<double, kNumJoints> carried_weight;
  for (int i = 0; i < n; ++i) {
    carried.setZero();
    carried_weight.fill(0.0);
    for (const auto& [joint, w] : surface.Weights(i)) {
      const Eigen::Vector3d x =
          state.world_rotation[joint] * state.posed_rest.col(i) + state.skin_offset.col(joint);
      for (int a = joint; a >= 0; a = kJointParents[a]) {
        carried.col(a) += w * x;
        carried_weight[a] += w;
      }
    }
    for (const int a : joints) {
      if (carried_weight[a] == 0.0) continue;
      const Eigen::Vector3d arm = carried.col(a) - carried_weight[a] * state.joints.col(a);
      J_vertices_params.block<3, 3>(3 * i, column[a]).noalias() = -Skew(arm) * axes[a];
    }
    J_vertices_params.block<3, 3>(3 * i, trans_column).setIdentity();
  }

  for (const BodySurface::PoseDirBlock& block : surface.PoseDirs()) {
    if (column[block.joint] < 0) continue;
    const Eigen::Matrix<double, 9, 3> J_rotation =
        RotationJacobian(state.pose.col(block.joint), state.local_rotation[block.joint]);
    for (std::size_t k = 0; k < block.vertices.size(); ++k) {
      const int i = block.vertices[k];
      Eigen::Matrix3d blend = Eigen::Matrix3d::Zero();
      for (const auto& [joint, w] : surface.Weights(i)) blend += w * state.world_rotation[joint];
      const Eigen::Matrix3d moved =
          block.dirs.middleRows<3>(3 * static_cast<Eigen::Index>(k)) * J_rotation;
      J_vertices_params.block<3, 3>(3 * i, column[block.joint]).noalias() += blend * moved;
    }
  }
}

void JointJacobian(const BodyState& state, std::span<const int> joints,
                   JacobianMatrix& J_joints_params) {
  const auto trans_column = static_cast<Eigen::Index>(3 * joints.size());
  J_joints_params.setZero(3 * kNumJoints, trans_column + 3);
  const std::array<int, kNumJoints> column = ColumnOfJoint(joints);
  for (const int a : joints) {
    const Eigen::Matrix3d axes = WorldAxes(state, a);
    for (int j = a + 1; j < kNumJoints; ++j) {
      int ancestor = kJointParents[j];
      while (ancestor > a) ancestor = kJointParents[ancestor];
      if (ancestor != a) continue;
      const Eigen::Vector3d arm = state.joints.col(j) - state.joints.col(a);
      J_joints_params.block<3, 3>(3 * j, column[a]).noalias() = -Skew(arm) * axes;
    }
  }
  for (int j = 0; j < kNumJoints; ++j) {
    J_joints_params.block<3, 3>(3 * j, trans_column).setIdentity();
  }
}

}  // namespace holdfast
