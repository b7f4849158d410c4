// SPDX-License-Identifier: MIT
#include "geometry/inspect/convert_commands.h"

#include <cmath>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "geometry/body_model.h"
#include "geometry/inspect/inspection.h"

namespace holdfast {
namespace {

std::string Python(const std::string& code, const std::filesystem::path& path,
                   const std::string& suffix) {
  return fmt::format("python3 -c 'import sys, numpy as np; {}' {} {}", code, ShellWord(path),
                     ShellWord(Stem(path) + suffix + ".npz"));
}

// Loads a clip as a dictionary, changes it, saves it.
std::string Change(const std::string& code, const std::filesystem::path& path,
                   const std::string& suffix) {
  return Python("d = dict(np.load(sys.argv[1])); " + code + "; np.savez(sys.argv[2], **d)", path,
                suffix);
}

}  // namespace

std::string ConvertCommand(const std::filesystem::path& path, FileKind kind) {
  switch (kind) {
    case FileKind::kSmplhMotion:
    case FileKind::kSmplMotion: {
      const bool hands = kind == FileKind::kSmplhMotion;
      return Python(
          fmt::format("d = np.load(sys.argv[1]); p = d[\"poses\"]; np.savez(sys.argv[2], "
                      "mocap_frame_rate=d[\"mocap_framerate\" if \"mocap_framerate\" in d else "
                      "\"mocap_frame_rate\"], trans=d[\"trans\"], root_orient=p[:, :3], "
                      "pose_body=p[:, 3:66]{})",
                      hands ? ", pose_hand=p[:, 66:156]" : ""),
          path, "_smplx");
    }
    case FileKind::kGrab:
      return Python(
          "d = np.load(sys.argv[1], allow_pickle=True); b = d[\"body\"].item()[\"params\"]; o = "
          "d[\"object\"].item()[\"params\"]; p = b[\"fullpose\"]; np.savez(sys.argv[2], "
          "mocap_frame_rate=float(d[\"framerate\"]), trans=b[\"transl\"], root_orient=p[:, :3], "
          "pose_body=p[:, 3:66], pose_jaw=p[:, 66:69], pose_eye=p[:, 69:75], "
          "pose_hand=p[:, 75:165], object_trans=o[\"transl\"], "
          "object_orient=-o[\"global_orient\"], object_name=str(d[\"obj_name\"]), "
          "gender=str(d[\"gender\"]))",
          path, "_clip");
    default:
      return Python(
          "d = np.load(sys.argv[1]); n = d[\"body_pose\"].size // 63; g = lambda k, w: "
          "d[k].reshape(n, w) if k in d else np.zeros((n, w)); np.savez(sys.argv[2], "
          "mocap_frame_rate=30.0, trans=g(\"transl\", 3), root_orient=g(\"global_orient\", 3), "
          "pose_body=g(\"body_pose\", 63), pose_jaw=g(\"jaw_pose\", 3), "
          "pose_hand=np.hstack([g(\"left_hand_pose\", 45), g(\"right_hand_pose\", 45)]))",
          path, "_clip");
  }
}

std::string TurnUpCommand(const std::filesystem::path& path, int axis, int sign) {
  // The quaternion that carries the axis to z, and the pelvis that the root turns about.
  const Eigen::Quaterniond q = Eigen::Quaterniond::FromTwoVectors(
      sign * Eigen::Vector3d::Unit(axis), Eigen::Vector3d::UnitZ());
  const auto body = BodyModel::Default();
  const Eigen::Vector3d pelvis = body->RestJoints(body->Template()).col(0);
  const Eigen::Matrix3d R = q.toRotationMatrix();
  const auto row = [](const auto& v) {
    // Adding zero makes a negative zero positive.
    return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v[0] + 0.0, v[1] + 0.0, v[2] + 0.0);
  };
  const auto rounded = [](double x) { return std::abs(x) < 1e-12 ? 0.0 : x; };
  const Eigen::Matrix3d T = R.unaryExpr(rounded);
  const Eigen::Vector3d v = q.vec().unaryExpr(rounded);
  return Change(
      fmt::format("Q = np.array([{}, {}, {}]); u = np.array({}); J = np.array({})\n"
                  "def turn(w):\n"
                  "  a = np.linalg.norm(w, axis=1, keepdims=True); c = np.cos(a / 2)\n"
                  "  s = w * np.sinc(a / 2 / np.pi) / 2\n"
                  "  C = {:.6g} * c - s @ u[:, None]; V = {:.6g} * s + c * u + np.cross(u, s)\n"
                  "  n = np.linalg.norm(V, axis=1, keepdims=True)\n"
                  "  return 2 * np.arctan2(n, C) * V / np.maximum(n, 1e-12)\n"
                  "d[\"trans\"] = (d[\"trans\"] + J) @ Q.T - J\n"
                  "if \"poses\" in d: d[\"poses\"] = np.hstack([turn(d[\"poses\"][:, :3]), "
                  "d[\"poses\"][:, 3:]])\n"
                  "if \"root_orient\" in d: d[\"root_orient\"] = turn(d[\"root_orient\"])\n"
                  "if \"object_orient\" in d: d[\"object_orient\"] = turn(d[\"object_orient\"]); "
                  "d[\"object_trans\"] = d[\"object_trans\"] @ Q.T\n"
                  "pass",
                  row(T.row(0)), row(T.row(1)), row(T.row(2)), row(v), row(pelvis), q.w(), q.w()),
      path, "_zup");
}

std::string ScaleCommand(const std::filesystem::path& path, double factor) {
  return Change(fmt::format("d.update({{k: d[k] * {:g} for k in (\"trans\", \"object_trans\") if k "
                            "in d}})",
                            factor),
                path, "_m");
}

std::string TransposeObjectCommand(const std::filesystem::path& path) {
  return Change("d[\"object_orient\"] = -d[\"object_orient\"]", path, "_columns");
}

}  // namespace holdfast
