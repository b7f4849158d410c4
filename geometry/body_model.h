// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "geometry/io/npz.h"
#include "geometry/mesh.h"
#include "geometry/skeleton.h"

namespace holdfast {

/// A body model file of SMPL-X's layout: const, shared by any number of threads.
///
///   v_s = v_template + sum_k beta_k S_k + sum_k psi_k E_k
///   J   = J_regressor v_s
///   v_p = v_s + posedirs vec(R_1 - I, ..., R_54 - I)
///   v_i = sum_j w_ij (A_j^R v_p,i + A_j^t) + trans,  A_j = [G_j^R | G_j^t - G_j^R J_j]
///
/// (Loper et al. 2015, eq. 2-4, 9; Pavlakos et al. 2019.) The root turns about the pelvis J_0.
class BodyModel {
 public:
  /// Reads `SMPLX_*.npz` (v1.0 and v1.1) or any file with the same fields: v_template (V,3), f
  /// (F,3), shapedirs (V,3,S), posedirs (V,3,486), J_regressor (55,V), weights (V,55),
  /// kintree_table (2,55); optional hands_meanl/r (45), right_/left_hand_vertex_ids. Any float and
  /// integer type, C or Fortran order. Throws Error naming the field for missing, misshapen or
  /// non-finite data, faces out of range, a kinematic tree that is not SMPL-X's, and weights that
  /// do not sum to 1.
  static std::shared_ptr<const BodyModel> Load(const std::filesystem::path& path);
  /// The body that comes with Holdfast (meshes/body/holdfast_neutral.npz, inside the library).
  static std::shared_ptr<const BodyModel> Default();

  int NumVertices() const { return static_cast<int>(template_vertices_.cols()); }
  int NumShape() const { return num_shape_; }            ///< usable betas
  int NumExpression() const { return num_expression_; }  ///< usable expression coefficients
  const Eigen::Matrix3Xi& Faces() const { return faces_; }
  const Eigen::Matrix3Xd& Template() const { return template_vertices_; }
  const Eigen::Matrix<double, kHandDofs, 1>& HandMean(Side side) const {
    return side == Side::kRight ? right_hand_mean_ : left_hand_mean_;
  }
  /// Vertices of a hand, ascending. From the file where it has them, the published MANO sets for a
  /// 10,475-vertex SMPL-X, else all vertices with more than half their weight on wrist and fingers.
  const std::vector<int>& HandVertexIds(Side side) const {
    return side == Side::kRight ? right_hand_ids_ : left_hand_ids_;
  }
  const std::string& Name() const { return name_; }  ///< file name, for reports

  /// Shaped vertices v_s (3 x V). Coefficients beyond the model's throw Error; fewer count as zero.
  Eigen::Matrix3Xd ShapedVertices(const Eigen::VectorXd& betas,
                                  const Eigen::VectorXd& expression = {}) const;
  /// Rest joints J (3 x 55) of shaped vertices.
  Eigen::Matrix3Xd RestJoints(const Eigen::Matrix3Xd& shaped_vertices) const;

 private:
  friend class BodySurface;

  /// Rows of a (V,3,K) tensor in the precision of the file; only rows in use become doubles.
  struct Basis {
    bool is_double = false;
    std::size_t columns = 0;
    std::vector<std::byte> data;
    void CopyRow(std::size_t row, std::size_t begin, std::size_t count, double* out) const;
  };

  static std::shared_ptr<const BodyModel> FromArchive(const NpzReader& archive, std::string name);
  static Basis ReadBasis(const NpzReader& archive, const char* key, std::ptrdiff_t vertices,
                         std::ptrdiff_t columns);

  std::string name_;
  Eigen::Matrix3Xd template_vertices_;
  Eigen::Matrix3Xi faces_;
  Basis shape_dirs_;
  int num_shape_ = 0;
  int num_expression_ = 0;
  int expression_begin_ = 0;  // column of the first expression direction
  Basis pose_dirs_;
  std::vector<std::vector<std::pair<int, double>>> joint_regressor_;  // per joint: vertex, weight
  std::vector<std::vector<std::pair<int, double>>> weights_;          // per vertex: joint, weight
  Eigen::Matrix<double, kHandDofs, 1> right_hand_mean_, left_hand_mean_;
  std::vector<int> right_hand_ids_, left_hand_ids_;
};

/// Some vertices of one person: all that stays constant through a clip. Const and shareable.
/// Costs what its vertices cost: a hand costs a hand.
class BodySurface {
 public:
  /// All vertices, or those in `vertex_ids` (any order, kept). Throws Error for ids out of range.
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
  };
  /// Blocks with any non-zero entry, by joint: dense for SMPL-X, local for the default body.
  const std::vector<PoseDirBlock>& PoseDirs() const { return pose_dirs_; }

  /// Skinning weights of vertex i: (joint, weight) pairs.
  std::span<const std::pair<int, double>> Weights(int vertex) const {
    return {weights_.data() + weight_begin_[vertex], weights_.data() + weight_begin_[vertex + 1]};
  }

 private:
  void Build(const Eigen::VectorXd& betas, const Eigen::VectorXd& expression);

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
  Eigen::Matrix<double, 3, kNumJoints> joints;             ///< G_j^t + trans, world, metres
  Eigen::Matrix<double, 3, kNumJoints> skin_offset;        ///< A_j^t + trans
  JointPose pose;                                          ///< the pose evaluated
  Eigen::Matrix3Xd posed_rest;                             ///< v_p, (3 x n)
  Eigen::Matrix3Xd vertices;                               ///< v, world, metres (3 x n)
};

/// Joint transforms only (22-joint features, retargeting): fills local/world_rotation, joints,
/// skin_offset, pose. `rest_joints` (3 x 55) as in BodySurface::RestJoints().
void ForwardJoints(const Eigen::Matrix3Xd& rest_joints, const JointPose& pose,
                   const Eigen::Vector3d& trans, BodyState& state);

/// The whole forward model. Poses are taken as they are (flat_hand_mean = true); AddHandMean gives
/// the pose of files that were written with flat_hand_mean = false. Allocates on first use only.
void Forward(const BodySurface& surface, const JointPose& pose, const Eigen::Vector3d& trans,
             BodyState& state);

/// pose + hands_mean of both hands.
JointPose AddHandMean(const BodyModel& model, const JointPose& pose);

/// Row-major so that a vertex's three rows are contiguous.
using JacobianMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// d vertices / d (axis-angle of `joints`, then trans): (3n x 3|joints| + 3), pose blend shapes
/// included. `state` must hold Forward's result for the same surface.
void VertexJacobian(const BodySurface& surface, const BodyState& state, std::span<const int> joints,
                    JacobianMatrix& J_vertices_params);

/// d joints / d (axis-angle of `joints`, then trans): (165 x 3|joints| + 3).
void JointJacobian(const BodyState& state, std::span<const int> joints,
                   JacobianMatrix& J_joints_params);

}  // namespace holdfast
