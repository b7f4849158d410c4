// SPDX-License-Identifier: MIT
#include "geometry/body/body_model.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/support/error_text.h"
#include "tests/support/synthetic_body.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::SyntheticBody;
using testing::TemporaryFolder;

JointPose RandomPose(unsigned seed, double scale = 0.6) {
  std::srand(seed);
  return scale * JointPose::Random();
}

// The forward model once more, as slowly and literally as the equations are written: homogeneous
// 4 x 4 matrices, dense sums over every joint and feature, rotations through quaternions.
Eigen::Matrix3Xd LiteralForward(const SyntheticBody& body, const Eigen::VectorXd& betas,
                                const Eigen::VectorXd& expression, const JointPose& pose,
                                const Eigen::Vector3d& trans, Eigen::Matrix3Xd* joints_out) {
  const int V = body.num_vertices, S = body.num_directions;
  const auto at = [](const std::vector<double>& a, int i) {
    return a[static_cast<std::size_t>(i)];
  };
  Eigen::Matrix3Xd shaped(3, V);
  for (int v = 0; v < V; ++v) {
    for (int c = 0; c < 3; ++c) {
      double x = at(body.v_template, 3 * v + c);
      for (int k = 0; k < betas.size(); ++k) {
        x += betas(k) * at(body.shapedirs, (3 * v + c) * S + k);
      }
      for (int k = 0; k < expression.size(); ++k) {
        x += expression(k) * at(body.shapedirs, (3 * v + c) * S + (S >= 400 ? 300 : 10) + k);
      }
      shaped(c, v) = x;
    }
  }
  Eigen::Matrix3Xd J = Eigen::Matrix3Xd::Zero(3, kNumJoints);
  for (int j = 0; j < kNumJoints; ++j) {
    for (int v = 0; v < V; ++v) J.col(j) += at(body.regressor, j * V + v) * shaped.col(v);
  }
  std::vector<Eigen::Matrix4d> G(kNumJoints);
  Eigen::VectorXd feature(486);
  for (int j = 0; j < kNumJoints; ++j) {
    const double angle = pose.col(j).norm();
    const Eigen::Matrix3d R =
        Eigen::Quaterniond(Eigen::AngleAxisd(angle, pose.col(j).normalized())).toRotationMatrix();
    Eigen::Matrix4d local = Eigen::Matrix4d::Identity();
    local.topLeftCorner<3, 3>() = R;
    const int parent = kJointParents[j];
    local.topRightCorner<3, 1>() =
        parent < 0 ? J.col(j) : Eigen::Vector3d(J.col(j) - J.col(parent));
    G[j] = parent < 0 ? local : Eigen::Matrix4d(G[parent] * local);
    if (j == 0) continue;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) feature(9 * (j - 1) + 3 * r + c) = R(r, c) - (r == c ? 1.0 : 0.0);
    }
  }
  Eigen::Matrix3Xd out = Eigen::Matrix3Xd::Zero(3, V);
  for (int v = 0; v < V; ++v) {
    Eigen::Vector4d x;
    for (int c = 0; c < 3; ++c) {
      x(c) = shaped(c, v);
      for (int k = 0; k < 486; ++k) x(c) += at(body.posedirs, (3 * v + c) * 486 + k) * feature(k);
    }
    x(3) = 1.0;
    for (int j = 0; j < kNumJoints; ++j) {
      Eigen::Matrix4d back = Eigen::Matrix4d::Identity();
      back.topRightCorner<3, 1>() = -J.col(j);
      out.col(v) += at(body.weights, v * kNumJoints + j) * (G[j] * back * x).head<3>();
    }
    out.col(v) += trans;
  }
  joints_out->resize(3, kNumJoints);
  for (int j = 0; j < kNumJoints; ++j) joints_out->col(j) = G[j].topRightCorner<3, 1>() + trans;
  return out;
}

class BodyModelTest : public ::testing::Test {
 protected:
  std::shared_ptr<const BodyModel> Load(const SyntheticBody& body,
                                        SyntheticBody::Storage storage = {}) {
    body.Write(folder_ / "model.npz", storage);
    return BodyModel::Load(folder_ / "model.npz");
  }
  TemporaryFolder folder_;
};

TEST_F(BodyModelTest, AgreesWithTheLiteralEquations) {
  const SyntheticBody body;
  const auto model = Load(body);
  ASSERT_EQ(model->NumShape(), 10);
  ASSERT_EQ(model->NumExpression(), 10);
  Eigen::VectorXd betas(10), expression(10);
  for (int k = 0; k < 10; ++k) {
    betas(k) = std::sin(1.0 + k);
    expression(k) = std::cos(2.0 * k);
  }
  const BodySurface surface(model, betas, expression);
  BodyState state;
  for (const double scale : {0.0, 1e-9, 0.4, 2.5}) {
    const JointPose pose = RandomPose(3, scale);
    const Eigen::Vector3d trans(0.3, -1.2, 0.9);
    Forward(surface, pose, trans, state);
    Eigen::Matrix3Xd joints;
    const Eigen::Matrix3Xd expected = LiteralForward(body, betas, expression, pose, trans, &joints);
    EXPECT_LT((state.vertices - expected).norm(), 1e-11 * expected.norm()) << scale;
    EXPECT_LT((state.joints - joints).norm(), 1e-11 * joints.norm()) << scale;
  }
}

TEST_F(BodyModelTest, ReadsTheShapesOfBothSmplxVersions) {
  const SyntheticBody v11(24, 400);
  const auto model = Load(v11);
  EXPECT_EQ(model->NumShape(), 300);
  EXPECT_EQ(model->NumExpression(), 100);
  Eigen::VectorXd betas = Eigen::VectorXd::LinSpaced(300, -1.0, 1.0);
  Eigen::VectorXd expression = Eigen::VectorXd::LinSpaced(100, 1.0, -1.0);
  BodyState state;
  Forward(BodySurface(model, betas, expression), RandomPose(1), Eigen::Vector3d::Zero(), state);
  Eigen::Matrix3Xd joints;
  const Eigen::Matrix3Xd expected =
      LiteralForward(v11, betas, expression, RandomPose(1), Eigen::Vector3d::Zero(), &joints);
  EXPECT_LT((state.vertices - expected).norm(), 1e-11 * expected.norm());
}

TEST_F(BodyModelTest, ReadsEveryStorageAlike) {
  const SyntheticBody body;
  const auto reference = Load(body);
  BodyState expected;
  Forward(BodySurface(reference), RandomPose(5), Eigen::Vector3d::Zero(), expected);
  for (const SyntheticBody::Storage storage :
       {SyntheticBody::Storage{'f', 8, true, false}, SyntheticBody::Storage{'f', 8, false, true},
        SyntheticBody::Storage{'f', 8, true, true}, SyntheticBody::Storage{'f', 4, false, false},
        SyntheticBody::Storage{'f', 4, true, true}}) {
    const auto model = Load(body, storage);
    BodyState state;
    Forward(BodySurface(model), RandomPose(5), Eigen::Vector3d::Zero(), state);
    const double tolerance = storage.item_size == 8 ? 0.0 : 1e-6;
    EXPECT_LE((state.vertices - expected.vertices).cwiseAbs().maxCoeff(), tolerance);
    EXPECT_EQ(model->Faces(), reference->Faces());
  }
}

TEST_F(BodyModelTest, ASubsetIsTheSameBodyWithFewerVertices) {
  const auto model = Load(SyntheticBody());
  const std::vector<int> ids = {40, 3, 17, 18, 19, 20};
  const Eigen::VectorXd betas = Eigen::VectorXd::Constant(10, 0.5);
  BodyState whole, part;
  Forward(BodySurface(model, betas), RandomPose(2), {1, 2, 3}, whole);
  const BodySurface subset(model, betas, ids);
  Forward(subset, RandomPose(2), {1, 2, 3}, part);
  for (std::size_t k = 0; k < ids.size(); ++k) {
    EXPECT_TRUE(part.vertices.col(static_cast<int>(k)) == whole.vertices.col(ids[k]));
  }
  // Strip triangles (v, v+1, v+2): of these ids only 17-18-19 and 18-19-20 are whole.
  ASSERT_EQ(subset.Faces().cols(), 2);
  EXPECT_EQ(subset.Faces().col(0), Eigen::Vector3i(2, 3, 4));
}

TEST_F(BodyModelTest, VertexJacobianMatchesCentralDifferences) {
  const auto model = Load(SyntheticBody());
  const std::vector<int> ids = {1, 5, 9, 30};
  const BodySurface surface(model, Eigen::VectorXd::Constant(10, -0.3), ids);
  std::vector<int> joints;
  for (int j = 0; j < kNumJoints; ++j) joints.push_back(j);
  for (const double scale : {0.0, 1e-8, 0.7, 1.8}) {
    const JointPose pose = RandomPose(11, scale);
    const Eigen::Vector3d trans(0.1, 0.2, 0.3);
    BodyState state;
    Forward(surface, pose, trans, state);
    JacobianMatrix J = JacobianMatrix::Constant(1, 1, NAN), J_joints;
    VertexJacobian(surface, state, joints, J);
    JointJacobian(state, joints, J_joints);
    ASSERT_EQ(J.rows(), 3 * surface.NumVertices());
    ASSERT_EQ(J.cols(), 3 * kNumJoints + 3);
    const double h = 1e-6;
    for (int column = 0; column < J.cols(); ++column) {
      BodyState plus, minus;
      JointPose pose_plus = pose, pose_minus = pose;
      Eigen::Vector3d trans_plus = trans, trans_minus = trans;
      if (column < 3 * kNumJoints) {
        pose_plus(column) += h;
        pose_minus(column) -= h;
      } else {
        trans_plus(column - 3 * kNumJoints) += h;
        trans_minus(column - 3 * kNumJoints) -= h;
      }
      Forward(surface, pose_plus, trans_plus, plus);
      Forward(surface, pose_minus, trans_minus, minus);
      const Eigen::VectorXd numeric = (plus.vertices - minus.vertices).reshaped() / (2.0 * h);
      const Eigen::VectorXd numeric_joints = (plus.joints - minus.joints).reshaped() / (2.0 * h);
      EXPECT_LT((J.col(column) - numeric).cwiseAbs().maxCoeff(), 2e-9) << column << " " << scale;
      EXPECT_LT((J_joints.col(column) - numeric_joints).cwiseAbs().maxCoeff(), 2e-9)
          << column << " " << scale;
    }
  }
}

TEST_F(BodyModelTest, AddsTheHandMeanOnRequestOnly) {
  const SyntheticBody body;
  const auto model = Load(body);
  const JointPose pose = AddHandMean(*model, JointPose::Zero());
  EXPECT_DOUBLE_EQ(pose(0, kRightHandBegin), body.hand_mean_right[0]);
  EXPECT_DOUBLE_EQ(pose(2, kLeftHandBegin + 14), body.hand_mean_left[44]);
  EXPECT_TRUE(pose.leftCols(kLeftHandBegin).isZero(0.0));
  EXPECT_TRUE(RemoveHandMean(*model, pose).isZero(1e-15));
}

TEST_F(BodyModelTest, DoesNotAllocateAfterTheFirstFrame) {
  const auto model = Load(SyntheticBody());
  const BodySurface surface(model);
  BodyState state;
  Forward(surface, RandomPose(1), Eigen::Vector3d::Zero(), state);
  const double* posed = state.posed_rest.data();
  const double* vertices = state.vertices.data();
  Forward(surface, RandomPose(2), Eigen::Vector3d::Zero(), state);
  EXPECT_EQ(posed, state.posed_rest.data());
  EXPECT_EQ(vertices, state.vertices.data());
}

TEST_F(BodyModelTest, ASubjectsSurfaceIsTheShape) {
  const SyntheticBody body;
  const auto model = Load(body);
  const Eigen::Matrix3Xd surface = model->ShapedVertices(Eigen::VectorXd::Constant(10, 0.4));
  const auto subject = BodyModel::WithTemplate(model, surface);
  EXPECT_TRUE(subject->IsSubject());
  EXPECT_FALSE(model->IsSubject());
  // Betas, even too many, change nothing; expression does.
  const Eigen::VectorXd smile = Eigen::VectorXd::Constant(10, 0.3);
  EXPECT_EQ(subject->ShapedVertices(Eigen::VectorXd::Ones(500)), surface);
  EXPECT_NE(subject->ShapedVertices({}, smile), surface);
  BodyState of_subject, of_betas;
  Forward(BodySurface(subject, {}, smile), RandomPose(4), {1, 2, 3}, of_subject);
  Forward(BodySurface(model, Eigen::VectorXd::Constant(10, 0.4), smile), RandomPose(4), {1, 2, 3},
          of_betas);
  EXPECT_LT((of_subject.vertices - of_betas.vertices).norm(), 1e-12);
  EXPECT_THROW(BodyModel::WithTemplate(model, surface.leftCols(59)), Error);
  Eigen::Matrix3Xd bad = surface;
  bad(1, 7) = NAN;
  EXPECT_THROW(BodyModel::WithTemplate(model, bad), Error);
}

TEST_F(BodyModelTest, ReadsAnyNumberOfVerticesAndDoesWithoutBlendShapes) {
  const SyntheticBody large(20000, 3);
  large.Write(folder_ / "large.npz", {'f', 4, false, false});
  const auto model = BodyModel::Load(folder_ / "large.npz");
  EXPECT_EQ(model->NumVertices(), 20000);
  EXPECT_EQ(model->NumShape(), 3);
  EXPECT_GT(model->HandVertexIds(Side::kRight).size(), 0u);

  const SyntheticBody body;
  body.Write(folder_ / "plain.npz");
  const NpzReader whole(folder_ / "plain.npz");
  NpzWriter needed;
  for (const char* key : {"v_template", "f", "weights", "J_regressor", "kintree_table"}) {
    needed.Add(key, whole.Read(key).array);
  }
  needed.Write(folder_ / "needed.npz");
  const auto plain = BodyModel::Load(folder_ / "needed.npz");
  EXPECT_EQ(plain->NumShape(), 0);
  const BodySurface surface(plain);
  EXPECT_TRUE(surface.PoseDirs().empty());
  SyntheticBody without = body;
  std::ranges::fill(without.posedirs, 0.0);
  BodyState state;
  Forward(surface, RandomPose(6), {1, 2, 3}, state);
  Eigen::Matrix3Xd joints;
  const Eigen::Matrix3Xd expected =
      LiteralForward(without, {}, {}, RandomPose(6), {1, 2, 3}, &joints);
  EXPECT_LT((state.vertices - expected).norm(), 1e-11 * expected.norm());
}

TEST_F(BodyModelTest, SaysWhichFieldIsAtFault) {
  const SyntheticBody body;
  const auto expect = [&](const char* message, const std::function<void(NpzWriter&)>& change) {
    body.Write(folder_ / "bad.npz", {}, change);
    EXPECT_THAT(testing::ErrorText([&] { BodyModel::Load(folder_ / "bad.npz"); }),
                HasSubstr(message));
  };
  const auto V = static_cast<std::size_t>(body.num_vertices);
  const auto with = [](std::vector<double> values, std::size_t place, double value) {
    values[place] = value;
    return values;
  };
  expect("[v_template]: holds nan", [&](NpzWriter& w) {
    w.AddFloat64("v_template", {V, 3}, with(body.v_template, 7, NAN));
  });
  expect("[posedirs]: holds inf", [&](NpzWriter& w) {
    w.AddFloat64("posedirs", {V, 3, 486}, with(body.posedirs, 1000, INFINITY));
  });
  expect("[posedirs]: holds -inf at element 1000", [&](NpzWriter& w) {
    std::vector<float> bad(body.posedirs.size(), 0.5f);
    bad[1000] = -INFINITY;
    w.AddFloat16("posedirs", {V, 3, 486}, bad);
  });
  const auto narrow = [&](NpzWriter& w) {
    w.AddFloat64("posedirs", {V, 3, 207}, std::vector<double>(V * 3 * 207));
  };
  expect("[posedirs]: has shape", narrow);
  for (const auto& [corner, message] :
       {std::pair{999, "refers to vertex 999, but the model has 60"},
        {-1, "refers to vertex -1"}}) {
    expect(message, [id = corner](NpzWriter& w) { w.AddInt64("f", {1, 3}, {0, 1, id}); });
  }
  expect("Skinning weights sum to 1", [&](NpzWriter& w) {
    w.AddFloat64("weights", {V, kNumJoints}, std::vector<double>(V * kNumJoints, 0.1));
  });
  // Of two faults always the same one is told, though posedirs is read on another thread.
  for (int round = 0; round < 20; ++round) {
    expect("[weights]: has shape", [&](NpzWriter& w) {
      narrow(w);
      w.AddFloat64("weights", {V, 1}, std::vector<double>(V, 1.0));
    });
  }
  for (const auto& [joints, message] :
       {std::pair{std::size_t{kNumJoints}, "SMPL-X's 55-joint tree"},
        {std::size_t{24}, "[kintree_table]: has shape (2, 24)"}}) {
    expect(message, [n = joints](NpzWriter& w) {
      w.AddInt64("kintree_table", {2, n}, std::vector<std::int64_t>(2 * n, 0));
    });
  }
  EXPECT_THROW(BodyModel::Load(folder_ / "missing.npz"), Error);
  const auto model = Load(body);
  EXPECT_THAT(testing::ErrorText([&] { BodySurface(model, Eigen::VectorXd::Ones(11)); }),
              ::testing::StartsWith((folder_ / "model.npz").string() + ": "));
  // Zeros beyond what the model has are no shape: AMASS writes 16 whatever the model.
  Eigen::VectorXd betas = Eigen::VectorXd::Zero(16);
  betas[2] = 0.7;
  EXPECT_EQ(model->ShapedVertices(betas), model->ShapedVertices(betas.head(3)));
  EXPECT_THROW(BodySurface(model, {}, std::vector<int>{60}), Error);
}

TEST(SmplxHandVertices, AreManosOwn) {
  // Sums and counts of the published correspondence file.
  const testing::SyntheticBody body(10475, 20);
  const testing::TemporaryFolder folder;
  body.Write(folder / "smplx.npz", {'f', 4, false, false});
  const auto model = BodyModel::Load(folder / "smplx.npz");
  const auto sum = [](const std::vector<int>& ids) {
    return std::accumulate(ids.begin(), ids.end(), std::int64_t{0});
  };
  EXPECT_EQ(model->HandVertexIds(Side::kLeft).size(), 778u);
  EXPECT_EQ(model->HandVertexIds(Side::kRight).size(), 778u);
  EXPECT_EQ(sum(model->HandVertexIds(Side::kLeft)), 3889228);
  EXPECT_EQ(sum(model->HandVertexIds(Side::kRight)), 6017748);
}

}  // namespace
}  // namespace holdfast
