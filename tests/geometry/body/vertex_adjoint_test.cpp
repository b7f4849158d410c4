// SPDX-License-Identifier: MIT
#include "geometry/body/body_frames.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace holdfast {
namespace {

struct PosedSubset {
  PosedSubset() {
    std::srand(7);
    pose = 0.6 * JointPose::Random();
    pose.col(kJaw).setZero();
    betas = Eigen::VectorXd::Random(std::min(model->NumShape(), 4));
    for (int v = 3; v < model->NumVertices(); v += 17) ids.push_back(v);
    d_vertices = Eigen::Matrix3Xd::Random(3, static_cast<Eigen::Index>(ids.size()));
    d_joints = Eigen::Matrix<double, 3, kNumJoints>::Random();
  }

  double Loss(const BodySurface& surface) const {
    BodyState state;
    Forward(surface, pose, trans, state);
    return d_vertices.cwiseProduct(state.vertices).sum() +
           d_joints.cwiseProduct(state.joints).sum();
  }

  std::shared_ptr<const BodyModel> model = BodyModel::Default();
  JointPose pose;
  Eigen::Vector3d trans{0.3, -1.2, 0.9};
  Eigen::VectorXd betas;
  std::vector<int> ids;
  Eigen::Matrix3Xd d_vertices;
  Eigen::Matrix<double, 3, kNumJoints> d_joints;
};

// Every number that the result has, poisoned: what is not written stays NaN.
BodyGradient Poisoned() {
  BodyGradient gradient;
  gradient.pose.setConstant(NAN);
  gradient.trans.setConstant(NAN);
  gradient.rest_vertices.setConstant(3, 5, NAN);
  gradient.rest_joints.setConstant(NAN);
  return gradient;
}

TEST(VertexAdjoint, IsTheTransposedJacobian) {
  const PosedSubset at;
  const BodySurface surface(at.model, at.betas, at.ids);
  std::vector<int> joints(kNumJoints);
  std::iota(joints.begin(), joints.end(), 0);
  for (const double scale : {0.0, 1e-9, 1.0, 4.0}) {
    BodyState state;
    Forward(surface, scale * at.pose, at.trans, state);
    JacobianMatrix J_vertices, J_joints;
    VertexJacobian(surface, state, joints, J_vertices);
    JointJacobian(state, joints, J_joints);
    const Eigen::VectorXd of_vertices = J_vertices.transpose() * at.d_vertices.reshaped();
    const Eigen::VectorXd of_joints = J_joints.transpose() * at.d_joints.reshaped();

    BodyGradient gradient = Poisoned();
    const auto error = [&](const Eigen::VectorXd& expected) {
      const Eigen::VectorXd pose = gradient.pose.reshaped();
      return std::max((pose - expected.head<3 * kNumJoints>()).cwiseAbs().maxCoeff(),
                      (gradient.trans - expected.tail<3>()).cwiseAbs().maxCoeff()) /
             expected.cwiseAbs().maxCoeff();
    };
    VertexAdjoint(surface, state, at.d_vertices, at.d_joints, gradient);
    // VertexJacobian takes the weights of a vertex to sum to 1; they do as 32-bit floats.
    EXPECT_LT(error(of_vertices + of_joints), 1e-7) << scale;
    VertexAdjoint(surface, state, at.d_vertices, Eigen::Matrix<double, 3, kNumJoints>::Zero(),
                  gradient);
    EXPECT_LT(error(of_vertices), 1e-7) << scale;
    VertexAdjoint(surface, state, Eigen::Matrix3Xd(3, 0), at.d_joints, gradient);
    EXPECT_LT(error(of_joints), 1e-10) << scale;
    EXPECT_TRUE(gradient.rest_vertices.isZero(0.0));
  }
}

TEST(VertexAdjoint, GivesTheGradientByShape) {
  const PosedSubset at;
  const BodySurface surface(at.model, at.betas, at.ids);
  BodyState state;
  Forward(surface, at.pose, at.trans, state);
  BodyGradient gradient = Poisoned();
  VertexAdjoint(surface, state, at.d_vertices, at.d_joints, gradient);
  const int count = static_cast<int>(at.betas.size());
  const Eigen::VectorXd by_betas =
      ShapeGradient(surface, gradient.rest_vertices, gradient.rest_joints, count);
  ASSERT_GT(count, 0);
  ASSERT_EQ(by_betas.size(), count);
  for (int k = 0; k < count; ++k) {
    const Eigen::VectorXd step = 1e-3 * Eigen::VectorXd::Unit(count, k);
    const auto loss = [&](const Eigen::VectorXd& betas) {
      return at.Loss(BodySurface(at.model, betas, at.ids));
    };
    const double expected = (loss(at.betas + step) - loss(at.betas - step)) / 2e-3;
    EXPECT_NEAR(by_betas[k], expected, 1e-6 * by_betas.cwiseAbs().maxCoeff()) << k;
  }
  // Betas that the model has not change nothing, and neither do those of a subject's own surface.
  const int beyond = at.model->NumShape();
  const Eigen::VectorXd more =
      ShapeGradient(surface, gradient.rest_vertices, gradient.rest_joints, beyond + 2);
  EXPECT_TRUE(more.tail<2>().isZero(0.0));
  const BodySurface subject(BodyModel::WithTemplate(at.model, at.model->ShapedVertices(at.betas)),
                            {}, at.ids);
  EXPECT_TRUE(
      ShapeGradient(subject, gradient.rest_vertices, gradient.rest_joints, count).isZero(0.0));
}

}  // namespace
}  // namespace holdfast
