// SPDX-License-Identifier: MIT
#include <algorithm>
#include <map>
#include <numbers>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/mesh/collada.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/robot/robot_file.h"
#include "geometry/robot/robot_hand.h"
#include "geometry/robot/robot_kinematics.h"

#ifdef HOLDFAST_HAS_URDFDOM
#include <console_bridge/console.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>
#endif

namespace holdfast {

#ifndef HOLDFAST_HAS_URDFDOM

RobotHand ReadUrdf(const std::filesystem::path& path, const std::string&) {
  throw Error(path.string(), "is URDF, but this build of Holdfast does not include urdfdom",
              "Install it (Debian: liburdfdom-dev) and build again, or give the hand as MJCF");
}

#else

namespace {

namespace fs = std::filesystem;

// urdfdom has no capsules: they are passed through as meshes named "capsule:r,l".
constexpr std::string_view kCapsule = "capsule:";

// Collects urdfdom's error messages instead of printing them.
class Complaints final : public console_bridge::OutputHandler {
 public:
  Complaints() { console_bridge::useOutputHandler(this); }
  ~Complaints() override { console_bridge::restorePreviousOutputHandler(); }
  Complaints(const Complaints&) = delete;
  Complaints& operator=(const Complaints&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    // The first message names the problem, the next ones the joint or link.
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR || ++count_ > kMost) return;
    text_ += (text_.empty() ? "" : "; ") + text;
  }
  const std::string& Text() const { return text_; }

 private:
  static constexpr int kMost = 4;
  std::string text_;
  int count_ = 0;
};

std::string WithCapsulesAsMeshes(const std::string& text) {
  std::string out;
  std::size_t done = 0;
  XmlTags tags(text);
  XmlTag tag;
  while (tags.Next(tag)) {
    if (tag.name != "capsule" && tag.name != "drake:capsule") continue;
    out += text.substr(done, tag.begin - done);
    done = tag.end;
    if (tag.closes) {
      out += "</mesh>";
      continue;
    }
    out += fmt::format("<mesh filename=\"{}{},{}\"{}>", kCapsule, tag.Attribute("radius"),
                       tag.Attribute("length"), tag.empty ? "/" : "");
  }
  return out + text.substr(done);
}

// `left_out`: errors reported for a model that could be read.
urdf::ModelInterfaceSharedPtr Parse(const fs::path& path, const std::string& text,
                                    std::string& left_out) {
  const Complaints complaints;
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(WithCapsulesAsMeshes(text));
  if (!model || !model->getRoot()) {
    throw Error(path.string(),
                "is not a valid URDF" + (complaints.Text().empty() ? "" : ": " + complaints.Text()),
                "Check it with check_urdf (Debian: liburdfdom-tools)");
  }
  left_out = complaints.Text();
  return model;
}

Eigen::Vector3d ToEigen(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Eigen::Isometry3d ToEigen(const urdf::Pose& pose) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  const urdf::Rotation& r = pose.rotation;
  transform.linear() = Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized().toRotationMatrix();
  transform.translation() = ToEigen(pose.position);
  return transform;
}

class UrdfBuilder {
 public:
  UrdfBuilder(const fs::path& path, const urdf::ModelInterface& model) : path_(path) {
    hand_.name = model.getName();
    hand_.source = path.string();
    Add(*model.getRoot(), -1);
    ResolveJoints(joints_, hand_);
  }
  RobotHand Take() { return std::move(hand_); }

 private:
  void Add(const urdf::Link& link, int parent) {
    const int index = hand_.NumLinks();
    hand_.links.emplace_back();
    hand_.links.back().name = link.name;
    hand_.links.back().parent = parent;
    if (link.parent_joint) AddJoint(*link.parent_joint, hand_.links.back());
    AddShapes(link, hand_.links.back());
    for (const urdf::LinkSharedPtr& child : link.child_links) Add(*child, index);
  }

  void AddJoint(const urdf::Joint& joint, RobotLink& link) {
    link.joint = joint.name;
    link.parent_from_joint = ToEigen(joint.parent_to_joint_origin_transform);
    switch (joint.type) {
      case urdf::Joint::REVOLUTE:
      case urdf::Joint::CONTINUOUS:
        link.kind = RobotJointKind::kTurning;
        break;
      case urdf::Joint::PRISMATIC:
        link.kind = RobotJointKind::kSliding;
        break;
      case urdf::Joint::FIXED:
        return;
      default:
        hand_.notes.push_back(
            fmt::format("joint '{}' is floating or planar: treated as fixed", joint.name));
        return;
    }
    link.axis = ToEigen(joint.axis);
    if (!(link.axis.norm() > 1e-9)) {
      throw Error(hand_.source, fmt::format("joint '{}' has no axis", joint.name),
                  "Give it an axis that is not zero");
    }
    link.axis.normalize();
    RobotJointSource source{joint.name, {}, 1.0, 0.0, -std::numbers::pi, std::numbers::pi};
    if (joint.limits && joint.type != urdf::Joint::CONTINUOUS) {
      source.low = joint.limits->lower;
      source.high = joint.limits->upper;
    }
    if (joint.mimic) {
      source.follows = joint.mimic->joint_name;
      source.factor = joint.mimic->multiplier;
      source.offset = joint.mimic->offset;
    }
    joints_.push_back(source);
  }

  // Adds the visual shapes if all have readable formats; otherwise the collision shapes.
  void AddShapes(const urdf::Link& from, RobotLink& link) {
    const auto readable = [](const auto& part) {
      if (!part || !part->geometry || part->geometry->type != urdf::Geometry::MESH) return true;
      const std::string& name = static_cast<const urdf::Mesh&>(*part->geometry).filename;
      return name.starts_with(kCapsule) || HasMeshFormat(name) || IsCollada(name);
    };
    const bool see = std::ranges::all_of(from.visual_array, readable);
    if (see || from.collision_array.empty()) {
      for (const urdf::VisualSharedPtr& seen : from.visual_array) {
        if (seen && seen->geometry) AddShape(*seen->geometry, ToEigen(seen->origin), link);
      }
    } else {
      hand_.notes.push_back(
          fmt::format("link '{}' has a visual mesh that is not .obj, .stl, .ply, .off or .dae: its "
                      "collision shapes are used",
                      link.name));
    }
    if (!link.shapes.empty()) return;
    for (const urdf::CollisionSharedPtr& solid : from.collision_array) {
      if (solid && solid->geometry) AddShape(*solid->geometry, ToEigen(solid->origin), link);
    }
  }

  void AddShape(const urdf::Geometry& shape, const Eigen::Isometry3d& origin, RobotLink& link) {
    Eigen::Affine3d link_from_shape(origin.matrix());
    TriangleMesh mesh;
    switch (shape.type) {
      case urdf::Geometry::SPHERE: {
        const double radius = static_cast<const urdf::Sphere&>(shape).radius;
        RequireShapeSize(hand_.source, link.name, Eigen::VectorXd::Constant(1, radius));
        mesh = BallMesh(radius);
        break;
      }
      case urdf::Geometry::BOX: {
        const Eigen::Vector3d sides = ToEigen(static_cast<const urdf::Box&>(shape).dim);
        RequireShapeSize(hand_.source, link.name, sides);
        mesh = BoxMesh(sides);
        break;
      }
      case urdf::Geometry::CYLINDER: {
        const auto& cylinder = static_cast<const urdf::Cylinder&>(shape);
        RequireShapeSize(hand_.source, link.name,
                         Eigen::Vector2d(cylinder.radius, cylinder.length));
        mesh = CylinderMesh(cylinder.radius, cylinder.length);
        break;
      }
      case urdf::Geometry::MESH: {
        const auto& file = static_cast<const urdf::Mesh&>(shape);
        if (file.filename.starts_with(kCapsule)) {
          mesh = Capsule(file.filename, link.name);
          break;
        }
        mesh = Load(file.filename);
        link_from_shape.scale(ToEigen(file.scale));
        break;
      }
    }
    if (mesh.NumFaces() > 0) link.shapes.push_back(Transformed(mesh, link_from_shape));
  }

  TriangleMesh Capsule(const std::string& name, const std::string& link) const {
    double radius = 0.0, length = -1.0;
    std::istringstream numbers(name.substr(kCapsule.size()));
    numbers.imbue(std::locale::classic());
    char comma = 0;
    if (numbers >> radius >> comma >> length && numbers.eof() && length >= 0.0) {
      RequireShapeSize(hand_.source, link, Eigen::Vector2d(radius, radius + length));
      return CapsuleMesh(radius, length);
    }
    throw Error(hand_.source,
                fmt::format("link '{}' has a capsule without radius and length", link),
                "Give it a radius above 0 and a length, both in meters");
  }

  // Links of the same kind share mesh files.
  const TriangleMesh& Load(const std::string& name) {
    const auto found = meshes_.find(name);
    if (found != meshes_.end()) return found->second;
    const fs::path file = FindRobotMesh(path_, name);
    return meshes_.emplace(name, IsCollada(file) ? ReadCollada(file) : ReadMesh(file))
        .first->second;
  }

  fs::path path_;
  RobotHand hand_;
  std::vector<RobotJointSource> joints_;
  std::map<std::string, TriangleMesh> meshes_;
};

}  // namespace

RobotHand ReadUrdf(const fs::path& path, const std::string& text) {
  std::string left_out;
  const urdf::ModelInterfaceSharedPtr model = Parse(path, text, left_out);
  RobotHand hand = UrdfBuilder(path, *model).Take();
  if (!left_out.empty())
    hand.notes.push_back(
        "invalid elements are skipped, with the elements after them in their links: " + left_out);
  return hand;
}

#endif

}  // namespace holdfast
