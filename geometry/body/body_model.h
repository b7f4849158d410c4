// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_layouts.h"
#include "geometry/body/skeleton.h"
#include "geometry/io/container/npz.h"
#include "geometry/mesh/mesh.h"
#include "geometry/rotation.h"

namespace holdfast {

/// Linear directions of a body model, (V, 3, K), in the precision of their file. A full SMPL-X has
/// hundreds of megabytes of them, so only requested parts are converted to double. Copies share the
/// data.
class LinearBasis {
 public:
  LinearBasis() = default;
  /// Throws Error unless `member` is (vertices, 3, columns) of finite numbers; -1 columns matches
  /// any. Adopts the buffer if it is in C order and half, float or double.
  LinearBasis(NpyMember member, std::ptrdiff_t vertices, std::ptrdiff_t columns);

  std::size_t Columns() const { return columns_; }
  /// Negates one coordinate (0 x, 1 y, 2 z) of every vertex.
  void Negate(std::size_t coordinate);
  /// Copies row 3 v + coordinate, columns [begin, begin + count).
  void CopyRow(std::size_t row, std::size_t begin, std::size_t count, double* out) const;
  /// Whether all of these entries are zero.
  bool IsZero(std::size_t row, std::size_t begin, std::size_t count) const;

 private:
  std::size_t item_size_ = 4;  // 2, 4 or 8 bytes: half, float or double
  std::size_t columns_ = 0;
  std::shared_ptr<const std::vector<std::byte>> data_;
};

/// (joint or vertex, weight) pairs.
using SparseRow = std::vector<std::pair<int, double>>;

/// Data of a body model, with SMPL-X's 55 joints (see BodyLayout). Meters.
struct BodyModelParts {
  std::string name;  ///< file name, for reports
  ModelKind kind = ModelKind::kSmplx;
  Eigen::Matrix3Xd v_template;
  Eigen::Matrix3Xi faces;
  LinearBasis shape_dirs;  ///< shape columns, then expression columns
  int num_shape = 0;
  int num_expression = 0;
  LinearBasis pose_dirs;                   ///< nine columns for each of `pose_joints`; may be empty
  std::vector<int> pose_joints;            ///< joints; nine columns each multiply R - I, row-major
  std::vector<SparseRow> joint_regressor;  ///< per joint: vertices
  std::vector<SparseRow> weights;          ///< per vertex: joints
  /// By Side.
  std::array<Eigen::Matrix<double, kHandDofs, 1>, 2> hand_mean;
  std::array<Eigen::MatrixXd, 2> hand_components;  ///< (n x 45), one per row; may be empty
  std::array<std::vector<int>, 2> hand_ids;        ///< ascending; empty if the model lacks the hand
  bool shape_x_corrected = false;                  ///< see BodyModel::ShapeNote
  std::string source;  ///< the file path as given, for messages; may be empty
};

/// A body model in the form of SMPL-X. Const, shared by any number of threads.
///
///   v_s = v_template + sum_k beta_k S_k + sum_k psi_k E_k
///   J   = J_regressor v_s
///   v_p = v_s + posedirs vec(R_1 - I, ..., R_54 - I)
///   v_i = sum_j w_ij (A_j^R v_p,i + A_j^t) + trans,  A_j = [G_j^R | G_j^t - G_j^R J_j]
///
/// (Loper et al. 2015, eq. 2-4, 9; Pavlakos et al. 2019.) The root rotates about the pelvis J_0.
/// SMPL-H and MANO are converted to bodies of the same 55 joints when read; see BodyLayout.
class BodyModel {
 public:
  /// Reads SMPL-X (v1.0, v1.1), SMPL-H and MANO as downloaded, `.npz` or `.pkl`, and any file with
  /// the same fields, which meshes/body/README.md lists. With J joints: v_template (V,3), f (F,3),
  /// weights (V,J), J_regressor (J,V), kintree_table (2,J); optional shapedirs (V,3,S), posedirs
  /// (V,3,9(J-1)), hands_meanl/r, hands_componentsl/r, right_/left_hand_vertex_ids. Any float and
  /// integer type, C or Fortran order. Throws Error, naming the field, for missing, misshapen or
  /// non-finite data, faces out of range, an unknown kinematic tree, and weights that do not sum to
  /// 1.
  ///
  /// The side of a MANO file is determined from its thumb (SideOfHand); if the thumb is flat, from
  /// "left" or "right" in its name.
  static std::shared_ptr<const BodyModel> Load(const std::filesystem::path& path);
  static constexpr std::string_view kDefaultName = "holdfast_neutral";  ///< of Default()
  /// Returns the body embedded in the library (meshes/body/holdfast_neutral.npz). It is read once,
  /// on first use.
  static std::shared_ptr<const BodyModel> Default();
  /// Returns the same model with a subject's own rest surface (3 x V); betas have no effect on it.
  /// Large data is shared. Throws Error unless it is finite and has the model's vertex count.
  static std::shared_ptr<const BodyModel> WithTemplate(std::shared_ptr<const BodyModel> model,
                                                       Eigen::Matrix3Xd v_template);

  /// The parts must be consistent; the reader of a file checks them.
  explicit BodyModel(BodyModelParts parts);

  ModelKind Kind() const { return parts_->kind; }
  /// Number of joints in the file: 55, 52 or 16.
  int NativeJoints() const {
    return static_cast<int>(LayoutOf(parts_->kind).joint_of_native.size());
  }
  /// Returns the side of a hand-only model; nothing for a body.
  std::optional<Side> LoneHand() const { return holdfast::LoneHand(parts_->kind); }
  bool HasHand(Side side) const { return !HandVertexIds(side).empty(); }
  /// Whether the rest surface is a subject's own (WithTemplate).
  bool IsSubject() const { return is_subject_; }

  int NumVertices() const { return static_cast<int>(v_template_.cols()); }
  int NumShape() const { return parts_->num_shape; }            ///< usable betas
  int NumExpression() const { return parts_->num_expression; }  ///< usable expression coefficients
  const Eigen::Matrix3Xi& Faces() const { return parts_->faces; }
  const Eigen::Matrix3Xd& Template() const { return v_template_; }
  /// Zero if the file has no mean.
  const Eigen::Matrix<double, kHandDofs, 1>& HandMean(Side side) const {
    return parts_->hand_mean[static_cast<std::size_t>(side)];
  }
  /// Principal components of hand poses (n x 45), one per row; no rows if the file has none.
  const Eigen::MatrixXd& HandComponents(Side side) const {
    return parts_->hand_components[static_cast<std::size_t>(side)];
  }
  /// Vertices of a hand, ascending: the ids in the file if present; for a 10,475-vertex SMPL-X the
  /// published MANO sets; for a MANO model all vertices; otherwise all vertices with more than half
  /// their weight on wrist and fingers.
  const std::vector<int>& HandVertexIds(Side side) const {
    return parts_->hand_ids[static_cast<std::size_t>(side)];
  }
  const std::string& Name() const { return parts_->name; }  ///< file name, for reports
  /// The file path as given, for messages; the name if there is none.
  const std::string& Source() const {
    return parts_->source.empty() ? parts_->name : parts_->source;
  }
  /// Note to report when betas are used with a MANO_LEFT as published. Its shapedirs have the x
  /// sign of the right hand (smplx issue 48); Load corrects it. Empty for every other model.
  std::string ShapeNote() const;

  /// Shaped vertices v_s (3 x V). Missing coefficients count as zero; excess coefficients throw
  /// Error unless they are zero. For a subject's surface, betas are ignored (any number) and only
  /// expression is used.
  Eigen::Matrix3Xd ShapedVertices(const Eigen::VectorXd& betas,
                                  const Eigen::VectorXd& expression = {}) const;
  /// Rest joints J (3 x 55) of shaped vertices.
  Eigen::Matrix3Xd RestJoints(const Eigen::Matrix3Xd& shaped_vertices) const;

 private:
  friend class BodySurface;

  BodyModel(std::shared_ptr<const BodyModelParts> parts, Eigen::Matrix3Xd v_template);

  std::shared_ptr<const BodyModelParts> parts_;
  Eigen::Matrix3Xd v_template_;
  bool is_subject_ = false;
};

/// Some vertices of one person: all data that is constant through a clip. Const and shareable. The
/// cost is proportional to the number of vertices.
class BodySurface {
 public:
  /// All vertices, or `vertex_ids` (in the given order). Throws Error for ids out of range.
  explicit BodySurface(std::shared_ptr<const BodyModel> model, const Eigen::VectorXd& betas = {},
                       const Eigen::VectorXd& expression = {});
  BodySurface(std::shared_ptr<const BodyModel> model, const Eigen::VectorXd& betas,
              std::span<const int> vertex_ids, const Eigen::VectorXd& expression = {});

  int NumVertices() const { return static_cast<int>(rest_.cols()); }
  const BodyModel& Model() const { return *model_; }
  const std::vector<int>& VertexIds() const { return vertex_ids_; }
  /// Triangles of the model with all three corners in the subset, in the subset's numbering.
  const Eigen::Matrix3Xi& Faces() const { return faces_; }
  const Eigen::Matrix3Xd& RestVertices() const { return rest_; }       ///< v_s, (3 x n)
  const Eigen::Matrix3Xd& RestJoints() const { return rest_joints_; }  ///< J, (3 x 55)

  /// Pose blend shapes of one joint, for the vertices that it moves.
  struct PoseDirBlock {
    int joint;                  ///< 1..54
    std::vector<int> vertices;  ///< m vertices of the subset, ascending
    Eigen::Matrix<double, Eigen::Dynamic, 9, Eigen::RowMajor> dirs;  ///< (3m x 9), R - I row-major

    /// Adds the displacements for the joint's local rotation to the surface's vertices (3 x n).
    void AddTo(Eigen::Matrix3Xd& posed, const Eigen::Matrix3d& rotation) const;
  };
  /// Blocks with any non-zero entry, by joint: dense for SMPL-X, local for the default body.
  const std::vector<PoseDirBlock>& PoseDirs() const { return pose_dirs_; }

  /// Skinning weights of vertex i: (joint, weight) pairs.
  std::span<const std::pair<int, double>> Weights(int vertex) const {
    return {weights_.data() + weight_begin_[vertex], weights_.data() + weight_begin_[vertex + 1]};
  }
  /// The concatenated pairs of all vertices, and the start of each vertex's range (n + 1).
  const std::vector<std::pair<int, double>>& AllWeights() const { return weights_; }
  const std::vector<int>& WeightBegin() const { return weight_begin_; }

 private:
  void Build(const Eigen::VectorXd& betas, const Eigen::VectorXd& expression);
  void BuildPoseDirs();

  std::shared_ptr<const BodyModel> model_;
  std::vector<int> vertex_ids_;
  Eigen::Matrix3Xi faces_;
  Eigen::Matrix3Xd rest_;
  Eigen::Matrix3Xd rest_joints_;
  std::vector<PoseDirBlock> pose_dirs_;
  std::vector<std::pair<int, double>> weights_;
  std::vector<int> weight_begin_;
};

/// Scratch and result of one evaluation; one per thread, reused from frame to frame.
struct BodyState {
  std::array<Eigen::Matrix3d, kNumJoints> local_rotation;  ///< R_j
  std::array<Eigen::Matrix3d, kNumJoints> world_rotation;  ///< G_j^R
  Eigen::Matrix<double, 3, kNumJoints> joints;             ///< G_j^t + trans, world, meters
  Eigen::Matrix<double, 3, kNumJoints> skin_offset;        ///< A_j^t + trans
  JointPose pose;                                          ///< the pose evaluated
  Eigen::Matrix3Xd posed_rest;                             ///< v_p, (3 x n)
  Eigen::Matrix3Xd vertices;                               ///< v, world, meters (3 x n)

  Eigen::Isometry3d WorldFromJoint(int joint) const {
    return RigidTransform(world_rotation[joint], joints.col(joint));
  }
};

/// Computes joint transforms only (22-joint features, retargeting): fills local/world_rotation,
/// joints, skin_offset, pose. `rest_joints` (3 x 55) as in BodySurface::RestJoints().
void ForwardJoints(const Eigen::Matrix3Xd& rest_joints, const JointPose& pose,
                   const Eigen::Vector3d& trans, BodyState& state);

/// Evaluates the whole forward model. Poses are used as given (flat_hand_mean = true); AddHandMean
/// converts the poses of files written with flat_hand_mean = false. Allocates on first use only.
void Forward(const BodySurface& surface, const JointPose& pose, const Eigen::Vector3d& trans,
             BodyState& state);

/// Returns pose + hands_mean, or pose - hands_mean, for both hands.
JointPose AddHandMean(const BodyModel& model, const JointPose& pose);
JointPose RemoveHandMean(const BodyModel& model, const JointPose& pose);

/// Row-major so that a vertex's three rows are contiguous.
using JacobianMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// d vertices / d (axis-angle of `joints`, then trans): (3n x 3|joints| + 3), including pose blend
/// shapes. `state` must hold Forward's result for the same surface.
void VertexJacobian(const BodySurface& surface, const BodyState& state, std::span<const int> joints,
                    JacobianMatrix& J_vertices_params);

/// d joints / d (axis-angle of `joints`, then trans): (165 x 3|joints| + 3).
void JointJacobian(const BodyState& state, std::span<const int> joints,
                   JacobianMatrix& J_joints_params);

}  // namespace holdfast
