// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/mjcf_writer.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <vector>

#include <fmt/format.h>

#include "geometry/body/hand_parts.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/convex_hull.h"
#include "geometry/mesh/mesh_topology.h"

namespace holdfast {
namespace {

constexpr double kLeastVolume_m3 = 1e-11;  // less is flat to MuJoCo

// The skin that a joint moves most, in the joint's coordinate frame.
struct HandPiece {
  int joint;
  TriangleMesh hull;
};

// An attribute's text: what XML would read otherwise, and what is no character of it, replaced.
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
      const int joint = strongest[static_cast<std::size_t>(corner)];
      if (joint < 0) continue;
      for (const int v : face) {
        if (strongest[static_cast<std::size_t>(v)] >= 0) vertices[joint].insert(v);
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
    if (SignedVolume(hull) > kLeastVolume_m3) pieces.push_back({joint, std::move(hull)});
  }
  return pieces;
}

// Position and quaternion of a body from frame to frame, as text.
class PoseText {
 public:
  void Append(const Eigen::Isometry3d& pose, std::string& position, std::string& rotation) {
    Eigen::Quaterniond q(pose.linear());
    q.normalize();
    if (q.dot(last_) < 0.0) q.coeffs() = -q.coeffs();
    last_ = q;
    const auto at = pose.translation();
    Separate(position);
    fmt::format_to(std::back_inserter(position), "{:.9g} {:.9g} {:.9g}", at.x(), at.y(), at.z());
    Separate(rotation);
    fmt::format_to(std::back_inserter(rotation), "{:.9g} {:.9g} {:.9g} {:.9g}", q.w(), q.x(), q.y(),
                   q.z());
  }

 private:
  static void Separate(std::string& text) {
    if (!text.empty()) text += ' ';
  }
  Eigen::Quaterniond last_ = Eigen::Quaterniond::Identity();
};

// pos="..." quat="..."
std::string Place(const Eigen::Isometry3d& pose) {
  std::string position, rotation;
  PoseText().Append(pose, position, rotation);
  return fmt::format("pos=\"{}\" quat=\"{}\"", position, rotation);
}

class MjcfScene {
 public:
  MjcfScene(const Clip& clip, const BodySurface& surface, const TriangleMesh* object,
            const MjcfOptions& options, const std::filesystem::path& path)
      : clip_(clip),
        surface_(surface),
        object_(clip.object ? object : nullptr),
        table_(clip.table ? options.table : nullptr),
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
  }

  void WriteAssets() const {
    const std::filesystem::path folder = MjcfAssets(path_);
    if (object_ != nullptr) WriteMesh(*object_, folder / "object.obj");
    if (table_ != nullptr) WriteMesh(*table_, folder / "table.obj");
    for (const HandPiece& piece : pieces_) {
      WriteMesh(piece.hull, folder / fmt::format("{}.obj", kJointNames[piece.joint]));
    }
  }

  void WriteXml(std::ofstream& file) {
    file << fmt::format(
        "<mujoco model=\"{}\">\n"
        "  <compiler angle=\"radian\" meshdir=\"{}\"/>\n"
        "  <custom>\n"
        "    <text name=\"generator\" data=\"{}\"/>\n"
        "    <numeric name=\"frame_rate\" data=\"{:.9g}\"/>\n"
        "  </custom>\n"
        "  <default>\n"
        "    <geom condim=\"4\"/>\n"
        "    <default class=\"hand\"><geom rgba=\"0.78 0.6 0.5 1\"/></default>\n"
        "  </default>\n",
        Attribute(options_.model_name), Attribute(MjcfAssets(path_).filename().string()),
        Attribute(options_.generator), clip_.frame_rate / options_.every);
    WriteBodies(file);
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
    report_.mass_of_hull = report_.mesh_is_hull || edges.boundary > 0 || volume <= kLeastVolume_m3;
    if (report_.mass_of_hull) {
      hull_ = ConvexHull(object_->vertices(Eigen::all, object_->faces.reshaped()));
      volume = SignedVolume(hull_);
    }
    if (volume <= kLeastVolume_m3) {
      throw Error(path_.string(), "cannot have an object without a volume",
                  "Give a solid mesh with --object, or leave the object out with --no-object");
    }
    if (report_.mesh_is_hull) object_ = &hull_;
    report_.object_mass_kg = volume * options_.density_kg_m3;
  }

  void WriteBodies(std::ofstream& file) const {
    file << "  <asset>\n";
    const auto mesh = [&](std::string_view name) {
      file << fmt::format("    <mesh name=\"{0}\" file=\"{0}.obj\"/>\n", name);
    };
    if (object_ != nullptr) mesh("object");
    if (table_ != nullptr) mesh("table");
    for (const HandPiece& piece : pieces_) mesh(kJointNames[piece.joint]);
    file << "  </asset>\n  <worldbody>\n"
            "    <light pos=\"0 0 4\"/>\n"
            "    <geom name=\"floor\" type=\"plane\" size=\"5 5 0.1\" rgba=\"0.8 0.8 0.8 1\"/>\n";
    if (object_ != nullptr) {
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
    for (const HandPiece& piece : pieces_) {
      file << fmt::format(
          "    <body name=\"{0}\" mocap=\"true\" {1}>\n"
          "      <geom name=\"{0}\" type=\"mesh\" mesh=\"{0}\" class=\"hand\"/>\n"
          "    </body>\n",
          kJointNames[piece.joint], Place(state.WorldFromJoint(piece.joint)));
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
    PoseText object;
    std::vector<PoseText> hands(pieces_.size());
    BodyState state;
    file << "  <keyframe>\n";
    for (int t = 0; t < clip_.NumFrames(); t += options_.every) {
      file << fmt::format("    <key name=\"frame_{}\" time=\"{:.9g}\"", t, t / clip_.frame_rate);
      if (object_ != nullptr) {
        std::string position, rotation;
        object.Append(clip_.object->Pose(t), position, rotation);
        file << fmt::format(" qpos=\"{} {}\"", position, rotation);
      }
      if (!pieces_.empty()) {
        std::string positions, rotations;
        ForwardJoints(surface_.RestJoints(), clip_.pose[t], clip_.trans.col(t), state);
        for (std::size_t k = 0; k < pieces_.size(); ++k) {
          hands[k].Append(state.WorldFromJoint(pieces_[k].joint), positions, rotations);
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
