// SPDX-License-Identifier: MIT
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/resample.h"
#include "geometry/export/export_clip.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "geometry/score/contact_score.h"
#include "geometry/score/contact_writer.h"

namespace holdfast {
namespace {

using nlohmann::json;

constexpr double kStep = 1e-6;  // rounding, meters and units of quaternions

double Rounded(double value) { return std::round(value / kStep) * kStep; }

json Vector(const Eigen::Vector3d& v) { return {Rounded(v.x()), Rounded(v.y()), Rounded(v.z())}; }

json Pose(const Eigen::Isometry3d& pose) {
  Eigen::Quaterniond q(pose.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return {{"position", Vector(pose.translation())},
          {"wxyz", {Rounded(q.w()), Rounded(q.x()), Rounded(q.y()), Rounded(q.z())}}};
}

json MeshJson(const std::string& name, const TriangleMesh& mesh) {
  json vertices = json::array(), faces = json::array();
  for (int v = 0; v < mesh.NumVertices(); ++v) vertices.push_back(Vector(mesh.vertices.col(v)));
  for (int f = 0; f < mesh.NumFaces(); ++f) {
    faces.push_back({mesh.faces(0, f), mesh.faces(1, f), mesh.faces(2, f)});
  }
  return {{"name", name}, {"vertices", vertices}, {"faces", faces}};
}

}  // namespace

void WriteSceneLines(const ClipScene& scene, const TriangleMesh* object,
                     const ExportOptions& options, const std::filesystem::path& path) {
  const Clip& clip = scene.clip;
  const TriangleMesh* table = TableMesh(clip);
  json head = {{"schema", "holdfast/scene-lines/1"},
               {"generator", options.generator},
               {"name", options.name},
               {"up", "z"},
               {"meters_per_unit", 1},
               {"frame_rate", clip.frame_rate},
               {"frames", clip.NumFrames()},
               {"joints", kJointNames},
               {"parents", kJointParents}};
  if (object != nullptr) head["object"] = MeshJson(clip.object->name, *object);
  if (table != nullptr) head["table"] = MeshJson("table", *table);
  std::optional<ClipContactPoints> contacts;
  if (object != nullptr) {
    contacts = FindContactPoints(clip, scene.body, scene.betas, SignedDistance(*object),
                                 1e-3 * ContactProtocol().contact_threshold_mm, options.threads);
    head["contact_threshold_m"] = contacts->threshold_m;
  }
  std::string text = JsonText(head) + "\n";
  const Eigen::Matrix3Xd rest = scene.Surface().RestJoints();
  BodyState state;
  std::size_t next = 0;  // of the contact points, which are by frame
  for (const int t : EveryFrame(clip.NumFrames(), options.every)) {
    ForwardJoints(rest, clip.pose[t], clip.trans.col(t), state);
    json line = {{"frame", t}, {"time_s", Rounded(t / clip.frame_rate)}, {"joints", json::array()}};
    for (int j = 0; j < kNumJoints; ++j) line["joints"].push_back(Pose(state.WorldFromJoint(j)));
    if (object != nullptr) {
      line["object"] = Pose(clip.object->Pose(t));
      line["contacts"] = json::array();
      for (; next < contacts->points.size() && contacts->points[next].frame <= t; ++next) {
        const ContactPoint& point = contacts->points[next];
        if (point.frame < t) continue;
        const Eigen::Isometry3d& world = contacts->object[static_cast<std::size_t>(t)];
        line["contacts"].push_back({{"hand", SideName(point.side)},
                                    {"part", kHandParts[static_cast<std::size_t>(point.part)]},
                                    {"point", Vector(world * point.in_object)},
                                    {"normal", Vector(world.linear() * point.normal_in_object)},
                                    {"depth_m", Rounded(point.depth_m)}});
      }
    }
    if (table != nullptr) line["table"] = Pose(clip.table->Pose(t));
    text += JsonText(line) + "\n";
  }
  WriteAtomically(path, text);
}

}  // namespace holdfast
