// SPDX-License-Identifier: MIT
#include <array>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/robot/robot_hand.h"
#include "geometry/robot/robot_kinematics.h"

#ifdef HOLDFAST_HAS_MUJOCO
#include <mujoco/mujoco.h>
#endif

namespace holdfast {

#ifndef HOLDFAST_HAS_MUJOCO

RobotHand ReadMjcf(const std::filesystem::path& path) {
  throw Error(path.string(), "is MJCF, but this build of Holdfast does not include MuJoCo",
              "Install it (Debian: libmujoco-dev) and build again, or give the hand as URDF");
}

#else

namespace {

namespace fs = std::filesystem;

using Model = std::unique_ptr<mjModel, void (*)(mjModel*)>;

Model Load(const fs::path& path) {
  // MuJoCo's default handlers print, write a log file and terminate the program.
  mju_user_warning = [](const char*) {};
  mju_user_error = [](const char* what) { throw std::runtime_error(what); };
  std::array<char, 1000> why{};
  Model model(mj_loadXML(path.c_str(), nullptr, why.data(), static_cast<int>(why.size())),
              mj_deleteModel);
  if (!model) {
    std::string text(why.data());
    while (!text.empty() && text.back() == '\n') text.pop_back();
    throw Error(
        path.string(), "is not a model that MuJoCo can read: " + text,
        fmt::format("Correct it for MuJoCo {}, or give the hand as URDF", mj_versionString()));
  }
  return model;
}

Eigen::Isometry3d PoseOf(const mjtNum* pos, const mjtNum* quat) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(quat[0], quat[1], quat[2], quat[3]).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(pos[0], pos[1], pos[2]);
  return pose;
}

std::string NameOf(const mjModel& model, mjtObj kind, int id) {
  const char* const name = mj_id2name(&model, kind, id);
  if (name != nullptr && *name != 0) return name;
  return fmt::format("{}_{}", kind == mjOBJ_JOINT ? "joint" : "body", id);
}

TriangleMesh MeshOf(const mjModel& model, int mesh) {
  TriangleMesh out;
  const int v0 = model.mesh_vertadr[mesh], f0 = model.mesh_faceadr[mesh];
  out.vertices =
      Eigen::Map<const Eigen::Matrix3Xf>(model.mesh_vert + 3 * v0, 3, model.mesh_vertnum[mesh])
          .cast<double>();
  out.faces =
      Eigen::Map<const Eigen::Matrix3Xi>(model.mesh_face + 3 * f0, 3, model.mesh_facenum[mesh]);
  return out;
}

TriangleMesh ShapeOf(const std::string& source, const mjModel& model, int geom) {
  const mjtNum* const size = model.geom_size + 3 * geom;
  const auto require_sizes = [&](int count) {
    RequireShapeSize(source, NameOf(model, mjOBJ_BODY, model.geom_bodyid[geom]),
                     Eigen::Map<const Eigen::VectorXd>(size, count));
  };
  switch (model.geom_type[geom]) {
    case mjGEOM_SPHERE:
      require_sizes(1);
      return BallMesh(size[0]);
    case mjGEOM_CAPSULE:
      require_sizes(2);
      return CapsuleMesh(size[0], 2.0 * size[1]);
    case mjGEOM_ELLIPSOID:
      require_sizes(3);
      return EllipsoidMesh({size[0], size[1], size[2]});
    case mjGEOM_CYLINDER:
      require_sizes(2);
      return CylinderMesh(size[0], 2.0 * size[1]);
    case mjGEOM_BOX:
      require_sizes(3);
      return BoxMesh(2.0 * Eigen::Vector3d(size[0], size[1], size[2]));
    case mjGEOM_MESH:
      return MeshOf(model, model.geom_dataid[geom]);
    default:
      return {};  // planes and height fields are not part of a hand
  }
}

// Returns a body's visual-only geometries, or all geometries if it has none.
std::vector<TriangleMesh> ShapesOf(const std::string& source, const mjModel& model, int body) {
  std::vector<TriangleMesh> seen, all;
  for (int k = 0; k < model.body_geomnum[body]; ++k) {
    const int geom = model.body_geomadr[body] + k;
    const TriangleMesh shape = ShapeOf(source, model, geom);
    if (shape.NumFaces() == 0) continue;
    const Eigen::Isometry3d pose = PoseOf(model.geom_pos + 3 * geom, model.geom_quat + 4 * geom);
    all.push_back(Transformed(shape, Eigen::Affine3d(pose.matrix())));
    if (model.geom_contype[geom] == 0 && model.geom_conaffinity[geom] == 0) {
      seen.push_back(all.back());
    }
  }
  return seen.empty() ? all : seen;
}

// A body with several joints becomes one link per joint. A free joint is the wrist and is ignored.
class MjcfBuilder {
 public:
  MjcfBuilder(const fs::path& path, const mjModel& model) : model_(model) {
    hand_.name = path.stem().string();
    hand_.source = path.string();
    std::vector<int> link_of(static_cast<std::size_t>(model.nbody));
    for (int body = 0; body < model.nbody; ++body) {
      link_of[body] = AddBody(body, body == 0 ? -1 : link_of[model.body_parentid[body]]);
    }
    AddFollowers();
    ResolveJoints(joints_, hand_);
  }
  RobotHand Take() { return std::move(hand_); }

 private:
  int AddBody(int body, int parent) {
    Eigen::Isometry3d parent_from_body =
        PoseOf(model_.body_pos + 3 * body, model_.body_quat + 4 * body);
    // MuJoCo joints rotate about arbitrary points; RobotLink joints rotate about the link origin.
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    for (int k = 0; k < model_.body_jntnum[body]; ++k) {
      const int joint = model_.body_jntadr[body] + k;
      const int type = model_.jnt_type[joint];
      if (type == mjJNT_FREE) continue;
      if (type == mjJNT_BALL) {
        hand_.notes.push_back(fmt::format("joint '{}' is a ball joint: treated as fixed",
                                          NameOf(model_, mjOBJ_JOINT, joint)));
        continue;
      }
      const Eigen::Map<const Eigen::Vector3d> at(model_.jnt_pos + 3 * joint);
      RobotLink link = JointLink(joint, parent);
      link.name = fmt::format("{}@{}", NameOf(model_, mjOBJ_BODY, body), link.joint);
      link.parent_from_joint = parent_from_body * Eigen::Translation3d(at - origin);
      hand_.links.push_back(std::move(link));
      parent = hand_.NumLinks() - 1;
      parent_from_body.setIdentity();
      origin = at;
    }
    if (model_.body_jntnum[body] > 0 && parent >= 0 && origin.isZero(1e-9) &&
        parent_from_body.isApprox(Eigen::Isometry3d::Identity())) {
      hand_.links.back().name = NameOf(model_, mjOBJ_BODY, body);
    } else {
      RobotLink link;
      link.name = NameOf(model_, mjOBJ_BODY, body);
      link.parent = parent;
      link.parent_from_joint = parent_from_body * Eigen::Translation3d(-origin);
      hand_.links.push_back(std::move(link));
    }
    hand_.links.back().shapes = ShapesOf(hand_.source, model_, body);
    return hand_.NumLinks() - 1;
  }

  RobotLink JointLink(int joint, int parent) {
    RobotLink link;
    link.parent = parent;
    link.joint = NameOf(model_, mjOBJ_JOINT, joint);
    link.kind =
        model_.jnt_type[joint] == mjJNT_SLIDE ? RobotJointKind::kSliding : RobotJointKind::kTurning;
    link.axis = Eigen::Map<const Eigen::Vector3d>(model_.jnt_axis + 3 * joint).normalized();
    RobotJointSource source{link.joint, {}, 1.0, 0.0, -std::numbers::pi, std::numbers::pi};
    const double reference = model_.qpos0[model_.jnt_qposadr[joint]];
    if (model_.jnt_limited[joint] != 0) {
      source.low = model_.jnt_range[2 * joint];
      source.high = model_.jnt_range[2 * joint + 1];
    }
    if (reference != 0.0) {
      hand_.notes.push_back(fmt::format(
          "joint '{}' has a reference angle: its values are relative to it", link.joint));
      source.low -= reference;
      source.high -= reference;
    }
    joints_.push_back(source);
    return link;
  }

  void AddFollowers() {
    for (int k = 0; k < model_.neq; ++k) {
      if (model_.eq_type[k] != mjEQ_JOINT || model_.eq_active[k] == 0) continue;
      const mjtNum* const poly = model_.eq_data + mjNEQDATA * k;
      const std::string name = NameOf(model_, mjOBJ_JOINT, model_.eq_obj1id[k]);
      if (model_.eq_obj2id[k] < 0 || poly[2] != 0.0 || poly[3] != 0.0 || poly[4] != 0.0) {
        hand_.notes.push_back(fmt::format(
            "joint '{}' follows another joint by a polynomial: treated as independent", name));
        continue;
      }
      for (RobotJointSource& joint : joints_) {
        if (joint.name != name) continue;
        joint.follows = NameOf(model_, mjOBJ_JOINT, model_.eq_obj2id[k]);
        joint.factor = poly[1];
        joint.offset = poly[0];
      }
    }
  }

  const mjModel& model_;
  RobotHand hand_;
  std::vector<RobotJointSource> joints_;
};

}  // namespace

RobotHand ReadMjcf(const fs::path& path) {
  const Model model = Load(path);
  return MjcfBuilder(path, *model).Take();
}

#endif

}  // namespace holdfast
