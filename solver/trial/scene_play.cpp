// SPDX-License-Identifier: MIT
#include "solver/trial/scene_play.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <stdexcept>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/robot/reader_process.h"
#include "geometry/rotation.h"
#include "solver/trial/trial_scene.h"

#ifdef HOLDFAST_HAS_MUJOCO
#include <mujoco/mujoco.h>
#endif

namespace holdfast {

#ifdef HOLDFAST_HAS_MUJOCO

namespace {

// MuJoCo's compiler and error handlers are global to the process.
mjModel* Load(const std::filesystem::path& scene) {
  const std::scoped_lock lock(LibraryLock());
  mju_user_warning = [](const char*) {};
  mju_user_error = [](const char* what) { throw std::runtime_error(what); };
  char why[1000] = "";
  mjModel* const model = mj_loadXML(scene.c_str(), nullptr, why, sizeof why);
  if (model == nullptr) {
    throw Error(scene.string(), fmt::format("MuJoCo cannot read it ({})", why),
                "Write it again with 'holdfast transfer --robot'");
  }
  return model;
}

// Values between two key frames; `size` numbers in each row of `keys`.
void Blend(const mjtNum* keys, int size, int from, int to, double part, mjtNum* out) {
  for (int i = 0; i < size; ++i) {
    out[i] = (1.0 - part) * keys[from * size + i] + part * keys[to * size + i];
  }
}

Eigen::Isometry3d PoseOf(const mjData& data, int body) {
  const mjtNum* q = data.xquat + 4 * body;
  return RigidTransform(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix(),
                        Eigen::Vector3d(data.xpos + 3 * body));
}

}  // namespace

ScenePlay PlayScene(const std::filesystem::path& scene, int first, int last) {
  const std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model(Load(scene), mj_deleteModel);
  const mjModel* m = model.get();
  const int object = mj_name2id(m, mjOBJ_BODY, "object");
  const int rate = mj_name2id(m, mjOBJ_NUMERIC, "frame_rate");
  if (object < 0 || rate < 0 || first < 0 || first > last || last >= m->nkey) {
    throw Error(scene.string(), "has no such frames of an object",
                "Write it again with 'holdfast transfer --robot'");
  }
  const double frame_s = 1.0 / m->numeric_data[m->numeric_adr[rate]];
  const std::unique_ptr<mjData, decltype(&mj_deleteData)> data(mj_makeData(m), mj_deleteData);
  mjData* d = data.get();
  mj_resetDataKeyframe(m, d, first);
  d->time = 0.0;
  mj_forward(m, d);
  ScenePlay play;
  play.world_from_object.push_back(PoseOf(*d, object));
  for (int frame = first; frame < last; ++frame) {
    const double end = (frame + 1 - first) * frame_s;
    while (d->time < end - 0.5 * m->opt.timestep) {
      const double part = std::clamp((d->time - end) / frame_s + 1.0, 0.0, 1.0);
      Blend(m->key_ctrl, m->nu, frame, frame + 1, part, d->ctrl);
      Blend(m->key_mpos, 3 * m->nmocap, frame, frame + 1, part, d->mocap_pos);
      Blend(m->key_mquat, 4 * m->nmocap, frame, frame + 1, part, d->mocap_quat);
      mj_step(m, d);  // it makes unit quaternions of them
      const auto& warnings = d->warning;
      play.stable = warnings[mjWARN_BADQPOS].number + warnings[mjWARN_BADQVEL].number +
                        warnings[mjWARN_BADQACC].number ==
                    0;
      if (!play.stable) return play;
    }
    mj_kinematics(m, d);
    play.world_from_object.push_back(PoseOf(*d, object));
  }
  return play;
}

#else

ScenePlay PlayScene(const std::filesystem::path&, int, int) {
  RequirePhysics();
  return {};
}

#endif

}  // namespace holdfast
