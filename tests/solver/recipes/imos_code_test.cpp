// SPDX-License-Identifier: MIT
#include "solver/recipes/imos_code.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/container/npz.h"
#include "geometry/rotation.h"
#include "tests/support/hand_scene.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using testing::HandScene;

// The scene's body in its first frame, and turned, moved and with other fingers in a second.
struct TwoFrames {
  explicit TwoFrames(bool move_fingers) : state(scene.hand) {
    start = FingersOf(scene.pose, Side::kRight);
    state.SetBody(scene.pose, scene.trans);
    state.Evaluate(start, false);
    distances =
        HandObjectDistance::Distances(InObjectFrame(state.Vertices(), scene.object_pose.orientation,
                                                    scene.object_pose.translation),
                                      scene.object);
    const Eigen::Vector3d pelvis =
        BodySurface(scene.model, {}, std::vector<int>{}).RestJoints().col(0);
    turn = ExpSO3({0.1, -0.2, 0.5});
    shift = {0.2, 0.1, -0.05};
    next = scene.pose;
    next.col(0) = LogSO3(turn * ExpSO3(scene.pose.col(0)));
    next_trans = turn * (pelvis + scene.trans) + shift - pelvis;
    state.SetBody(next, next_trans);
    fingers = start;
    if (move_fingers) {
      for (int k = 0; k < kHandDofs; ++k) fingers(k) += 0.15 * std::sin(1.7 * k);
    }
    state.Evaluate(fingers, false);
  }

  Eigen::Matrix3Xd Posed(const ObjectPose& pose) const {
    return (pose.orientation.toRotationMatrix() * scene.object).colwise() + pose.translation;
  }
  ObjectPose Truth() const {
    return {Eigen::Quaterniond(turn) * scene.object_pose.orientation,
            turn * scene.object_pose.translation + shift};
  }

  HandScene scene;
  HandState state;
  FingerPose start, fingers;
  Eigen::MatrixXd distances;
  Eigen::Matrix3d turn;
  Eigen::Vector3d shift, next_trans;
  JointPose next;
};

TEST(ImosCode, ObjectStageRecoversARigidMotion) {
  TwoFrames frames(false);
  const HandObjectDistance distance(frames.scene.object, frames.distances, 1.0,
                                    PairPrecision::kDouble);
  ObjectPose pose = frames.scene.object_pose;
  EXPECT_GT(FitImosObject(frames.state, distance, {}, pose), 1);
  EXPECT_LT((pose.translation - frames.Truth().translation).norm(), 1e-7);
  EXPECT_LT(pose.orientation.angularDistance(frames.Truth().orientation), 1e-6);
}

// Points as NumPy has them: one row a point.
void AddPoints(NpzWriter& writer, const char* key, const Eigen::Matrix3Xd& points) {
  writer.AddFloat64(key, {static_cast<std::size_t>(points.cols()), 3},
                    {points.data(), points.data() + points.size()});
}

TEST(ImosCode, BothStagesAgreeWithNumpyAndScipy) {
  if (std::system("/usr/bin/python3 -c 'import scipy' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3-scipy is not installed";
  }
  TwoFrames frames(true);
  const Eigen::Matrix3Xd hand = frames.state.Vertices();
  const HandObjectDistance distance(frames.scene.object, frames.distances, 1.0,
                                    PairPrecision::kDouble);
  ObjectPose pose = frames.scene.object_pose;
  FitImosObject(frames.state, distance, {}, pose);
  std::vector<VertexQuadratic> quadratics(static_cast<std::size_t>(hand.cols()),
                                          {Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero(), 0.0});
  const double cost =
      0.5 * distance.Add(InObjectFrame(hand, pose.orientation, pose.translation), quadratics);
  FingerPose bent = frames.fingers;
  for (int k = 0; k < kHandDofs; ++k) bent(k) += 0.05 * std::cos(0.9 * k);
  ImosFingerLoss loss(frames.state, frames.Posed(pose), frames.fingers, 0.005, 0.005, 0.01);
  const double value = loss.Evaluate(bent, nullptr);
  const Eigen::Matrix3Xd bent_vertices = frames.state.Vertices();
  const Eigen::Matrix3Xd far = frames.Posed(pose).array() + 1.0;
  const double value_apart =
      ImosFingerLoss(frames.state, far, frames.fingers, 0.005, 0.005, 0.01).Evaluate(bent, nullptr);

  NpzWriter writer;
  AddPoints(writer, "hand", hand);
  AddPoints(writer, "object", frames.scene.object);
  AddPoints(writer, "posed", frames.Posed(pose));
  AddPoints(writer, "fingers", bent_vertices);
  // Eigen's (M x N) in columns is NumPy's (N, M); the script wants (M, N).
  const Eigen::MatrixXd rows = frames.distances.transpose();
  writer.AddFloat64("distances",
                    {static_cast<std::size_t>(rows.cols()), static_cast<std::size_t>(rows.rows())},
                    {rows.data(), rows.data() + rows.size()});
  const Eigen::Vector3d aa = LogSO3(frames.scene.object_pose.orientation.toRotationMatrix());
  const Eigen::Vector3d t = frames.scene.object_pose.translation;
  writer.AddFloat64("start", {6}, {aa.x(), aa.y(), aa.z(), t.x(), t.y(), t.z()});
  const testing::TemporaryFolder folder;
  writer.Write(folder / "scene.npz");
  ASSERT_EQ(
      std::system(("/usr/bin/python3 '" HOLDFAST_SOURCE_DIR
                   "/tests/solver/recipes/imos_code_reference.py' '" +
                   (folder / "scene.npz").string() + "' > '" + (folder / "out.json").string() + "'")
                      .c_str()),
      0);
  std::ifstream text(folder / "out.json");
  const auto found = nlohmann::json::parse(text);

  EXPECT_GT(cost, 1e-3);  // fingers moved: nothing fits exactly
  EXPECT_NEAR(cost, found["cost"].get<double>(), 1e-8 * cost);
  Eigen::Matrix3d R;
  Eigen::Vector3d T;
  for (int r = 0; r < 3; ++r) {
    T(r) = found["translation"][r];
    for (int c = 0; c < 3; ++c) R(r, c) = found["rotation"][r][c];
  }
  EXPECT_LT((pose.translation - T).norm(), 2e-5);
  EXPECT_LT(AngleBetween(pose.orientation.toRotationMatrix(), R), 2e-4);
  EXPECT_NEAR(value, found["loss"].get<double>(), 1e-12 * value);
  EXPECT_NEAR(value_apart, found["loss_apart"].get<double>(), 1e-10 * value_apart);
  EXPECT_GT(value, 0.0);
}

TEST(ImosFingerLoss, VanishesAtTheStartButForContact) {
  TwoFrames frames(false);
  const Eigen::Matrix3Xd object = frames.Posed(frames.Truth());
  FingerPose gradient = FingerPose::Constant(NAN);
  ImosFingerLoss without(frames.state, object, frames.start, 0.0, 0.005, 0.01);
  EXPECT_EQ(without.Evaluate(frames.start, &gradient), 0.0);
  EXPECT_EQ(gradient.norm(), 0.0);
  ImosFingerLoss with(frames.state, object, frames.start, 0.005, 0.005, 0.01);
  const double value = with.Evaluate(frames.start, &gradient);
  EXPECT_GT(value, 0.0);
  EXPECT_LT(value, 0.005 * 0.01);  // a mean of distances below tau
  EXPECT_GT(gradient.norm(), 0.0);
}

TEST(ImosFingerLoss, GradientIsThatOfCentralDifferences) {
  TwoFrames frames(true);
  const Eigen::Matrix3Xd object = frames.Posed(frames.Truth());
  ImosFingerLoss loss(frames.state, object, frames.start, 0.005, 0.005, 0.01);
  FingerPose gradient = FingerPose::Constant(NAN);
  loss.Evaluate(frames.fingers, &gradient);
  FingerPose numeric;
  // So small that no vertex changes its neighbor and no pair passes tau.
  constexpr double kStep = 1e-8;
  for (int k = 0; k < kHandDofs; ++k) {
    FingerPose moved = frames.fingers;
    moved(k) += kStep;
    const double above = loss.Evaluate(moved, nullptr);
    moved(k) -= 2.0 * kStep;
    numeric(k) = (above - loss.Evaluate(moved, nullptr)) / (2.0 * kStep);
  }
  EXPECT_LT((gradient - numeric).norm(), 1e-5 * numeric.norm());
}

TEST(Rotation6d, IsTheFirstTwoRowsAndComesBack) {
  const Eigen::Matrix3d R = ExpSO3({0.3, -1.2, 0.7});
  const Rotation6d x = To6d(R);
  EXPECT_EQ(x(1), R(0, 1));
  EXPECT_EQ(x(5), R(1, 2));
  EXPECT_LT((From6d(x, nullptr) - R).norm(), 1e-14);
  Rotation6d scaled = x;
  scaled.head<3>() *= 2.0;
  scaled.tail<3>() = 0.5 * x.tail<3>() + 0.3 * x.head<3>();
  EXPECT_LT((From6d(scaled, nullptr) - R).norm(), 1e-14);
}

TEST(Rotation6d, DerivativeIsThatOfCentralDifferences) {
  Rotation6d x = To6d(ExpSO3({0.3, -1.2, 0.7}));
  x += 0.2 * Rotation6d(1, -2, 0.5, 0.3, 1, -1);  // not orthonormal
  Eigen::Matrix<double, 3, 6> J, numeric;
  const Eigen::Matrix3d R = From6d(x, &J);
  for (int k = 0; k < 6; ++k) {
    const Rotation6d step = 1e-6 * Rotation6d::Unit(k);
    numeric.col(k) = (LogSO3(From6d(x + step, nullptr) * R.transpose()) -
                      LogSO3(From6d(x - step, nullptr) * R.transpose())) /
                     2e-6;
  }
  EXPECT_LT((J - numeric).norm(), 1e-8);
}

TEST(ReferenceAdamTest, FirstStepsAreItsLearningRateAndMomentsStay) {
  ReferenceAdam adam(2);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(2);
  adam.Step(Eigen::Vector2d(3.0, -1e-3), 0.1, x);
  EXPECT_NEAR(x(0), -0.1, 1e-6);
  EXPECT_NEAR(x(1), 0.1, 1e-5);
  adam.Step(Eigen::Vector2d(0.0, 0.0), 0.1, x);  // goes on by what it remembers
  EXPECT_LT(x(0), -0.15);
}

TEST(ImosCode, ReferenceFrameIsTheLastBeforeTheObjectMoves) {
  ObjectTrack track;
  track.trans.setZero(3, 4);
  EXPECT_EQ(ImosReferenceFrame(track, 4), 2);
  EXPECT_EQ(ImosReferenceFrame(track, 1), 0);
  track.trans(2, 3) = -0.002;
  EXPECT_EQ(ImosReferenceFrame(track, 4), 2);
  track.trans.col(1) = Eigen::Vector3d(0, 0, 0.0011);
  EXPECT_EQ(ImosReferenceFrame(track, 4), 0);
}

Clip MovingClip(const TwoFrames& frames, int count) {
  Clip clip;
  clip.frame_rate = 10.0;
  clip.trans.resize(3, count);
  clip.object.emplace();
  clip.object->trans.setZero(3, count);
  clip.object->orient.setZero(3, count);
  for (int t = 0; t < count; ++t) {
    clip.pose.push_back(t == 0 ? frames.scene.pose : frames.next);
    clip.trans.col(t) = t == 0 ? frames.scene.trans : frames.next_trans;
  }
  clip.object->trans.col(0) = frames.scene.object_pose.translation;
  clip.object->orient.col(0) = LogSO3(frames.scene.object_pose.orientation.toRotationMatrix());
  return clip;
}

TEST(FitClipImosCode, ObjectFollowsARigidHandAndFingersComeCloser) {
  const TwoFrames frames(false);
  const FitResult result =
      FitClipImosCode(MovingClip(frames, 3), frames.scene.hand, frames.scene.object);
  ASSERT_EQ(result.frames.size(), 3u);
  EXPECT_EQ(result.frames[0].stop, StopReason::kGiven);
  const Eigen::Matrix3Xd object = frames.Posed(frames.Truth());
  HandState state(frames.scene.hand);
  state.SetBody(frames.next, frames.next_trans);
  ImosFingerLoss loss(state, object, frames.start, 0.005, 0.005, 0.01);
  for (int t = 1; t < 3; ++t) {
    EXPECT_EQ(result.frames[t].stop, StopReason::kConverged);
    // The object is placed against the start fingers: what they do later does not move it.
    EXPECT_LT((result.clip.object->trans.col(t) - frames.Truth().translation).norm(), 1e-6);
    const FingerPose fingers = FingersOf(result.clip.pose[t], Side::kRight);
    EXPECT_GT((fingers - frames.start).norm(), 1e-3);
    EXPECT_LT(loss.Evaluate(fingers, nullptr), 0.9 * loss.Evaluate(frames.start, nullptr));
  }
  // The second of two equal frames starts with the moments of the first: it ends elsewhere.
  EXPECT_NE(FingersOf(result.clip.pose[1], Side::kRight),
            FingersOf(result.clip.pose[2], Side::kRight));
}

TEST(FitClipImosCode, WithoutStepsKeepsTheStartFingers) {
  const TwoFrames frames(false);
  ImosCodeOptions options;
  options.finger_steps = 1;  // the last step is not used
  const FitResult result =
      FitClipImosCode(MovingClip(frames, 2), frames.scene.hand, frames.scene.object, options);
  EXPECT_EQ(FingersOf(result.clip.pose[1], Side::kRight), frames.start);
  EXPECT_LT(result.frames[1].energies[EnergyTerm::kDistance], 1e-10);
}

TEST(FitClipImosCode, GivenFramesAreKept) {
  const TwoFrames frames(false);
  Clip clip = MovingClip(frames, 3);
  clip.object->trans.col(1) = frames.Truth().translation + Eigen::Vector3d(0.01, 0, 0);
  clip.object->orient.col(1) = LogSO3(frames.Truth().orientation.toRotationMatrix());
  ImosCodeOptions options;
  options.given_frames = 2;
  options.finger_steps = 2;
  const FitResult result = FitClipImosCode(clip, frames.scene.hand, frames.scene.object, options);
  EXPECT_LT((result.clip.object->trans.col(1) - clip.object->trans.col(1)).norm(), 1e-15);
  EXPECT_EQ(result.frames[1].stop, StopReason::kGiven);
  EXPECT_LT((result.clip.object->trans.col(2) - frames.Truth().translation).norm(), 1e-6);
}

TEST(FitClipImosCode, StopsWhenAskedAndRefusesWhatItCannotFit) {
  const TwoFrames frames(false);
  const Clip clip = MovingClip(frames, 3);
  ImosCodeOptions options;
  options.finger_steps = 2;
  const FitResult stopped = FitClipImosCode(clip, frames.scene.hand, frames.scene.object, options,
                                            [](int done, int) { return done < 2; });
  EXPECT_EQ(stopped.clip.NumFrames(), 2);
  EXPECT_EQ(stopped.frames.size(), 2u);
  Clip without = clip;
  without.object.reset();
  EXPECT_THROW(FitClipImosCode(without, frames.scene.hand, frames.scene.object), Error);
  EXPECT_THROW(FitClipImosCode(clip, frames.scene.hand, Eigen::Matrix3Xd(3, 0)), Error);
}

}  // namespace
}  // namespace holdfast
