// SPDX-License-Identifier: MIT
// Robot hands against MuJoCo: where links are, how points of them move, and scenes that it loads.
#ifdef HOLDFAST_HAS_MUJOCO

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "geometry/robot/robot_hand.h"
#include "geometry/robot/robot_kinematics.h"
#include "geometry/rotation.h"
#include "tests/support/data_folder.h"
#include "tests/support/program.h"
#include "tests/support/robot_files.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using testing::BoxHand;
using testing::DataFolder;

using RobotMujoco = testing::ProgramTest;

// The same file with what MuJoCo needs said: meshes by their paths, links kept, masses made up.
mjModel* LoadUrdf(const fs::path& path, bool discard_visual = true) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  std::string urdf = text.str();
  const std::string discard = discard_visual ? "true" : "false";
  urdf.insert(urdf.rfind("</robot>"),
              "<mujoco><compiler strippath=\"false\" fusestatic=\"false\" discardvisual=\"" +
                  discard +
                  "\" balanceinertia=\"true\" boundmass=\"1e-4\" boundinertia=\"1e-6\"/>"
                  "</mujoco>");
  const fs::path copy = path.parent_path() / "for_mujoco.urdf";
  std::ofstream(copy) << urdf;
  std::array<char, 1000> why{};
  mjModel* const model = mj_loadXML(copy.c_str(), nullptr, why.data(), 1000);
  EXPECT_NE(model, nullptr) << why.data();
  return model;
}

void ExpectSameMotion(const fs::path& path) {
  const RobotHand hand = ReadRobotHand(path);
  mjModel* const model = LoadUrdf(path);
  ASSERT_NE(model, nullptr);
  mjData* const data = mj_makeData(model);
  RobotState state(hand);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  int compared = 0;
  for (int trial = 0; trial < 4; ++trial) {
    Eigen::VectorXd q(hand.NumDofs());
    for (int k = 0; k < hand.NumDofs(); ++k) {
      q(k) = hand.dofs[k].low + share(random) * (hand.dofs[k].high - hand.dofs[k].low);
    }
    state.Evaluate(q);
    for (const RobotLink& link : hand.links) {
      const int joint = mj_name2id(model, mjOBJ_JOINT, link.joint.c_str());
      if (link.dof < 0 || joint < 0) continue;
      data->qpos[model->jnt_qposadr[joint]] = link.factor * q(link.dof) + link.offset;
    }
    mj_kinematics(model, data);
    mj_comPos(model, data);
    for (int k = 0; k < hand.NumLinks(); ++k) {
      const int body = mj_name2id(model, mjOBJ_BODY, hand.links[k].name.c_str());
      if (body < 0) continue;  // the root is MuJoCo's world
      const Eigen::Map<const Eigen::Vector3d> place(data->xpos + 3 * body);
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> turn(data->xmat +
                                                                                9 * body);
      EXPECT_LT((state.RootFromLink(k).translation() - place).norm(), 1e-9);
      EXPECT_LT((state.RootFromLink(k).linear() - turn).norm(), 1e-9);
      const Eigen::Vector3d point = state.RootFromLink(k) * Eigen::Vector3d(0.01, 0.02, 0.03);
      Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> J(3, model->nv);
      mj_jac(model, data, J.data(), nullptr, point.data(), body);
      Eigen::Matrix3Xd followed = Eigen::Matrix3Xd::Zero(3, hand.NumDofs());
      for (const RobotLink& link : hand.links) {
        const int joint = mj_name2id(model, mjOBJ_JOINT, link.joint.c_str());
        if (link.dof < 0 || joint < 0) continue;
        followed.col(link.dof) += link.factor * J.col(model->jnt_dofadr[joint]);
      }
      EXPECT_LT((state.PointJacobian(k, point) - followed).norm(), 1e-9);
      ++compared;
    }
  }
  EXPECT_GT(compared, 40);
  mj_deleteData(data);
  mj_deleteModel(model);
}

TEST_F(RobotMujoco, LinksAndJacobiansAreMuJoCos) {
  BoxHand{.coupled = true}.Write(folder / "hand.urdf");
  ExpectSameMotion(folder / "hand.urdf");
  for (const char* name :
       {"allegro_hand/allegro_hand_right.urdf", "schunk_hand/schunk_svh_hand_left.urdf"}) {
    const fs::path from = DataFolder() / "robots" / name;
    if (!fs::exists(from)) continue;
    const fs::path copy = folder / from.parent_path().filename();
    fs::copy(from.parent_path(), copy, fs::copy_options::recursive);
    fs::permissions(copy, fs::perms::owner_all, fs::perm_options::add);
    ExpectSameMotion(copy / from.filename());
  }
}

TEST_F(RobotMujoco, AHandInMjcfIsReadAsInUrdf) {
  BoxHand{.coupled = true}.Write(folder / "hand.urdf");
  const RobotHand urdf = ReadRobotHand(folder / "hand.urdf");
  mjModel* const model = LoadUrdf(folder / "hand.urdf", false);
  ASSERT_NE(model, nullptr);
  std::array<char, 1000> why{};
  ASSERT_TRUE(mj_saveLastXML((folder / "hand.xml").c_str(), model, why.data(), 1000)) << why.data();
  mj_deleteModel(model);
  const RobotHand mjcf = ReadRobotHand(folder / "hand.xml");
  EXPECT_EQ(mjcf.NumDofs(), 15);  // MuJoCo drops mimics
  RobotState a(urdf), b(mjcf);
  a.Evaluate(urdf.Straight());
  Eigen::VectorXd q = mjcf.Straight();
  for (const RobotLink& link : urdf.links) {
    const int same = mjcf.FindLink(link.name);
    if (link.dof >= 0 && same >= 0) q(mjcf.links[same].dof) = link.offset;
  }
  b.Evaluate(q);
  for (int k = 1; k < urdf.NumLinks(); ++k) {
    const int same = mjcf.FindLink(urdf.links[k].name);
    ASSERT_GE(same, 0) << urdf.links[k].name;
    EXPECT_LT((a.RootFromLink(k).matrix() - b.RootFromLink(same).matrix()).norm(), 1e-5);
  }
}

// A scene in MuJoCo's own loop, driven from key frame to key frame as docs/robots.md says.
class Playback {
 public:
  explicit Playback(const fs::path& path) {
    std::array<char, 1000> why{};
    model_ = mj_loadXML(path.c_str(), nullptr, why.data(), 1000);
    if (model_ == nullptr) throw std::runtime_error(why.data());
    data_ = mj_makeData(model_);
    object_ = mj_name2id(model_, mjOBJ_BODY, "object");
    wrist_ = model_->jnt_bodyid[mj_name2id(model_, mjOBJ_JOINT, "wrist")];
    mj_resetDataKeyframe(model_, data_, 0);
    mj_forward(model_, data_);
    first_ = WristFromObject();
  }
  ~Playback() {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  Playback(const Playback&) = delete;
  Playback& operator=(const Playback&) = delete;

  const mjModel& Model() const { return *model_; }
  const mjData& Data() const { return *data_; }

  void PlayAll() {
    const double rate = model_->numeric_data[0];
    while (data_->time < (model_->nkey - 1) / rate) {
      const int k = std::min(static_cast<int>(data_->time * rate), model_->nkey - 2);
      const double s = data_->time * rate - k;
      Between(model_->key_ctrl, model_->nu, k, s, data_->ctrl);
      Between(model_->key_mpos, 3, k, s, data_->mocap_pos);
      Between(model_->key_mquat, 4, k, s, data_->mocap_quat);
      mj_step(model_, data_);
      for (int v = 0; v < model_->nv; ++v) fastest = std::max(fastest, std::abs(data_->qvel[v]));
      const Eigen::Isometry3d moved = first_.inverse() * WristFromObject();
      slip_mm = std::max(slip_mm, 1e3 * moved.translation().norm());
      const Eigen::Map<const Eigen::Vector3d> wanted(data_->mocap_pos);
      behind_mm = std::max(behind_mm, 1e3 * (Pose(wrist_).translation() - wanted).norm());
    }
  }
  Eigen::Isometry3d Pose(int body) const {
    return RigidTransform(
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data_->xmat + 9 * body),
        Eigen::Map<const Eigen::Vector3d>(data_->xpos + 3 * body));
  }

  double slip_mm = 0.0;    // of the object in the hand, the most
  double behind_mm = 0.0;  // of the wrist and where it should be, the most
  double fastest = 0.0;    // of all velocities, m/s or rad/s

 private:
  static void Between(const mjtNum* keys, int count, int k, double s, mjtNum* out) {
    for (int i = 0; i < count; ++i) {
      out[i] = (1.0 - s) * keys[k * count + i] + s * keys[(k + 1) * count + i];
    }
  }
  Eigen::Isometry3d WristFromObject() const { return Pose(wrist_).inverse() * Pose(object_); }

  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
  int object_ = 0, wrist_ = 0;
  Eigen::Isometry3d first_;
};

// What holds in the clip is carried by the simulated hand all along, within `slip_mm`.
void ExpectCarried(const fs::path& scene, double slip_mm) {
  Playback play(scene);
  play.PlayAll();
  EXPECT_GT(play.Data().time, 2.0);
  for (int warning = 0; warning < mjNWARNING; ++warning) {
    EXPECT_EQ(play.Data().warning[warning].number, 0) << mju_warningText(warning, 0);
  }
  EXPECT_LT(play.slip_mm, slip_mm);
  EXPECT_LT(play.behind_mm, 15.0);
  EXPECT_LT(play.fastest, 10.0);
  EXPECT_GE(play.Data().ncon, 2);
  std::cout << fmt::format("{}: {:.1f} s, the object moves by {:.1f} mm in the hand\n",
                           play.Model().names, play.Data().time, play.slip_mm);
}

TEST_F(RobotMujoco, TheSceneOfATransferPlaysInMuJoCosLoop) {
  BoxHand{.coupled = true}.Write(folder / "hand.urdf");
  folder.Run("fit demo_drink mug -o held --end 70 --quiet");
  folder.Run("transfer held --robot hand.urdf -o robot --quiet");
  for (const char* name :
       {"robot.npz", "robot.csv", "metrics.json", "report.html", "sheet.png", "film.png"}) {
    EXPECT_TRUE(fs::exists(folder / "robot" / name)) << name;
  }
  const Playback scene(folder / "robot" / "scene.xml");
  EXPECT_EQ(scene.Model().nkey, 70);
  EXPECT_EQ(scene.Model().nmocap, 1);
  EXPECT_EQ(scene.Model().neq, 6);  // five couplings; the wrist drawn after its target
  EXPECT_EQ(scene.Model().nu, 10);
  ExpectCarried(folder / "robot" / "scene.xml", 20.0);

  const fs::path allegro = DataFolder() / "robots/allegro_hand/allegro_hand_right.urdf";
  if (!fs::exists(allegro)) return;
  folder.Run("transfer held --robot " + allegro.string() + " -o allegro --quiet");
  ExpectCarried(folder / "allegro" / "scene.xml", 20.0);
}

}  // namespace
}  // namespace holdfast

#endif
