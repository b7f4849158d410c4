// SPDX-License-Identifier: MIT
#include "solver/trial/trial_scene.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <mutex>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/robot/reader_process.h"
#include "geometry/rotation.h"

#ifdef HOLDFAST_HAS_MUJOCO
#include <mujoco/mujoco.h>
#endif

namespace holdfast {

bool HasPhysics() {
#ifdef HOLDFAST_HAS_MUJOCO
  return true;
#else
  return false;
#endif
}

void RequirePhysics() {
  if (HasPhysics()) return;
  throw Error("physics", "needs MuJoCo, but this build of Holdfast does not include it",
              "Install it (Debian: libmujoco-dev) and build again");
}

SolidMass MassOfSolids(const std::vector<TriangleMesh>& solids, double density_kg_m3) {
  double volume = 0.0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const TriangleMesh& solid : solids) {
    for (const auto face : solid.faces.colwise()) {
      const Eigen::Matrix3d corners = solid.vertices(Eigen::all, face);
      const double v = corners.determinant() / 6.0;
      const Eigen::Vector3d sum = corners.rowwise().sum();
      volume += v;
      first += v / 4.0 * sum;
      second += v / 20.0 * (corners * corners.transpose() + sum * sum.transpose());
    }
  }
  SolidMass out;
  out.mass_kg = density_kg_m3 * volume;
  out.center = first / volume;
  const Eigen::Matrix3d spread = second - volume * out.center * out.center.transpose();
  out.inertia = density_kg_m3 * (spread.trace() * Eigen::Matrix3d::Identity() - spread);
  return out;
}

#ifdef HOLDFAST_HAS_MUJOCO

namespace {

std::string Numbers(const Eigen::Ref<const Eigen::VectorXd>& values) {
  std::string text;
  for (const double value : values) fmt::format_to(std::back_inserter(text), "{:.9g} ", value);
  return text;
}

std::string MeshAssets(const std::vector<TriangleMesh>& pieces, const std::string& name) {
  std::string text;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    text += fmt::format("<mesh name=\"{}_{}\" vertex=\"{}\"/>\n", name, k,
                        Numbers(pieces[k].vertices.reshaped()));
  }
  return text;
}

std::string Geoms(const std::vector<TriangleMesh>& pieces, const std::string& name,
                  const char* kind) {
  std::string text;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    text += fmt::format("<geom class=\"{}\" type=\"mesh\" mesh=\"{}_{}\"/>\n", kind, name, k);
  }
  return text;
}

// Body of a link with its descendants.
std::string LinkBody(const std::vector<MjcfLink>& links, int index) {
  const MjcfLink& link = links[static_cast<std::size_t>(index)];
  const std::string name = fmt::format("link{}", index);
  std::string text = fmt::format("<body name=\"{}\" pos=\"{}\">\n", name, Numbers(link.joint));
  if (link.parent >= 0) {
    text += fmt::format("<joint name=\"{}\" type=\"ball\" class=\"finger\"/>\n", name);
    if (link.pieces.empty()) {
      text += "<inertial pos=\"0 0 0\" mass=\"0.001\" diaginertia=\"1e-6 1e-6 1e-6\"/>\n";
    }
  }
  text += Geoms(link.pieces, name, "hand");
  for (int child = index + 1; child < static_cast<int>(links.size()); ++child) {
    if (links[static_cast<std::size_t>(child)].parent == index) text += LinkBody(links, child);
  }
  return text + "</body>\n";
}

std::string ObjectBody(const std::vector<TriangleMesh>& pieces, const SolidMass& mass,
                       const Eigen::Isometry3d& hand_from_object) {
  const Eigen::Matrix3d& I = mass.inertia;
  const Eigen::Quaterniond q(hand_from_object.linear());
  return fmt::format(
             "<body name=\"object\" pos=\"{}\" quat=\"{:.12g} {:.12g} {:.12g} {:.12g}\">\n"
             "<freejoint name=\"object\"/>\n"
             "<inertial pos=\"{}\" mass=\"{:.9g}\" fullinertia=\"{:.9g} {:.9g} {:.9g} {:.9g} "
             "{:.9g} {:.9g}\"/>\n",
             Numbers(hand_from_object.translation()), q.w(), q.x(), q.y(), q.z(),
             Numbers(mass.center), mass.mass_kg, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2),
             I(1, 2)) +
         Geoms(pieces, "object", "object") + "</body>\n";
}

std::string SceneText(const std::vector<MjcfLink>& links, const std::vector<TriangleMesh>& pieces,
                      const std::string& object_body, const TrialSceneOptions& options) {
  std::string text = fmt::format(
      "<mujoco>\n<compiler angle=\"radian\"/>\n"
      "<option timestep=\"{:.9g}\" gravity=\"0 0 0\" cone=\"elliptic\" impratio=\"10\" "
      "noslip_iterations=\"3\"><flag multiccd=\"enable\"/></option>\n"
      "<size njmax=\"2000\" nconmax=\"400\" nstack=\"8000000\"/>\n"
      "<default>\n"
      "<geom condim=\"4\" friction=\"{:.9g} {:.9g} 0.0001\" solref=\"0.005 1\"/>\n"
      "<default class=\"hand\"><geom contype=\"1\" conaffinity=\"0\"/></default>\n"
      "<default class=\"object\"><geom contype=\"0\" conaffinity=\"1\"/></default>\n"
      "<default class=\"finger\"><joint damping=\"{:.9g}\" armature=\"{:.9g}\"/></default>\n"
      "</default>\n<asset>\n",
      options.step_s, options.friction, options.torsion_m, options.joint_damping_Nms,
      options.joint_inertia_kg_m2);
  for (std::size_t k = 0; k < links.size(); ++k) {
    text += MeshAssets(links[k].pieces, fmt::format("link{}", k));
  }
  text += MeshAssets(pieces, "object") + "</asset>\n<worldbody>\n" + object_body;
  for (int k = 0; k < static_cast<int>(links.size()); ++k) {
    if (links[static_cast<std::size_t>(k)].parent < 0) text += LinkBody(links, k);
  }
  return text + "</worldbody>\n</mujoco>\n";
}

// MuJoCo's compiler and error handlers are global to the process.
mjModel* Compile(const std::string& text) {
  const std::scoped_lock lock(LibraryLock());
  mju_user_warning = [](const char*) {};
  mju_user_error = [](const char* what) { throw std::runtime_error(what); };
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  constexpr const char* kName = "trial.xml";
  mj_makeEmptyFileVFS(files.get(), kName, static_cast<int>(text.size()));
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), kName)], text.data(), text.size());
  char why[1000] = "";
  mjModel* const model = mj_loadXML(kName, files.get(), why, sizeof why);
  mj_deleteVFS(files.get());
  if (model == nullptr) {
    throw Error("physics", fmt::format("cannot simulate this hand and object ({})", why),
                "Check the object's mesh");
  }
  return model;
}

Eigen::Map<const Eigen::Vector3d> Vector(const mjtNum* at) {
  return Eigen::Map<const Eigen::Vector3d>(at);
}
Eigen::Quaterniond Quaternion(const mjtNum* at) { return {at[0], at[1], at[2], at[3]}; }

}  // namespace

struct TrialScene::Model {
  struct Press {  // a contact's point and force in its link's frame
    int body;
    Eigen::Vector3d point, force;
  };
  mjModel* mujoco = nullptr;
  std::vector<MjcfLink> links;
  std::vector<Press> presses;
  int object = 0;                   // body id
  int object_q = 0;                 // index in qpos
  std::vector<int> link_q, link_v;  // indices in qpos and qvel; -1 for links without a joint
  ~Model() { mj_deleteModel(mujoco); }
};

TrialScene::TrialScene(const std::vector<MjcfLink>& links, const std::vector<GripContact>& contacts,
                       const std::vector<TriangleMesh>& pieces, const SolidMass& mass,
                       const Eigen::Isometry3d& hand_from_object,
                       const TrialSceneOptions& options) {
  auto model = std::make_unique<Model>();
  model->mujoco =
      Compile(SceneText(links, pieces, ObjectBody(pieces, mass, hand_from_object), options));
  model->links = links;
  const mjModel* m = model->mujoco;
  model->object = mj_name2id(m, mjOBJ_BODY, "object");
  model->object_q = m->jnt_qposadr[mj_name2id(m, mjOBJ_JOINT, "object")];
  std::vector<Eigen::Isometry3d> hand_from_link;
  for (std::size_t k = 0; k < links.size(); ++k) {
    const int joint = mj_name2id(m, mjOBJ_JOINT, fmt::format("link{}", k).c_str());
    model->link_q.push_back(joint < 0 ? -1 : m->jnt_qposadr[joint]);
    model->link_v.push_back(joint < 0 ? -1 : m->jnt_dofadr[joint]);
    const Eigen::Isometry3d own = RigidTransform(links[k].rest.toRotationMatrix(), links[k].joint);
    hand_from_link.push_back(links[k].parent < 0 ? own : hand_from_link[links[k].parent] * own);
  }
  for (const GripContact& contact : contacts) {
    const Eigen::Isometry3d link_from_hand = hand_from_link[contact.link].inverse();
    model->presses.push_back(
        {mj_name2id(m, mjOBJ_BODY, fmt::format("link{}", contact.link).c_str()),
         link_from_hand * contact.point, link_from_hand.linear() * contact.press});
  }
  model_ = std::move(model);
}

struct TrialRun::Data {
  mjData* mujoco = nullptr;
  std::vector<Eigen::Quaterniond> targets;
  double owed_s = 0.0;  // remainder of Advance, less than a step
  bool unstable = false;
  ~Data() { mj_deleteData(mujoco); }
};

TrialRun::TrialRun(const TrialScene& scene) : scene_(&scene), data_(std::make_unique<Data>()) {
  const TrialScene::Model& model = *scene.model_;
  data_->mujoco = mj_makeData(model.mujoco);
  for (std::size_t k = 0; k < model.links.size(); ++k) {
    if (model.link_q[k] < 0) continue;
    const Eigen::Quaterniond& q = model.links[k].rest;
    const double values[] = {q.w(), q.x(), q.y(), q.z()};
    std::ranges::copy(values, data_->mujoco->qpos + model.link_q[k]);
    data_->targets.push_back(q);
  }
  mj_forward(model.mujoco, data_->mujoco);
}

TrialRun::TrialRun(const TrialRun& other) : scene_(other.scene_), data_(std::make_unique<Data>()) {
  const mjModel* m = scene_->model_->mujoco;
  data_->mujoco = mj_copyData(nullptr, m, other.data_->mujoco);
  data_->targets = other.data_->targets;
  data_->owed_s = other.data_->owed_s;
  data_->unstable = other.data_->unstable;
}

TrialRun::~TrialRun() = default;

void TrialRun::SetTargets(const std::vector<Eigen::Quaterniond>& targets) {
  data_->targets = targets;
}

namespace {

// Applies springs and presses, with the muscle part clamped to its limit, to qfrc_applied.
template <typename Model>
void ApplyJointTorques(const Model& model, const std::vector<Eigen::Quaterniond>& targets,
                       mjData* d) {
  mju_zero(d->qfrc_applied, model.mujoco->nv);
  for (const auto& press : model.presses) {
    const Eigen::Quaterniond turned = Quaternion(d->xquat + 4 * press.body);
    const Eigen::Vector3d point = Vector(d->xpos + 3 * press.body) + turned * press.point;
    const Eigen::Vector3d force = turned * press.force;
    constexpr mjtNum kNoTorque[3] = {0.0, 0.0, 0.0};
    mj_applyFT(model.mujoco, d, force.data(), kNoTorque, point.data(), press.body, d->qfrc_applied);
  }
  std::size_t target = 0;
  for (std::size_t k = 0; k < model.links.size(); ++k) {
    if (model.link_q[k] < 0) continue;
    const MjcfLink& link = model.links[k];
    const Eigen::Quaterniond now = Quaternion(d->qpos + model.link_q[k]);
    const Eigen::Vector3d off =
        LogSO3((now.conjugate() * targets[target++]).normalized().toRotationMatrix());
    Eigen::Map<Eigen::Vector3d> torque(d->qfrc_applied + model.link_v[k]);
    const Eigen::Vector3d flexion = link.axes.col(0);
    const double bend = off.dot(flexion);
    const double pressed = torque.dot(flexion);
    const double muscles =
        std::clamp(link.stiffness_Nm(0) * bend + pressed, -link.limit_Nm(0), link.limit_Nm(0));
    torque += link.stiffness_Nm(1) * (off - bend * flexion) + (muscles - pressed) * flexion;
  }
}

// Gravity and the inertial forces of the hand's frame, in which MuJoCo simulates: at the mass
// center r, force m (field - turn_rate x r - turning x (turning x r) - 2 turning x v); for spin w,
// torque -(I turn_rate + turning x I (turning + w) + w x I turning - I (turning x w)).
void ApplyField(const mjModel* m, int body, const FrameMotion& motion, mjData* d) {
  const double mass = m->body_mass[body];
  const Eigen::Vector3d r = Vector(d->xipos + 3 * body);
  mjtNum velocity[6];
  mj_objectVelocity(m, d, mjOBJ_BODY, body, velocity, 0);
  const Eigen::Vector3d w = Vector(velocity), v = Vector(velocity + 3);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(d->ximat + 9 * body);
  const Eigen::Matrix3d I = R * Vector(m->body_inertia + 3 * body).asDiagonal() * R.transpose();
  const Eigen::Vector3d& turning = motion.turning;
  Eigen::Map<Eigen::Vector3d>(d->xfrc_applied + 6 * body) =
      mass * (motion.field - motion.turn_rate.cross(r) - turning.cross(turning.cross(r)) -
              2.0 * turning.cross(v) - motion.drag_per_s * v);
  Eigen::Map<Eigen::Vector3d>(d->xfrc_applied + 6 * body + 3) =
      -(I * motion.turn_rate + turning.cross(I * (turning + w)) + w.cross(I * turning) -
        I * turning.cross(w) + motion.drag_per_s * I * w);
}

}  // namespace

void TrialRun::Advance(double seconds, const FrameMotion& motion) {
  const TrialScene::Model& model = *scene_->model_;
  mjData* const d = data_->mujoco;
  data_->owed_s += seconds;
  const int steps = static_cast<int>(data_->owed_s / model.mujoco->opt.timestep + 0.5);
  data_->owed_s -= steps * model.mujoco->opt.timestep;
  for (int k = 0; k < steps && !data_->unstable; ++k) {
    mj_step1(model.mujoco, d);
    ApplyJointTorques(model, data_->targets, d);
    ApplyField(model.mujoco, model.object, motion, d);
    mj_step2(model.mujoco, d);
    for (const int warning : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC}) {
      data_->unstable = data_->unstable || d->warning[warning].number > 0;
    }
  }
}

Eigen::Isometry3d TrialRun::HandFromObject() const {
  const mjtNum* q = data_->mujoco->qpos + scene_->model_->object_q;
  return RigidTransform(Quaternion(q + 3).normalized().toRotationMatrix(), Vector(q));
}

std::vector<Eigen::Quaterniond> TrialRun::Joints() const {
  std::vector<Eigen::Quaterniond> joints;
  for (const int q : scene_->model_->link_q) {
    if (q >= 0) joints.push_back(Quaternion(data_->mujoco->qpos + q).normalized());
  }
  return joints;
}

int TrialRun::Touching() const { return data_->mujoco->ncon; }
bool TrialRun::Unstable() const { return data_->unstable; }

#else

struct TrialScene::Model {};
struct TrialRun::Data {};

TrialScene::TrialScene(const std::vector<MjcfLink>&, const std::vector<GripContact>&,
                       const std::vector<TriangleMesh>&, const SolidMass&, const Eigen::Isometry3d&,
                       const TrialSceneOptions&) {
  RequirePhysics();
}
TrialRun::TrialRun(const TrialScene& scene) : scene_(&scene) {}
TrialRun::TrialRun(const TrialRun& other) : scene_(other.scene_) {}
TrialRun::~TrialRun() = default;
void TrialRun::Advance(double, const FrameMotion&) {}
void TrialRun::SetTargets(const std::vector<Eigen::Quaterniond>&) {}
Eigen::Isometry3d TrialRun::HandFromObject() const { return Eigen::Isometry3d::Identity(); }
std::vector<Eigen::Quaterniond> TrialRun::Joints() const { return {}; }
int TrialRun::Touching() const { return 0; }
bool TrialRun::Unstable() const { return true; }

#endif

TrialScene::~TrialScene() = default;

}  // namespace holdfast
