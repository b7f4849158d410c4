// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/mjcf_writer.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/convex_hull.h"
#include "geometry/mesh/mesh_topology.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kMinVolume_m3 = 1e-11;  // MuJoCo treats less as flat

// A joint, and the convex hull of the skin that it moves most, in its coordinate frame.
using HandPiece = std::pair<int, TriangleMesh>;

// Text of an XML attribute: special characters are escaped, control characters replaced.
std::string Attribute(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '&' || c == '<' || c == '>' || c == '"') {
      fmt::format_to(std::back_inserter(escaped), "&#{};", static_cast<int>(c));
    } else {
      escaped += byte < 0x20 ? ' ' : c;
    }
  }
  return escaped;
}

// Pieces share the triangles between them, so that no gap opens when the fingers are straight.
std::vector<HandPiece> PiecesOf(const BodySurface& surface, Side side) {
  if (!surface.Model().HasHand(side)) return {};
  const std::vector<int> strongest = StrongestHandJoints(surface, side);
  std::map<int, std::set<int>> vertices;
  for (const auto face : surface.Faces().colwise()) {
    for (const int corner : face) {
      const int joint = strongest[corner];
      if (joint < 0) continue;
      for (const int v : face) {
        if (strongest[v] >= 0) vertices[joint].insert(v);
      }
    }
  }
  std::vector<HandPiece> pieces;
  for (const auto& [joint, ids] : vertices) {
    Eigen::Matrix3Xd points(3, ids.size());
    int k = 0;
    for (const int v : ids) {
      points.col(k++) = surface.RestVertices().col(v) - surface.RestJoints().col(joint);
    }
    TriangleMesh hull = ConvexHull(points);
    if (SignedVolume(hull) > kMinVolume_m3) pieces.emplace_back(joint, std::move(hull));
  }
  return pieces;
}

// Appends the position and the quaternion of a body to texts; `last` is its quaternion before.
void AppendPose(const Eigen::Isometry3d& pose, Eigen::Quaterniond& last, std::string& position,
                std::string& rotation) {
  Eigen::Quaterniond q(pose.linear());
  q.normalize();
  if (q.dot(last) < 0.0) q.coeffs() = -q.coeffs();
  last = q;
  const auto at = pose.translation();
  fmt::format_to(std::back_inserter(position), "{}{:.9g} {:.9g} {:.9g}",
                 position.empty() ? "" : " ", at.x(), at.y(), at.z());
  fmt::format_to(std::back_inserter(rotation), "{}{:.9g} {:.9g} {:.9g} {:.9g}",
                 rotation.empty() ? "" : " ", q.w(), q.x(), q.y(), q.z());
}

// pos="..." quat="..."
std::string Place(const Eigen::Isometry3d& pose) {
  std::string position, rotation;
  Eigen::Quaterniond last = Eigen::Quaterniond::Identity();
  AppendPose(pose, last, position, rotation);
  return fmt::format("pos=\"{}\" quat=\"{}\"", position, rotation);
}

class MjcfScene {
 public:
  MjcfScene(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
            const MjcfOptions& options, const std::filesystem::path& path)
      : clip_(clip),
        surface_(surface),
        object_(clip.object ? object : nullptr),
        table_(TableMesh(clip)),
        physics_(object_ != nullptr ? options.physics : nullptr),
        options_(options),
        path_(path) {
    for (const Side side : {Side::kRight, Side::kLeft}) {
      std::ranges::move(PiecesOf(surface, side), std::back_inserter(pieces_));
    }
    if (pieces_.empty() && object_ == nullptr) {
      throw Error(path.string(), "would have neither a hand nor an object",
                  "Give a clip with an object, or a body model with hands");
    }
    report_.hand_pieces = static_cast<int>(pieces_.size());
    if (object_ != nullptr) WeighObject();
    if (physics_ == nullptr) return;
    report_.simulated_hands = static_cast<int>(physics_->hands.size());
    report_.object_mass_kg = physics_->mass_kg;
    report_.mass_of_hull = physics_->mass_of_pieces;
  }

  void WriteAssets() const {
    const std::filesystem::path folder = MjcfAssets(path_);
    if (object_ != nullptr) WriteMesh(*object_, folder / "object.obj");
    if (table_ != nullptr) WriteMesh(*table_, folder / "table.obj");
    for (const auto& [joint, hull] : pieces_) {
      WriteMesh(hull, folder / fmt::format("{}.obj", kJointNames[joint]));
    }
    if (physics_ == nullptr) return;
    WritePieces(physics_->object_pieces, "object", folder);
    for (const MjcfHand& hand : physics_->hands) {
      for (std::size_t k = 0; k < hand.links.size(); ++k) {
        WritePieces(hand.links[k].pieces, LinkName(hand, k), folder);
      }
    }
  }

  void WriteXml(std::ofstream& file) {
    file << fmt::format(
        "<mujoco model=\"{}\">\n"
        "  <compiler angle=\"radian\" meshdir=\"{}\"/>\n"
        "  <custom>\n"
        "    <text name=\"generator\" data=\"{}\"/>\n"
        "    <numeric name=\"frame_rate\" data=\"{:.9g}\"/>\n"
        "  </custom>\n{}"
        "    <default class=\"hand\"><geom rgba=\"0.78 0.6 0.5 1\"/></default>\n"
        "  </default>\n",
        Attribute(options_.model_name), Attribute(MjcfAssets(path_).filename().string()),
        Attribute(options_.generator), clip_.frame_rate / options_.every, Engine());
    WriteBodies(file);
    WriteDrives(file);
    WriteKeyFrames(file);
    file << "</mujoco>\n";
  }

  const MjcfReport& Report() const { return report_; }

 private:
  void WeighObject() {
    const EdgeCounts edges =
        CountEdges(object_->faces, EdgeTable(object_->faces, object_->NumVertices()));
    double volume = SignedVolume(*object_);
    report_.mesh_is_hull = edges.non_manifold + edges.misoriented > 0;
    report_.mass_of_hull = report_.mesh_is_hull || edges.boundary > 0 || volume <= kMinVolume_m3;
    if (report_.mass_of_hull) {
      hull_ = ConvexHull(object_->vertices(Eigen::all, object_->faces.reshaped()));
      volume = SignedVolume(hull_);
    }
    if (volume <= kMinVolume_m3) {
      throw Error(path_.string(), "cannot have an object without a volume",
                  "Give a solid mesh with --object, or leave the object out with --no-object");
    }
    if (report_.mesh_is_hull) object_ = &hull_;
    report_.object_mass_kg = volume * options_.density_kg_m3;
  }

  static std::string LinkName(const MjcfHand& hand, std::size_t link) {
    const std::string name = fmt::format("{}_hand", SideName(hand.side));
    if (link == 0) return name;
    const std::string_view joint = kJointNames[HandBegin(hand.side) + static_cast<int>(link) - 1];
    return fmt::format("{}_{}", name, joint.substr(joint.find('_') + 1));
  }

  bool Simulates(int joint) const {
    if (physics_ == nullptr) return false;
    return std::ranges::any_of(physics_->hands, [joint](const MjcfHand& hand) {
      const int finger = joint - HandBegin(hand.side);
      return joint == WristJoint(hand.side) || (finger >= 0 && finger < kJointsPerHand);
    });
  }

  static void WritePieces(const std::vector<TriangleMesh>& pieces, const std::string& name,
                          const std::filesystem::path& folder) {
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      WriteMesh(pieces[k], folder / fmt::format("{}_piece_{}.obj", name, k));
    }
  }

  // Engine options, and defaults up to that of the geometries.
  std::string Engine() const {
    if (physics_ == nullptr) return "  <default>\n    <geom condim=\"4\"/>\n";
    std::string text = fmt::format(
        "  <option timestep=\"{:.9g}\" cone=\"elliptic\" impratio=\"10\" noslip_iterations=\"3\">"
        "<flag multiccd=\"enable\"/></option>\n"
        "  <size njmax=\"4000\" nconmax=\"800\" nstack=\"16000000\"/>\n"
        "  <default>\n"
        "    <geom condim=\"4\" friction=\"{:.9g} {:.9g} 0.0001\" solref=\"0.005 1\"/>\n"
        "    <default class=\"seen\"><geom contype=\"0\" conaffinity=\"0\" mass=\"0\"/></default>\n"
        "    <default class=\"target\"><geom contype=\"0\" conaffinity=\"0\" group=\"4\" "
        "rgba=\"0.78 0.6 0.5 0.3\"/></default>\n"
        "    <default class=\"object\"><geom type=\"mesh\" contype=\"1\" conaffinity=\"3\" "
        "group=\"3\"/></default>\n"
        "    <default class=\"link\"><geom type=\"mesh\" contype=\"2\" conaffinity=\"0\" "
        "rgba=\"0.78 0.6 0.5 1\"/></default>\n",
        physics_->step_s, physics_->friction, physics_->torsion_m);
    for (const MjcfHand& hand : physics_->hands) {
      fmt::format_to(std::back_inserter(text),
                     "    <default class=\"{}\"><joint type=\"ball\" damping=\"{:.9g}\" "
                     "armature=\"{:.9g}\"/></default>\n",
                     LinkName(hand, 0), hand.damping_Nms, hand.inertia_kg_m2);
    }
    return text;
  }

  // Pieces of one body, as assets or as geometries of a class.
  static std::string PieceAssets(const std::vector<TriangleMesh>& pieces, const std::string& name) {
    std::string text;
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      fmt::format_to(std::back_inserter(text),
                     "    <mesh name=\"{0}_piece_{1}\" file=\"{0}_piece_{1}.obj\"/>\n", name, k);
    }
    return text;
  }
  static std::string PieceGeoms(const std::vector<TriangleMesh>& pieces, const std::string& name,
                                const char* kind) {
    std::string text;
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      fmt::format_to(std::back_inserter(text), "<geom class=\"{}\" mesh=\"{}_piece_{}\"/>\n", kind,
                     name, k);
    }
    return text;
  }

  std::string LinkBody(const MjcfHand& hand, std::size_t index, const std::string& place) const {
    const MjcfLink& link = hand.links[index];
    const std::string name = LinkName(hand, index);
    std::string text = fmt::format("<body name=\"{}\" {}>\n", name, place);
    text += link.parent < 0
                ? fmt::format("<freejoint name=\"{}\"/>\n", name)
                : fmt::format("<joint name=\"{}\" class=\"{}\"/>\n", name, LinkName(hand, 0));
    if (link.pieces.empty()) {
      text += "<inertial pos=\"0 0 0\" mass=\"0.001\" diaginertia=\"1e-6 1e-6 1e-6\"/>\n";
    }
    text += PieceGeoms(link.pieces, name, "link");
    for (std::size_t child = index + 1; child < hand.links.size(); ++child) {
      if (hand.links[child].parent != static_cast<int>(index)) continue;
      text += LinkBody(hand, child,
                       Place(RigidTransform(hand.links[child].rest.toRotationMatrix(),
                                            hand.links[child].joint)));
    }
    return text + "</body>\n";
  }

  // Springs of the simulated hands, and welds that pull their palms slowly enough that a player may
  // jump from key frame to key frame.
  void WriteDrives(std::ofstream& file) const {
    if (physics_ == nullptr || physics_->hands.empty()) return;
    file << "  <equality>\n";
    for (const MjcfHand& hand : physics_->hands) {
      file << fmt::format(
          "    <weld body1=\"{}\" body2=\"{}\" solref=\"0.02 1\" solimp=\"0.99 0.999 "
          "0.001\"/>\n",
          kJointNames[WristJoint(hand.side)], LinkName(hand, 0));
    }
    file << "  </equality>\n  <actuator>\n";
    for (const MjcfHand& hand : physics_->hands) {
      for (std::size_t k = 1; k < hand.links.size(); ++k) {
        const MjcfLink& link = hand.links[k];
        for (int i = 0; i < 3; ++i) {
          const Eigen::Vector3d axis = link.axes.col(i);
          file << fmt::format(
              "    <position name=\"{0}_{1}\" joint=\"{0}\" gear=\"{2:.9g} {3:.9g} {4:.9g} 0 0 0\" "
              "kp=\"{5:.9g}\"{6}/>\n",
              LinkName(hand, k), i, axis.x(), axis.y(), axis.z(), link.stiffness_Nm(i),
              link.limit_Nm(i) > 0.0
                  ? fmt::format(" forcelimited=\"true\" forcerange=\"-{0:.9g} {0:.9g}\"",
                                link.limit_Nm(i))
                  : "");
        }
      }
    }
    file << "  </actuator>\n";
  }

  // Appends the pose of a simulated hand in a frame, and the targets of its actuators.
  void AppendHand(const MjcfHand& hand, int t, const BodyState& state,
                  std::vector<Eigen::Quaterniond>& turns, std::string& qpos,
                  std::string& ctrl) const {
    const auto append = [](std::string& text, const std::string& more) {
      text += (text.empty() ? "" : " ") + more;
    };
    std::string position, rotation;
    AppendPose(state.WorldFromJoint(WristJoint(hand.side)), turns[0], position, rotation);
    append(qpos, position + " " + rotation);
    const FingerPose fingers = FingersOf(clip_.pose[t], hand.side);
    for (int j = 0; j < kJointsPerHand; ++j) {
      const auto k = static_cast<std::size_t>(j) + 1;
      const MjcfLink& link = hand.links[k];
      const Eigen::Matrix3d turn =
          link.rest.toRotationMatrix().transpose() * ExpSO3(fingers.segment<3>(3 * j));
      position.clear();
      rotation.clear();
      AppendPose(RigidTransform(turn, Eigen::Vector3d::Zero()), turns[k], position, rotation);
      append(qpos, rotation);
      const Eigen::Vector3d pull = link.axes.transpose() * LogSO3(turn) +
                                   hand.squeeze_Nm[t][j].cwiseQuotient(link.stiffness_Nm);
      append(ctrl, fmt::format("{:.7g} {:.7g} {:.7g}", pull.x(), pull.y(), pull.z()));
    }
  }

  void WriteBodies(std::ofstream& file) const {
    file << "  <asset>\n";
    const auto mesh = [&](std::string_view name) {
      file << fmt::format("    <mesh name=\"{0}\" file=\"{0}.obj\"/>\n", name);
    };
    if (object_ != nullptr) mesh("object");
    if (table_ != nullptr) mesh("table");
    for (const auto& [joint, hull] : pieces_) mesh(kJointNames[joint]);
    if (physics_ != nullptr) {
      file << PieceAssets(physics_->object_pieces, "object");
      for (const MjcfHand& hand : physics_->hands) {
        for (std::size_t k = 0; k < hand.links.size(); ++k) {
          file << PieceAssets(hand.links[k].pieces, LinkName(hand, k));
        }
      }
    }
    file << "  </asset>\n  <worldbody>\n"
            "    <light pos=\"0 0 4\"/>\n"
            "    <geom name=\"floor\" type=\"plane\" size=\"5 5 0.1\" rgba=\"0.8 0.8 0.8 1\"/>\n";
    if (physics_ != nullptr) {
      const Eigen::Matrix3d& I = physics_->inertia;
      const Eigen::Vector3d& center = physics_->center;
      file << fmt::format(
          "    <body name=\"object\" {}>\n"
          "      <freejoint name=\"object\"/>\n"
          "      <inertial pos=\"{:.9g} {:.9g} {:.9g}\" mass=\"{:.9g}\" fullinertia=\"{:.9g} "
          "{:.9g} "
          "{:.9g} {:.9g} {:.9g} {:.9g}\"/>\n"
          "      <geom name=\"object\" class=\"seen\" type=\"mesh\" mesh=\"object\" "
          "rgba=\"0.16 0.38 0.62 1\"/>\n{}    </body>\n",
          Place(clip_.object->Pose(0)), center.x(), center.y(), center.z(), physics_->mass_kg,
          I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2),
          PieceGeoms(physics_->object_pieces, "object", "object"));
    } else if (object_ != nullptr) {
      file << fmt::format(
          "    <body name=\"object\" {}>\n"
          "      <freejoint name=\"object\"/>\n"
          "      <geom name=\"object\" type=\"mesh\" mesh=\"object\" mass=\"{:.9g}\" "
          "rgba=\"0.16 0.38 0.62 1\"/>\n"
          "    </body>\n",
          Place(clip_.object->Pose(0)), report_.object_mass_kg);
    }
    BodyState state;
    ForwardJoints(surface_.RestJoints(), clip_.pose[0], clip_.trans.col(0), state);
    for (const auto& [joint, hull] : pieces_) {
      file << fmt::format(
          "    <body name=\"{0}\" mocap=\"true\" {1}>\n"
          "      <geom name=\"{0}\" type=\"mesh\" mesh=\"{0}\" class=\"{2}\"/>\n"
          "    </body>\n",
          kJointNames[joint], Place(state.WorldFromJoint(joint)),
          Simulates(joint) ? "target" : "hand");
    }
    if (physics_ != nullptr) {
      for (const MjcfHand& hand : physics_->hands) {
        file << LinkBody(hand, 0, Place(state.WorldFromJoint(WristJoint(hand.side))));
      }
    }
    if (table_ != nullptr) {
      file << fmt::format(
          "    <body name=\"table\" {}>\n"
          "      <geom name=\"table\" type=\"mesh\" mesh=\"table\" rgba=\"0.42 0.33 0.24 1\"/>\n"
          "    </body>\n",
          Place(clip_.table->Pose(0)));
    }
    file << "  </worldbody>\n";
  }

  void WriteKeyFrames(std::ofstream& file) {
    // The last quaternion of each body.
    Eigen::Quaterniond object = Eigen::Quaterniond::Identity();
    std::vector<Eigen::Quaterniond> hands(pieces_.size(), object);
    std::vector<std::vector<Eigen::Quaterniond>> simulated(
        static_cast<std::size_t>(report_.simulated_hands),
        std::vector<Eigen::Quaterniond>(1 + kJointsPerHand, object));
    BodyState state;
    file << "  <keyframe>\n";
    for (int t = 0; t < clip_.NumFrames(); t += options_.every) {
      file << fmt::format("    <key name=\"frame_{}\" time=\"{:.9g}\"", t, t / clip_.frame_rate);
      ForwardJoints(surface_.RestJoints(), clip_.pose[t], clip_.trans.col(t), state);
      if (object_ != nullptr) {
        std::string position, rotation, ctrl;
        AppendPose(clip_.object->Pose(t), object, position, rotation);
        std::string qpos = position + " " + rotation;
        for (std::size_t k = 0; k < simulated.size(); ++k) {
          AppendHand(physics_->hands[k], t, state, simulated[k], qpos, ctrl);
        }
        file << fmt::format(" qpos=\"{}\"", qpos);
        if (!ctrl.empty()) file << fmt::format(" ctrl=\"{}\"", ctrl);
      }
      if (!pieces_.empty()) {
        std::string positions, rotations;
        for (std::size_t k = 0; k < pieces_.size(); ++k) {
          AppendPose(state.WorldFromJoint(pieces_[k].first), hands[k], positions, rotations);
        }
        file << fmt::format(" mpos=\"{}\" mquat=\"{}\"", positions, rotations);
      }
      file << "/>\n";
      ++report_.key_frames;
    }
    file << "  </keyframe>\n";
  }

  const Clip& clip_;
  const BodySurface& surface_;
  const TriangleMesh* object_;
  const TriangleMesh* table_;
  const MjcfPhysics* physics_;
  const MjcfOptions& options_;
  const std::filesystem::path& path_;
  std::vector<HandPiece> pieces_;
  TriangleMesh hull_;  // of the object
  MjcfReport report_;
};

}  // namespace

std::filesystem::path MjcfAssets(const std::filesystem::path& path) {
  return path.parent_path() / (path.stem().string() + "_assets");
}

MjcfReport WriteMjcf(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
                     const MjcfOptions& options, const std::filesystem::path& path) {
  MjcfScene scene(clip, surface, object, options, path);
  scene.WriteAssets();
  WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    scene.WriteXml(file);
    file.flush();
    if (!file) {
      throw Error(path.string(), fmt::format("cannot be written ({})", std::strerror(errno)),
                  "Free disk space, or choose another folder");
    }
  });
  return scene.Report();
}

}  // namespace holdfast
