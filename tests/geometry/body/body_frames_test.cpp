// SPDX-License-Identifier: MIT
#include "geometry/body/body_frames.h"

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/synthetic_body.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

static_assert(SharedFramesTogether(1) == 4);
static_assert(SharedFramesTogether(145) == 19);  // eight shares: two threads have as many each
static_assert(SharedFramesTogether(100'000) == kFramesTogether);

// Frames of a body: what one at a time gives, which is what many have to give.
struct PosedFrames {
  PosedFrames(std::shared_ptr<const BodyModel> model, int frames)
      : surface(std::move(model), Eigen::VectorXd::Ones(2)),
        trans(Eigen::Matrix3Xd::Random(3, frames)),
        d_vertices(Eigen::Matrix3Xd::Random(3, surface.NumVertices() * frames)),
        d_joints(Eigen::Matrix3Xd::Random(3, kNumJoints * frames)),
        states(static_cast<std::size_t>(frames)),
        gradients(states.size()) {
    for (int t = 0; t < frames; ++t) {
      poses.push_back(0.5 * JointPose::Random());
      Forward(surface, poses.back(), trans.col(t), states[t]);
      VertexAdjoint(surface, states[t],
                    d_vertices.middleCols(surface.NumVertices() * t, surface.NumVertices()),
                    d_joints.middleCols<kNumJoints>(kNumJoints * t), gradients[t]);
    }
  }

  BodySurface surface;
  std::vector<JointPose> poses;
  Eigen::Matrix3Xd trans, d_vertices, d_joints;
  std::vector<BodyState> states;
  std::vector<BodyGradient> gradients;
};

// Every bit where products are not contracted on the way: on x86, unless it is asked for.
template <typename A>
void ExpectSame(const A& got, const A& want, const char* what) {
  ASSERT_EQ(got.size(), want.size()) << what;
#if defined(__x86_64__) && !defined(__FMA__)
  EXPECT_TRUE((got.array() == want.array()).all()) << what;
#else
  EXPECT_TRUE((got - want).isZero(1e-11)) << what;
#endif
}

void ExpectWithin(const Eigen::Matrix3Xd& got, const Eigen::Matrix3Xd& want, double off,
                  const char* what) {
  if (off == 0.0) return ExpectSame(got, want, what);
  ASSERT_EQ(got.size(), want.size()) << what;
  EXPECT_LT((got - want).cwiseAbs().maxCoeff(), off) << what;
}

// `off`: what v_p and v may differ by, meters; 0 for every bit.
void ExpectAsOneAtATime(const std::shared_ptr<const BodyModel>& model, int frames, double off) {
  std::srand(3);
  const PosedFrames want(model, frames);
  for (const Isa isa : {Isa::kSse2, Isa::kAvx2, Isa::kAvx512}) {
    if (!IsSupported(isa) && isa != Isa::kSse2) continue;
    std::vector<BodyState> states(want.states.size());
    ForwardFrames(want.surface, want.poses, want.trans, states, isa);
    std::vector<BodyGradient> gradients(states.size());
    VertexAdjointFrames(want.surface, want.states, want.d_vertices, want.d_joints, gradients, isa);
    for (std::size_t t = 0; t < states.size(); ++t) {
      SCOPED_TRACE(::testing::Message() << IsaName(isa) << ", frame " << t << " of " << frames);
      ExpectSame(states[t].joints, want.states[t].joints, "joints");
      ExpectWithin(states[t].posed_rest, want.states[t].posed_rest, off, "posed rest");
      ExpectWithin(states[t].vertices, want.states[t].vertices, off, "vertices");
      ExpectSame(gradients[t].pose, want.gradients[t].pose, "by pose");
      ExpectSame(gradients[t].trans, want.gradients[t].trans, "by trans");
      ExpectSame(gradients[t].rest_vertices, want.gradients[t].rest_vertices, "by vertices");
      ExpectSame(gradients[t].rest_joints, want.gradients[t].rest_joints, "by joints");
    }
  }
}

TEST(BodyFrames, DenseBlendShapesAreAsOneFrameAtATime) {
  const testing::TemporaryFolder folder;
  const std::filesystem::path file = folder / "body.npz";
  testing::SyntheticBody(150).Write(file);  // vertices of several tiles
  const std::shared_ptr<const BodyModel> model = BodyModel::Load(file);
  ExpectAsOneAtATime(model, 1, 0.0);
  for (const int frames : {2, 8, 19}) ExpectAsOneAtATime(model, frames, 1e-7);  // of centimeters
}

TEST(BodyFrames, SparseBlendShapesAreAsOneFrameAtATime) {
  ExpectAsOneAtATime(BodyModel::Default(), 3, 0.0);
}

TEST(BodyFrames, NoFramesAndNoDerivativesByVertices) {
  const BodySurface surface(BodyModel::Default(), Eigen::VectorXd());
  ForwardFrames(surface, {}, Eigen::Matrix3Xd(3, 0), {});
  std::vector<BodyState> states(2);
  const std::vector<JointPose> poses(2, JointPose::Zero());
  ForwardFrames(surface, poses, Eigen::Matrix3Xd::Zero(3, 2), states);
  std::vector<BodyGradient> gradients(2);
  VertexAdjointFrames(surface, states, Eigen::Matrix3Xd(3, 0),
                      Eigen::Matrix3Xd::Ones(3, 2 * kNumJoints), gradients);
  EXPECT_EQ(gradients[1].trans, Eigen::Vector3d::Constant(kNumJoints));
  EXPECT_TRUE(gradients[1].rest_vertices.isZero(0.0));
}

}  // namespace
}  // namespace holdfast
