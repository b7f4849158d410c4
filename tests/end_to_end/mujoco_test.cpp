// SPDX-License-Identifier: MIT
// What MuJoCo makes of the scenes that `holdfast export` writes for it.
#include <algorithm>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "tests/support/program.h"

#ifdef HOLDFAST_HAS_MUJOCO
#include <mujoco/mujoco.h>
#endif

namespace holdfast {
namespace {

using MuJoCo = testing::ProgramTest;

#ifdef HOLDFAST_HAS_MUJOCO

// A model and its state.
class Simulation {
 public:
  explicit Simulation(const std::filesystem::path& path) {
    char fault[1000] = "";
    model_ = mj_loadXML(path.c_str(), nullptr, fault, sizeof(fault));
    if (model_ == nullptr) throw std::runtime_error(fault);
    data_ = mj_makeData(model_);
  }
  ~Simulation() {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  const mjModel& Model() const { return *model_; }
  const mjData& Data() const { return *data_; }
  int Body(const char* name) const { return mj_name2id(model_, mjOBJ_BODY, name); }
  void ToKeyFrame(int key) {
    mj_resetDataKeyframe(model_, data_, key);
    mj_forward(model_, data_);
  }
  void Step() { mj_step(model_, data_); }
  Eigen::Isometry3d Pose(int body) const {
    return RigidTransform(
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data_->xmat + 9 * body),
        Eigen::Map<const Eigen::Vector3d>(data_->xpos + 3 * body));
  }

 private:
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
};

TEST_F(MuJoCo, ShowsObjectAndHandsWhereTheClipHasThem) {
  folder.Run("export demo_drink -o held.npz --end 20 -q");
  Clip clip = ReadClip(folder / "held.npz");
  ObjectTrack track;
  track.name = "mug";
  track.trans = clip.trans.colwise() + Eigen::Vector3d(0.2, -0.3, 0.1);
  track.orient = Eigen::Matrix3Xd::Constant(3, clip.NumFrames(), 0.4);
  clip.object = track;
  WriteClip(clip, folder / "held.npz");
  const auto summary = folder.Json("export held.npz -o scene.xml --every 3 --density 2000 -q");

  Simulation scene(folder / "scene.xml");
  EXPECT_EQ(scene.Model().nkey, 7);
  EXPECT_EQ(scene.Model().nmocap, 32);
  EXPECT_EQ(summary["hand_pieces"], 32);
  const int object = scene.Body("object");
  EXPECT_NEAR(scene.Model().body_mass[object], summary["object_mass_kg"].get<double>(), 1e-6);
  EXPECT_GT(scene.Model().body_mass[object], 0.1);
  EXPECT_LT(scene.Model().body_mass[object], 1.0);
  const BodySurface surface(BodyModel::Default(), Eigen::VectorXd());
  BodyState state;
  for (int key = 0; key < scene.Model().nkey; ++key) {
    const int t = 3 * key;
    scene.ToKeyFrame(key);
    EXPECT_NEAR(scene.Data().time, t / clip.frame_rate, 1e-9);
    EXPECT_TRUE(scene.Pose(object).isApprox(clip.object->Pose(t), 1e-6));
    ForwardJoints(surface.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    for (const int joint : {int{kRightWrist}, kRightHandBegin + 2, int{kLeftWrist}, 39}) {
      const int piece = scene.Body(std::string(kJointNames[joint]).c_str());
      ASSERT_GE(piece, 0) << kJointNames[joint];
      EXPECT_TRUE(scene.Pose(piece).isApprox(state.WorldFromJoint(joint), 1e-6))
          << kJointNames[joint] << " in frame " << t;
    }
  }
}

// Half a second of gravity and contact: what the hand holds stays in it.
TEST_F(MuJoCo, AGraspedBallDoesNotFall) {
  folder.Run("grasp sphere -o grip.npz -q");
  folder.Run("export grip.npz -o scene.xml -q");
  Simulation scene(folder / "scene.xml");
  scene.ToKeyFrame(0);
  const Eigen::Vector3d before = scene.Pose(scene.Body("object")).translation();
  while (scene.Data().time < 0.5) scene.Step();
  EXPECT_LT((scene.Pose(scene.Body("object")).translation() - before).norm(), 0.03);
  EXPECT_GT(scene.Data().ncon, 1);
}

// Plays a scene in MuJoCo's own loop as docs/formats.md does. The object's way in the hand, the
// most and at the end, mm, and whether it is touched then.
struct Played {
  double most_mm = 0.0;
  int contacts = 0;
};
Played Play(const std::filesystem::path& path, const char* wrist, bool follow_ctrl) {
  char fault[1000] = "";
  mjModel* const model = mj_loadXML(path.c_str(), nullptr, fault, sizeof(fault));
  EXPECT_NE(model, nullptr) << fault;
  mjData* const data = mj_makeData(model);
  const int object = mj_name2id(model, mjOBJ_BODY, "object");
  const int target = mj_name2id(model, mjOBJ_BODY, wrist);
  const auto place = [&] {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> turn(data->xmat +
                                                                              9 * target);
    return Eigen::Vector3d(turn.transpose() *
                           (Eigen::Map<const Eigen::Vector3d>(data->xipos + 3 * object) -
                            Eigen::Map<const Eigen::Vector3d>(data->xpos + 3 * target)));
  };
  mj_resetDataKeyframe(model, data, 0);
  mj_forward(model, data);
  const Eigen::Vector3d first = place();
  Played played;
  for (int key = 1; key < model->nkey; ++key) {
    std::copy_n(model->key_mpos + 3 * model->nmocap * key, 3 * model->nmocap, data->mocap_pos);
    std::copy_n(model->key_mquat + 4 * model->nmocap * key, 4 * model->nmocap, data->mocap_quat);
    if (follow_ctrl) std::copy_n(model->key_ctrl + model->nu * key, model->nu, data->ctrl);
    while (data->time < model->key_time[key]) mj_step(model, data);
    played.most_mm = std::max(played.most_mm, 1e3 * (place() - first).norm());
  }
  for (int warning = 0; warning < mjNWARNING; ++warning) {
    EXPECT_EQ(data->warning[warning].number, 0) << mju_warningText(warning, 0);
  }
  played.contacts = data->ncon;
  mj_deleteData(data);
  mj_deleteModel(model);
  return played;
}

// What passes the trial stays in the exported hand for the whole clip, in MuJoCo's own loop.
TEST_F(MuJoCo, WhatPassesTheTrialIsHeldForTheWholeClip) {
  for (const char* object : {"mug", "apple"}) {
    SCOPED_TRACE(object);
    folder.Run(std::string("fit demo_drink ") + object +
               " --drinking off -o held -f -q --no-report");
    const auto score = folder.Json("score held --physics -q");
    ASSERT_NE(score.dump().find("\"held_directions\":6"), std::string::npos) << score.dump(1);
    const auto summary = folder.Json("export held -o scene.xml -f -q");
    EXPECT_EQ(summary["simulated_hands"], 1);
    EXPECT_EQ(summary["hand_pieces"], 32);
    for (const bool follow_ctrl : {true, false}) {
      const Played played = Play(folder / "scene.xml", "right_wrist", follow_ctrl);
      EXPECT_LT(played.most_mm, 20.0) << follow_ctrl;
      EXPECT_GE(played.contacts, 2);
    }
  }
}

#else

TEST_F(MuJoCo, ShowsObjectAndHandsWhereTheClipHasThem) {
  GTEST_SKIP() << "built without MuJoCo (libmujoco-dev)";
}

#endif

}  // namespace
}  // namespace holdfast
