// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/container/npz.h"
#include "tests/support/zip_bytes.h"

namespace holdfast::testing {

// Files in the layouts of published data sets, written from a clip of the embedded body as a
// capture of the same motion would be.

/// Rest pelvises of the models that the data sets are made with.
inline Eigen::Vector3d SmplxPelvis() { return {0.0031, -0.3514, 0.0120}; }
inline Eigen::Vector3d SmplhPelvis() { return {-0.0018, -0.2233, 0.0282}; }

/// trans for a model with its pelvis elsewhere: joint 0 stays where it is.
inline Eigen::Matrix3Xd TransFor(const Clip& clip, const Eigen::Vector3d& pelvis) {
  const auto body = BodyModel::Default();
  const Eigen::Vector3d own = body->RestJoints(body->Template()).col(0);
  return clip.trans.colwise() + (own - pelvis);
}

/// Angles of `count` joints from `begin` on, one row a frame.
inline std::vector<double> JointRows(const Clip& clip, int begin, int count) {
  std::vector<double> rows;
  for (const JointPose& pose : clip.pose) {
    const auto part = pose.middleCols(begin, count).reshaped();
    rows.insert(rows.end(), part.begin(), part.end());
  }
  return rows;
}

inline std::vector<double> Rows(const Eigen::Matrix3Xd& columns) {
  return {columns.data(), columns.data() + columns.size()};
}

/// Values in Python's pickle format (protocol 3), as numpy writes dictionaries of arrays.
class PickleText {
 public:
  static std::string Text(const std::string& text) {
    return "X" + LittleEndian(text.size(), 4) + text;
  }
  static std::string Number(double value) {
    std::string bytes = LittleEndian(std::bit_cast<std::uint64_t>(value), 8);
    return "G" + std::string(bytes.rbegin(), bytes.rend());
  }
  template <typename T>
  static std::string Array(const std::string& type, const std::vector<T>& values,
                           const std::vector<std::size_t>& shape) {
    const std::string bytes = BytesOf(values);
    return Array(type, type == "u1" ? "|" : "<", shape,
                 "B" + LittleEndian(bytes.size(), 4) + bytes);
  }
  /// An array of no dimension with one object in it: what np.savez makes of a dictionary.
  static std::string Scalar(const std::string& object) {
    return "\x80\x03" + Array("O8", "|", {}, "]" + object + "a") + ".";
  }
  static std::string Dictionary(const std::vector<std::pair<std::string, std::string>>& items) {
    std::string bytes = "}(";
    for (const auto& [key, value] : items) bytes += Text(key) + value;
    return bytes + "u";
  }

 private:
  static std::string Array(const std::string& type, const std::string& order,
                           const std::vector<std::size_t>& shape, const std::string& data) {
    std::string dimensions = "(";
    for (const std::size_t size : shape) dimensions += "J" + LittleEndian(size, 4);
    dimensions += "t";
    const std::string minus_one = "J" + LittleEndian(0xffffffffu, 4);
    return "cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(K" + std::string(1, '\0') +
           "tC\x01" + "btR(K\x01" + dimensions + "cnumpy\ndtype\n(" + Text(type) + "K" +
           std::string(1, '\0') + "K\x01tR(K\x03" + Text(order) + "NNN" + minus_one + minus_one +
           "K" + std::string(1, '\0') + "tb\x89" + data + "tb";
  }
};

/// A GRAB sequence of `clip`, which holds `mesh_name` in the right hand; `vertices` of that mesh.
/// Its rotations of the object are for row vectors, its root turns about SMPL-X's pelvis.
inline void WriteGrab(const Clip& clip, const std::string& mesh_name, std::size_t vertices,
                      const std::filesystem::path& path) {
  using P = PickleText;
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  const auto rows = [&](const std::vector<double>& values) {
    return P::Array("f8", values, {frames, values.size() / frames});
  };
  const std::string body = P::Dictionary(
      {{"params", P::Dictionary({{"transl", rows(Rows(TransFor(clip, SmplxPelvis())))},
                                 {"fullpose", rows(JointRows(clip, 0, kNumJoints))}})},
       {"vtemp", P::Text("tools/subject_meshes/male/s1.ply")}});
  const std::string object = P::Dictionary(
      {{"params", P::Dictionary({{"transl", rows(Rows(clip.object->trans))},
                                 {"global_orient", rows(Rows(-clip.object->orient))}})},
       {"object_mesh", P::Text(mesh_name)}});
  std::vector<std::uint8_t> labels(frames * vertices, 0);
  for (std::size_t t = 0; t < frames; ++t) labels[t * vertices] = 22;  // the right palm
  const std::string contact =
      P::Dictionary({{"object", P::Array("u1", labels, {frames, vertices})}});
  std::vector<ZipPart> parts;
  const auto add = [&](const std::string& name, const std::string& value) {
    parts.push_back(
        {name + ".npy",
         NpyBytes("{'descr': '|O', 'fortran_order': False, 'shape': (), }", P::Scalar(value)), 8});
  };
  add("body", body);
  add("object", object);
  add("contact", contact);
  add("gender", P::Text("male"));
  add("obj_name", P::Text("mug"));
  add("sbj_id", P::Text("s1"));
  add("motion_intent", P::Text("use"));
  add("framerate", P::Number(clip.frame_rate));
  std::ofstream(path, std::ios::binary) << ZipBytes(parts);
}

/// AMASS's SMPL-X files: parts, all joints, markers.
inline void WriteAmassSmplx(const Clip& clip, const std::filesystem::path& path) {
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  NpzWriter writer;
  const auto add = [&](const char* name, std::vector<double> rows) {
    const std::size_t columns = rows.size() / frames;
    writer.AddFloat64(name, {frames, columns}, std::move(rows));
  };
  add("trans", Rows(TransFor(clip, SmplxPelvis())));
  add("root_orient", JointRows(clip, 0, 1));
  add("pose_body", JointRows(clip, 1, 21));
  add("pose_jaw", JointRows(clip, 22, 1));
  add("pose_eye", JointRows(clip, 23, 2));
  add("pose_hand", JointRows(clip, kLeftHandBegin, 2 * kJointsPerHand));
  add("poses", JointRows(clip, 0, kNumJoints));
  add("markers_latent", std::vector<double>(frames * 3, 0.0));
  writer.AddFloat64("betas", {16}, std::vector<double>(16, 0.3));
  writer.AddText("gender", "female");
  writer.AddText("surface_model_type", "smplx");
  writer.AddFloat64("mocap_frame_rate", {}, {clip.frame_rate});
  writer.Write(path);
}

/// AMASS's SMPL-H files: 52 joints in one array.
inline void WriteAmassSmplh(const Clip& clip, const std::filesystem::path& path) {
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  const std::vector<double> body = JointRows(clip, 0, kNumBodyJoints),
                            hands = JointRows(clip, kLeftHandBegin, 2 * kJointsPerHand);
  std::vector<double> poses;
  for (std::size_t t = 0; t < frames; ++t) {
    poses.insert(poses.end(), body.begin() + static_cast<std::ptrdiff_t>(66 * t),
                 body.begin() + static_cast<std::ptrdiff_t>(66 * (t + 1)));
    poses.insert(poses.end(), hands.begin() + static_cast<std::ptrdiff_t>(90 * t),
                 hands.begin() + static_cast<std::ptrdiff_t>(90 * (t + 1)));
  }
  NpzWriter writer;
  writer.AddFloat64("poses", {frames, 156}, std::move(poses));
  writer.AddFloat64("trans", {frames, 3}, Rows(TransFor(clip, SmplhPelvis())));
  writer.AddFloat64("betas", {16}, std::vector<double>(16, 0.3));
  writer.AddFloat64("dmpls", {frames, 8}, std::vector<double>(frames * 8, 0.0));
  writer.AddText("gender", "male");
  writer.AddFloat64("mocap_framerate", {}, {clip.frame_rate});
  writer.Write(path);
}

}  // namespace holdfast::testing
